"""The summary of a log in words, for a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from host.people_units import people_unit

_SHOWN = 12
_WIDTH = 13


def lines(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of a summary made by `host.decode.log_summary.summarise`."""
    where = "from the radio" if summary["received"] else f"file id {summary['file_id']}"
    yield _row("log", f"{summary['file']}  {where}, {summary['complete']}")
    if summary["begins_at_byte"]:
        yield _row("", f"it begins at byte {summary['begins_at_byte']} of this file")
    yield _row("duration", f"{summary['duration_s']:.2f} s, {summary['rows']} rows")
    frames = summary["frames"]
    yield _row("frames", ", ".join(f"{name} {count}" for name, count in frames.items() if count))
    sessions = summary["sessions"]
    for session in sessions[:_SHOWN]:
        yield from _session(session)
    if len(sessions) > _SHOWN:
        yield _row("", f"... and {len(sessions) - _SHOWN} more sessions: --json lists all")
    yield _row("clock", _clock(summary["clock"]))
    yield _row("GPS", _gps(summary["gps"]))
    inputs = [f"{surface} {source}" for surface, source in summary["inputs"].items()]
    yield _row("inputs", ", ".join(inputs) + ", throttle commanded")
    yield from _losses(summary["losses"])
    older = summary["older_data"]
    for other in older[:_SHOWN]:
        numbers = other["sessions"]
        listed = ", ".join(str(number) for number in numbers[:_SHOWN])
        listed += ", ..." if len(numbers) > _SHOWN else ""
        yield _row(
            "older data",
            f"{other['blocks']} blocks of file id {other['file_id']} (session {listed}) from byte"
            f" {other['offset']}: not part of this log; --file-id {other['file_id']} decodes them",
        )
    if len(older) > _SHOWN:
        yield _row("", f"... and {len(older) - _SHOWN} more: --json lists all")
    for key, text in (
        ("duplicate_blocks", "blocks stand in the file twice: used once"),
        ("displaced_blocks", "blocks stand out of order: put back in order"),
    ):
        if summary[key]:
            yield _row("order", f"{summary[key]} {text}")
    yield from _calibration(summary["calibration"])


def _session(session: Mapping[str, Any]) -> Iterator[str]:
    image = f"image {session['image']}" if session["image"] else ""
    who = ", ".join(
        filter(None, (session["board"], session["firmware"], image, session["aircraft"]))
    )
    if not session["duration_s"]:
        yield _row(f"session {session['number']}", "no rows: switched off before it recorded")
        return
    yield _row(
        f"session {session['number']}",
        f"{session['duration_s']:.2f} s at {session['rate_hz']:g} Hz from t ="
        f" {session['starts_at_t_s']:.2f} s; ended: {session['ended']}"
        + (f" ({who})" if who else ""),
    )
    jitter = session["jitter_us"]
    if jitter:
        yield _row(
            "  jitter",
            f"p50 {jitter['p50']:.0f} us, p99 {jitter['p99']:.0f} us, max {jitter['max']:.0f} us",
        )
    yield _row("  sensors", ", ".join(session["sensors"]) or "no frame of a sensor in the log")
    for name, seconds in session["stuck"].items():
        yield _row("  STUCK", f"{name} did not move for {seconds:.1f} s")
    for name, share in session["saturated"].items():
        yield _row("  SATURATED", f"{name} at an end of its range in {share:.2%} of rows")
    if session["imu_saturated_share"]:
        yield _row("  SATURATED", f"IMU says so in {session['imu_saturated_share']:.2%} of samples")
    for name, pair in session["pairs"].items():
        unit, factor = people_unit(pair["unit"])
        label = "  DISAGREE" if pair["disagrees"] else "  pair"
        yield _row(
            label,
            f"{name} left - right: mean {factor * pair['mean_difference']:+.4g} {unit}, deviation"
            f" {factor * pair['deviation']:.4g} {unit}",
        )
    for name, found in session["servo_jumps"].items():
        yield _row(
            "  JUMPS",
            f"{name} servo: {found['count']} pulses left and came back within 0.15 s though the"
            f" stick stood still, the first at t = {found['t_s'][0]:.2f} s",
        )
    if session["absent"]:
        yield _row("  not valid", ", ".join(session["absent"]))


def _clock(clock: Mapping[str, Any] | None) -> str:
    if clock is None:
        return "not checked: too few GPS solutions; the Mega's resonator is good to about 0.5 %"
    applied = "t_s corrected" if clock["applied"] else "t_s not corrected: needs 20 s of GPS"
    return (
        f"scale error {clock['scale_error_ppm']:+.1f} ppm +- {clock['half_width_95_ppm']:.1f} ppm"
        f" (95 %) against GPS, {clock['fixes']} solutions; {applied}"
    )


def _gps(gps: Mapping[str, Any] | None) -> str:
    if gps is None:
        return "no fix"
    return (
        f"{gps['with_fix']} of {gps['solutions']} solutions with a fix; spans"
        f" {gps['north_span_m']:.0f} m north, {gps['east_span_m']:.0f} m east,"
        f" {gps['height_span_m']:.0f} m height; {gps['satellites']} satellites"
    )


def _losses(losses: Mapping[str, Any]) -> Iterator[str]:
    ranges = losses["ranges"]
    if not ranges:
        yield _row("losses", losses["ending"] or "none")
        return
    yield _row(
        "losses",
        f"{sum(loss['ranges'] for loss in ranges)} ranges: {losses['bytes']} bytes,"
        f" {losses['seconds']:.3f} s,"
        f" {losses['frames']} identification frames known lost;"
        f" {losses['dropped_frames']} frames dropped in flight",
    )
    for loss in ranges[:_SHOWN]:
        yield _row("", loss["text"])
    if len(ranges) > _SHOWN:
        yield _row("", f"... and {len(ranges) - _SHOWN} more: --json lists all")
    if losses["ending"]:
        yield _row("", losses["ending"])


def _calibration(note: Mapping[str, Any]) -> Iterator[str]:
    yield _row("calibration", f"{note['name']} {note['date']}".strip())
    if note["default_columns"]:
        count = len(note["default_columns"])
        yield _row(
            "", f"DEFAULT numbers, not measured on this instrument, in {count} columns (--json)"
        )


def _row(label: str, text: str) -> str:
    return f"{label:<{_WIDTH}}{text}".rstrip()
