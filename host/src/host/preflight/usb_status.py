"""Turn the status line of USB into the readings that the radio's frames would give."""

from __future__ import annotations

from typing import Any

from host.link.status_line import StatusLine

_FIXES = {0: "none", 1: "dead reckoning", 2: "fix 2d", 3: "fix 3d"}
_READY = ("ready", "ready, small", "open flight")


def status_readings(line: StatusLine, t_s: float) -> dict[str, dict[str, Any]]:
    """Return readings by frame; None or zero where the line does not say.

    Parameters
    ----------
    line : StatusLine
    t_s : float
        When it came, on the clock of the rows.
    """
    known = line.as_json()
    card, gps, baro = line.state("card"), known["gps"], known["baro"]
    ready = card in _READY
    rail_mv, supply_mv = known["rail_mv"], known["supply_mv"]
    found: dict[str, dict[str, Any]] = {
        "status": {"card": _card(line), "board": line.board, "firmware": line.version},
        "system": {
            "uptime_s": None,
            "sensors": ["card"] if ready else [],
            **dict.fromkeys(
                ("card_errors", "rc_glitches", "gps_errors", "baro_errors", "imu_packets",
                 "imu_bad_packets", "imu_lost"), 0
            ),
            "rail_v": None if rail_mv is None else float(str(rail_mv)) * 1e-3,
            "supply_v": None if supply_mv is None else float(str(supply_mv)) * 1e-3,
            "drive": str(known["servos_by"]),
        },
    }  # fmt: skip
    if isinstance(gps, dict) and gps["state"] == "ok" and gps["fix"] is not None:
        found["gps"] = {
            "itow_ms": round(t_s * 1e3), "fix": _FIXES.get(gps["fix"], "none"),
            "satellites": gps["satellites"], "latitude": 0.0, "longitude": 0.0,
            "h_accuracy": None, "ground_speed": None,
        }  # fmt: skip
    if isinstance(baro, dict) and baro["state"] == "ok":
        found["baro"] = {
            "raw_pressure": round(t_s * 1e3), "static_pressure": baro["static_pressure_pa"],
        }  # fmt: skip
    return found


def _card(line: StatusLine) -> str:
    """Return what the line says of the card, with what to do."""
    hints = [one.removeprefix("card ") for one in line.complaints() if one.startswith("card ")]
    return hints[0] if hints else line.fields["card"]
