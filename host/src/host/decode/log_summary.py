"""The figures `host decode` prints, as data first and as text second."""

from __future__ import annotations

from typing import Any

import numpy as np

from host.constants import METRES_PER_DEG
from host.log import FlightLog
from host.log.calibration_note import calibration_note
from host.log.quality import Quality, judge
from host.physical.channels import constant_delay_us
from host.physical.columns import ANALOGUE, INERTIAL
from host.physical.session import Session
from host.terminal import command_line
from host.text import shown
from host.wire.schema_text import packed_schema

Json = dict[str, Any]
_JUMPS = 1000  # of each servo, by their time; all are counted

_ENDED = {
    "next_boot": "closed at the next boot",
    "no_flight": "continued after a reset in doubt, and it was the ground",
}


def summarise(log: FlightLog) -> Json:
    """Return the summary of a log as plain numbers, lists and words.

    Parameters
    ----------
    log : FlightLog

    Returns
    -------
    dict
        Ready for ``json.dumps``; the keys are those of ``host decode --json``.
    """
    sessions = [_session(log, session) for session in log.sessions]
    return {
        "file": str(log.path),
        "file_id": f"{log.selection.file_id:08x}",
        "received": log.stream is not None,
        "begins_at_byte": log.selection.base,
        "schema": f"{log.schema.hash:08x}",
        "complete": log.complete,
        "duration_s": sum(session.duration_s for session in log.sessions),
        "rows": sum(session.rows for session in log.sessions),
        "frames": {
            name: len(log.store[name].data) for name in log.schema.by_name if name != "ident"
        }
        | {"ident": sum(session.rows for session in log.sessions)},
        "sessions": sessions,
        "clock": _clock(log),
        "gps": _gps(log),
        "inputs": dict(log.inputs),
        "losses": _losses(log),
        "older_data": [
            {
                "file_id": f"{other.file_id:08x}",
                "sessions": list(other.sessions),
                "blocks": other.blocks,
                "offset": other.offset,
            }
            for other in log.selection.foreign
        ],
        "duplicate_blocks": log.selection.duplicates if log.stream is None else 0,
        "displaced_blocks": log.selection.displaced,
        "calibration": calibration_note(log),
        "delays_us": delays_us(log),
        "next": command_line("host", "info", log.path),
    }


def delays_us(log: FlightLog) -> dict[str, float | str]:
    """Return the nominal sampling delays that the table removed, by column, microseconds."""
    out: dict[str, float | str] = {}
    dlpf = log.sessions[0].dlpf if log.sessions else 3
    frame = log.schema.by_name["ident"]
    for name, (column, _) in ANALOGUE.items():
        out[column] = constant_delay_us(frame.field(name), dlpf)
    for name, (column, _, _) in INERTIAL.items():
        out[column] = constant_delay_us(frame.field(name), dlpf)
    return out


def _session(log: FlightLog, session: Session) -> Json:
    quality = judge(session)
    return {
        "number": session.number,
        "rows": session.rows,
        "duration_s": session.duration_s,
        "starts_at_t_s": session.offset_s,
        "rate_hz": session.rate_hz,
        "jitter_us": quality.jitter_us,
        "sensors": _sensors(session, quality),
        "stuck": quality.stuck,
        "saturated": quality.saturated,
        "imu_saturated_share": quality.imu_saturated,
        "absent": quality.absent,
        "pairs": {
            name: {
                "rows": pair.rows,
                "mean_difference": pair.mean,
                "deviation": pair.deviation,
                "unit": pair.unit,
                "disagrees": pair.disagrees,
            }
            for name, pair in quality.pairs.items()
            if pair.rows
        },
        "servo_jumps": {
            name: {"count": len(found), "t_s": found[:_JUMPS]}
            for name, found in quality.servo_jumps.items()
        },
        "ended": _reason(log, session),
        **_identity(session),
    }


def _reason(log: FlightLog, session: Session) -> str:
    events, _ = session.slow("event")
    ends = events[events["code"] == log.schema.number("event", "session_end")]
    if not len(ends):
        return "the log ends before the recorder said why"
    # Logs before these words have the same numbers.
    words = log.schema if "end_cause" in log.schema.enums else packed_schema()
    word = words.word("end_cause", int(ends["arg"][-1]))
    return _ENDED.get(word, shown(word.replace("_", " ")))


def _identity(session: Session) -> Json:
    out: Json = {}
    for name, fields in (("identity", ("board", "firmware")), ("config", ("aircraft",))):
        data, _ = session.slow(name)
        for field in fields:
            out[field] = shown(bytes(data[field][-1]).rstrip(b"\0")) if len(data) else ""
    return out | {"image": _image(session)}


def _image(session: Session) -> str:
    """Return the hash of the image that recorded, eight hexadecimal digits; empty if unknown."""
    data, _ = session.slow("image")
    known = len(data) and "hash" in (data.dtype.names or ()) and data["hash"].dtype == np.uint32
    return f"{int(data['hash'][-1]):08x}" if known and data["hash"][-1] else ""


def _sensors(session: Session, quality: Quality) -> list[str]:
    schema = session.store.schema
    system, _ = session.slow("system")
    seen = int(np.bitwise_or.reduce(system["sensors"])) if len(system) else 0
    names = [name for at, name in enumerate(schema.bits.get("sensors", ())) if seen >> at & 1]
    return names + [name for name in ANALOGUE if name not in quality.absent and session.rows]


def _clock(log: FlightLog) -> Json | None:
    clock = log.clock
    if clock is None:
        return None
    return {
        "scale_error_ppm": clock.scale_error * 1e6,
        "half_width_95_ppm": clock.half_width * 1e6,
        "fixes": clock.fixes,
        "residual_ms": clock.residual_ms,
        "applied": clock.applied,
    }


def _gps(log: FlightLog) -> Json | None:
    data = log.frames["gps"]
    schema = log.schema
    fixes = (schema.number("gps_fix", "fix_2d"), schema.number("gps_fix", "fix_3d"))
    good = data[np.isin(data["fix"], fixes)]
    if not len(good):
        return None
    north_m = np.ptp(good["latitude"].astype(float)) * 1e-7 * METRES_PER_DEG
    middle = np.deg2rad(float(good["latitude"].mean()) * 1e-7)
    east_m = np.ptp(good["longitude"].astype(float)) * 1e-7 * METRES_PER_DEG * np.cos(middle)
    return {
        "solutions": len(data),
        "with_fix": len(good),
        "north_span_m": float(north_m),
        "east_span_m": float(east_m),
        "height_span_m": float(np.ptp(good["height"].astype(float)) * 1e-3),
        "satellites": int(np.median(good["satellites"])),
    }


def _losses(log: FlightLog) -> Json:
    ledger = log.loss
    return {
        "unproven_bytes": ledger.unproven_bytes,
        "ending": ledger.ending,
        "ranges": [
            {
                "cause": loss.cause,
                "offset": loss.offset,
                "length": loss.length,
                "blocks": loss.blocks,
                "frames": loss.frames,
                "seconds": loss.seconds,
                "other_frames": loss.other_frames,
                "t_s": loss.t_s,
                "ranges": loss.ranges,
                "text": loss.sentence(),
            }
            for loss in ledger.losses
        ],
        "bytes": ledger.lost_bytes,
        "frames": ledger.frames,
        "seconds": ledger.seconds,
        "dropped_frames": ledger.dropped_frames,
    }
