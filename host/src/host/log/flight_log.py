"""A flight log: raw frames, the synchronous table in SI, the ledger of losses."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from host.errors import LogError
from host.log.ledger import Ledger
from host.log.losses import make_ledger
from host.log.stream_losses import make_stream_ledger
from host.physical.calibration import Calibration
from host.physical.columns import CHANNELS, COLUMNS
from host.physical.session import Session, surface_sources
from host.physical.table import Columns, SessionTable
from host.physical.timebase import ClockFit, block_times_us, fit_gps, gps_times_ms, session_slices
from host.plugins import plugged_in
from host.text import shown
from host.wire.blocks import Progress, Scan
from host.wire.schema import Schema
from host.wire.selection import Selection
from host.wire.store import Frames, FrameStore
from host.wire.stream import Stream, StreamStore

if TYPE_CHECKING:
    import pandas as pd

    from host.export.pictures import Pictures

# A reset costs at least the schema, 14 blocks, and a second of flight as many; some may be damaged.
_SESSIONS, _SESSION_BLOCKS = 48, 28
_SHOWN_SESSIONS = 12
DRAWERS = "host.log_pictures"  # entry points: what draws stands above what reads
GAP_BETWEEN_SESSIONS_S = 2.0  # by convention, where no GPS says how long a reset took


class FlightLog:
    """One log of a file.

    Parameters
    ----------
    path : Path
    scan : Scan
    selection : Selection
    schema : Schema
    calibration : Calibration
    session : int, optional
        Keep this session only.
    progress : callable, optional
        Called with work done and work in all.
    stream : Stream, optional
        Where the blocks are frames of a telemetry stream, received on the ground.
    """

    def __init__(
        self,
        path: Path,
        scan: Scan,
        selection: Selection,
        schema: Schema,
        calibration: Calibration,
        *,
        session: int | None = None,
        progress: Progress | None = None,
        stream: Stream | None = None,
    ) -> None:
        self.path = path
        self.stream = stream
        self.scan = scan
        self.selection = selection
        self.schema = schema
        self.calibration = calibration
        if session is not None and session not in selection.sessions:
            known = ", ".join(str(number) for number in selection.sessions[:_SHOWN_SESSIONS])
            known += ", ..." if len(selection.sessions) > _SHOWN_SESSIONS else ""
            raise LogError(f"{path}: no session {session}; this log holds {known}")
        self._only = session
        blocks = selection.blocks
        if session is not None:
            blocks = blocks.take(blocks.session == session)
        runs, most = len(session_slices(blocks)), _SESSIONS + len(blocks) // _SESSION_BLOCKS
        if runs > most:
            raise LogError(
                f"{path}: the session changes {runs} times in {len(blocks)} blocks; expected at"
                f" most {most}: a session holds its schema and a second; --session N reads one"
            )
        self.blocks = blocks
        self.store = (
            FrameStore(path, blocks, schema, progress)
            if stream is None
            else StreamStore(path, stream, blocks, schema, progress)
        )

    @cached_property
    def frames(self) -> Frames:
        """Raw frames by name: structured arrays with the fields of protocol/frames.toml."""
        return Frames(self.store)

    @cached_property
    def inputs(self) -> dict[str, str]:
        """For each surface, whether its column is ``measured`` or ``commanded``."""
        return surface_sources(self.store)

    @cached_property
    def sessions(self) -> list[Session]:
        """The recording sessions in order, placed in time."""
        clock = self.clock
        scale = 1.0 + clock.scale_error if clock is not None and clock.applied else 1.0
        previous: Session | None = None
        for session in self._unplaced:
            session.clock_scale = scale
            if previous is not None:
                gap_s = _gps_gap_s(previous, session) or GAP_BETWEEN_SESSIONS_S
                session.offset_s = previous.offset_s + previous.duration_s + gap_s
            if session.rows:
                previous = session
        return self._unplaced

    @cached_property
    def clock(self) -> ClockFit | None:
        """The Mega's clock against GPS, None without enough GPS solutions."""
        return fit_gps([_gps_pairs(session) for session in self._unplaced])

    @property
    def clock_half_width(self) -> float | None:
        """95 % half-width of the clock's scale after the fit to GPS; None without a correction."""
        clock = self.clock
        return clock.half_width if clock is not None and clock.applied else None

    @cached_property
    def _unplaced(self) -> list[Session]:
        block_us = block_times_us(self.blocks, self.store["system"])
        return [
            Session(
                number=int(self.blocks.session[first]),
                span=(first, last),
                store=self.store,
                block_us=block_us,
                calibration=self.calibration,
                inputs=self.inputs,
            )
            for first, last in session_slices(self.blocks)
        ]

    @cached_property
    def loss(self) -> Ledger:
        """Every lost range with its place, length, seconds, frames and cause."""
        if self.stream is not None:
            return make_stream_ledger(self.stream, self.store, self.sessions)
        return make_ledger(self.scan, self.selection, self.store, self.sessions, only=self._only)

    @property
    def complete(self) -> str:
        """``complete``, ``truncated`` or ``damaged`` (protocol/README.md, "End")."""
        return self.loss.complete

    def __repr__(self) -> str:
        """Return in a line what the log is."""
        rows = sum(session.rows for session in self.sessions)
        seconds = sum(session.duration_s for session in self.sessions)
        lost = sum(loss.ranges for loss in self.loss.losses)
        losses = f"{lost} lost range{'s' * (lost > 1)}" if lost else "nothing lost"
        return (
            f"<FlightLog {shown(self.path.name)}: {seconds:.1f} s, {rows} rows, {self.complete},"
            f" {losses}, calibration {shown(self.calibration.name)}>"
        )

    def _repr_html_(self) -> str:
        return f"<p>{escape(repr(self)[1:-1])}</p>"

    def plot(
        self, *channels: str, from_s: float | None = None, to_s: float | None = None
    ) -> Pictures:
        """Return strips of the flight, test points shaded: the picture of `host plot --png`.

        Parameters
        ----------
        *channels : str
            A strip each, such as ``"alpha_deg"`` or ``"p_degps+q_degps"``; the usual ones without.
        from_s, to_s : float, optional
            Part of the flight, in ``t_s``.

        Raises
        ------
        UsageError
            If a channel is unknown, or the span is empty.
        LogError
            If nothing that draws is installed.
        """
        drawers = plugged_in(DRAWERS)
        if "strips" not in drawers:
            raise LogError("nothing that draws a log is installed; install the package again")
        drawn: Pictures = drawers["strips"].load(LogError)(self, channels, (from_s, to_s))
        return drawn

    def table(self, *, aligned: bool = True) -> pd.DataFrame:
        """Return the synchronous table in SI at the identification rate.

        Parameters
        ----------
        aligned : bool
            True brings every channel to the instant ``t_s`` of its row: linearly between the two
            samples around it, with the delays of the schema removed. A value is NaN where one of
            the two is invalid or a sample between them is missing. False leaves each value as it
            was sampled, ``host.physical.channels.constant_delay_us`` plus its age before ``t_s``.

        Returns
        -------
        pandas.DataFrame
            One row per identification frame, columns of `host.physical.columns.COLUMNS`; units,
            sources of the inputs, calibration and what GPS leaves open of the clock in ``attrs``.
        """
        import pandas as pd

        table = pd.DataFrame(self.columns(aligned=aligned), copy=False)
        table.attrs["units"] = {column.name: column.unit for column in COLUMNS}
        table.attrs["inputs"] = dict(self.inputs)
        table.attrs["calibration"] = self.calibration.name
        table.attrs["clock_half_width"] = self.clock_half_width
        return table

    def columns(self, *, aligned: bool = True) -> Columns:
        """Return the columns of `table` as arrays, without pandas."""
        return self._collected(self.pieces(aligned=aligned)) or {
            column.name: np.empty(0) for column in COLUMNS
        }

    def channels(self) -> Columns:
        """Return the calibrated channels of the identification frames, nothing derived from them.

        Returns
        -------
        dict of str to NDArray[np.float64], shape (rows,)
            ``t_s`` and every measured column in SI, each value where it was sampled (see `table`),
            NaN where it is not valid.
        """
        # One allocation: numpy asks for huge pages, single columns cost twice the time.
        count = sum(session.rows for session in self.sessions)
        out = dict(zip(CHANNELS, np.empty((len(CHANNELS), count)), strict=True))
        at = 0
        for session in self.sessions:
            if session.rows:
                part = {name: value[at : at + session.rows] for name, value in out.items()}
                SessionTable(session, aligned=False).channels(part)
                at += session.rows
        return dict(out)

    def _collected(self, pieces: Iterator[Columns]) -> Columns:
        count = sum(session.rows for session in self.sessions)
        floats: Iterator[Any] | None = None
        out: Columns = {}
        at = 0
        for piece in pieces:
            if floats is None:
                floats = iter(np.empty((len(piece), count)))
            rows = len(piece["t_s"])
            for name, value in piece.items():
                if name not in out:
                    plain = value.dtype == np.float64
                    out[name] = next(floats) if plain else np.empty(count, value.dtype)
                out[name][at : at + rows] = value
            at += rows
        return out

    def pieces(self, *, aligned: bool = True) -> Iterator[Columns]:
        """Yield the columns some ten thousand rows at a time: for logs larger than memory."""
        for session in self.sessions:
            if session.rows:
                yield from SessionTable(session, aligned=aligned).pieces()

    def head(self, name: str) -> Any | None:
        """Return the last frame of a kind, or None without one."""
        if name not in self.schema.by_name:
            return None
        data = self.frames[name]
        return data[-1] if len(data) else None


def _gps_pairs(session: Session) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    data, t_us = session.slow("gps")
    if not len(data):
        return np.empty(0, np.int64), np.empty(0, np.int64)
    schema = session.store.schema
    fixes = (schema.number("gps_fix", "fix_2d"), schema.number("gps_fix", "fix_3d"))
    gps_ms = gps_times_ms(data, fixes)
    good = gps_ms >= 0
    return t_us[good].astype(np.int64), gps_ms[good]


def _gps_gap_s(previous: Session, later: Session) -> float | None:
    """Return the time from the last row of a session to the first of the next, if GPS knows it."""
    t_before, gps_before = _gps_pairs(previous)
    t_after, gps_after = _gps_pairs(later)
    if not len(t_before) or not len(t_after):
        return None
    scale = previous.clock_scale * 1e-6
    tail_s = (previous.end_us - previous.start_us - t_before[-1]) * scale
    head_s = t_after[0] * scale
    gap_s = float(gps_after[0] - gps_before[-1]) * 1e-3 - tail_s - head_s
    return gap_s if gap_s > 0.0 else None
