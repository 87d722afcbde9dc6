"""Strips of a flight as a picture for a paper: PNG or SVG, the same bytes for the same flight."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from host.arrays import Array
from host.errors import UsageError
from host.export.atomic_files import atomic_write
from host.export.pictures import Pictures
from host.extras import install_hint
from host.log import FlightLog
from host.near_names import like
from host.report.channel_list import Channel, channels_of
from host.report.flight_reading import shown_log
from host.report.overview import buckets, min_max
from host.report.shown_flight import ShownFlight, quality
from host.report.strip_list import strips_of

_WIDTH_IN, _STRIP_IN = 7.0, 1.15  # a page of a journal is 7 inches wide
_MOST_POINTS = 8000  # more than a printer draws
_OVERVIEW_POINTS = 1600  # in a write-up, whose pages are mailed
_TINT = {"good": "#16a34a", "fair": "#d97706", "poor": "#dc2626"}
_COLOURS = ("#0b5cad", "#c2410c", "#15803d", "#7e22ce")


def write_figure(
    flight: ShownFlight,
    target: Path,
    names: tuple[str, ...] = (),
    span: tuple[float | None, float | None] = (None, None),
) -> None:
    """Write strips of a flight.

    Parameters
    ----------
    flight : ShownFlight
    target : Path
        Its ending says the format: ``.png`` or ``.svg``.
    names : tuple of str
        A strip each, channels of one strip joined by ``+``; the usual strips without it.
    span : (float or None, float or None)
        From and to, s.

    Raises
    ------
    UsageError
        If a channel is unknown, the span is empty or the place cannot be written to.
    """
    ending = target.suffix.lower().removeprefix(".")
    if ending not in ("png", "svg"):
        raise UsageError(f"{target}: a picture's name ends in .png or .svg")
    mpl = _matplotlib()
    with mpl.rc_context({"svg.hashsalt": "host", "font.size": 8}):
        figure = _figure(flight, names, span)
        metadata = {"Date": None} if ending == "svg" else {"Software": None}
        with atomic_write(target) as part:
            figure.savefig(part, format=ending, dpi=200, metadata=metadata)


def log_strips(
    log: FlightLog, names: tuple[str, ...], span: tuple[float | None, float | None]
) -> Pictures:
    """Return strips of a log in memory for a notebook: what `FlightLog.plot` returns.

    Raises
    ------
    UsageError, NotALogError
        As `write_figure`; the log has no identification frame.
    """
    flight = shown_log(log)
    with _matplotlib().rc_context({"svg.hashsalt": "host", "font.size": 8}):
        return Pictures({flight.name: _figure(flight, names, span)})


def _figure(
    flight: ShownFlight, names: tuple[str, ...], span: tuple[float | None, float | None]
) -> Any:
    known = {one.name: one for one in channels_of(flight)}
    strips = [[known[c] for c in strip] for strip in _wanted(known, names)]
    first = flight.t_s[0] if span[0] is None else span[0]
    last = flight.t_s[-1] if span[1] is None else span[1]
    inside = (flight.t_s >= first) & (flight.t_s <= last)
    if inside.sum() < 2:
        raise UsageError(
            f"--from {first:g} --to {last:g}: no samples there; the flight runs from"
            f" {flight.t_s[0]:.2f} to {flight.t_s[-1]:.2f} s"
        )
    return _strip_axes(flight, strips, inside)


def overview_figure(flight: ShownFlight) -> Any:
    """Return the first strips of a flight as a figure with few points, for the report."""
    known = {one.name: one for one in channels_of(flight)}
    strips = [[known[c] for c in one.channels] for one in strips_of(known) if one.on]
    mpl = _matplotlib()
    with mpl.rc_context({"svg.hashsalt": "host", "font.size": 8}):
        return _strip_axes(flight, strips, flight.t_s >= flight.t_s[0], _OVERVIEW_POINTS)


def _wanted(known: dict[str, Channel], names: tuple[str, ...]) -> list[list[str]]:
    if not names:
        return [list(one.channels) for one in strips_of(known) if one.on]
    strips = [strip.split("+") for strip in names]
    for name in (one for strip in strips for one in strip):
        if name not in known:
            raise UsageError(
                f"channel {name}: not measured here{like(name, known)}; there are"
                f" {', '.join(known)}"
            )
    return strips


def _matplotlib() -> Any:
    try:
        import matplotlib as mpl
    except ImportError:
        hint = install_hint("matplotlib")
        raise UsageError(f"pictures need matplotlib: {hint}") from None
    return mpl


def _strip_axes(
    flight: ShownFlight, strips: list[list[Channel]], inside: Any, points: int = _MOST_POINTS
) -> Any:
    from matplotlib.figure import Figure

    t_s = flight.t_s[inside]
    figure = Figure((_WIDTH_IN, 0.5 + _STRIP_IN * len(strips)), layout="constrained")
    axes = figure.subplots(len(strips), 1, sharex=True, squeeze=False)[:, 0]
    for axis, strip in zip(axes, strips, strict=True):
        for colour, channel in zip(_COLOURS, strip, strict=False):
            shown_s, values = _min_max_decimated(t_s, channel.values[inside], points)
            axis.plot(shown_s, values, color=colour, linewidth=0.7, label=channel.name)
        _shaded(axis, flight, (t_s[0], t_s[-1]))
        axis.set_ylabel(strip[0].unit or strip[0].name)
        axis.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), fontsize=6, ncols=len(strip),
                    frameon=False, borderaxespad=0.0)  # fmt: skip
        axis.grid(color="#e5e7eb", linewidth=0.5)
    axes[-1].set_xlabel("t, s")
    axes[-1].set_xlim(t_s[0], t_s[-1])
    return figure


def _min_max_decimated(t_s: Array, values: Array, points: int) -> tuple[Array, Array]:
    if len(t_s) <= points:
        return t_s, values
    own = buckets(t_s, points // 2)
    return own.t_s, min_max(values, own)


def _shaded(axis: Any, flight: ShownFlight, span: tuple[float, float]) -> None:
    for item, mark in flight.maneuvers:
        first, last = max(item.start_s, span[0]), min(item.end_s, span[1])
        if last > first:
            axis.axvspan(first, last, color=_TINT[quality(mark.score)], alpha=0.14, linewidth=0)
    for loss in flight.losses:
        if span[0] <= loss.t_s <= span[1]:
            axis.axvspan(loss.t_s, max(loss.end_s, loss.t_s + 1e-3), color="#dc2626", alpha=0.5)
