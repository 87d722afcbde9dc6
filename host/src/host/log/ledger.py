"""Losses of a log as records: every range with its place, length, seconds, frames and cause."""

from __future__ import annotations

from dataclasses import dataclass, replace

LOST = "the log is"  # begins the note on what a log lost, which is said before all else
# cause -> explanation for people
CAUSES = {
    "crc": "blocks with wrong bits",
    "zeroed": "blocks overwritten with zeros",
    "overwritten": "blocks overwritten with something else",
    "missing": "bytes that are not in the file",
    "card_refused": "blocks the card refused twice in flight",
    "not_written": "blocks never written, older data stands in their place",
    "other_schema": "blocks of a schema that is not in the log",
    "unread": "bytes behind a frame of unknown kind",
    "ring_full": "frames dropped in flight while the card was busy",
    "unexplained": "identification frames missing, no counter says why",
    "radio_lost": "did not arrive from the radio",
    "radio_damaged": "bytes from the radio in no whole envelope",
    "radio_repeated": "frames that arrived twice: used once",
    "truncated": "the file was cut: it stops without the end of its session",
}


@dataclass(frozen=True, slots=True)
class Loss:
    """One lost range.

    Parameters
    ----------
    cause : str
        A key of `CAUSES`.
    offset : int
        Byte position in the file where it begins.
    length : int
        Bytes of the file; 0 for a loss without a place in it.
    blocks : int
        Blocks lost.
    frames : int or None
        Identification frames lost; None without a counter on both sides.
    seconds : float or None
        Time without identification frames beyond the usual interval, s.
    other_frames : int
        Slower frames known to be lost with it.
    t_s : float or None
        Time of the last row before it.
    ranges : int
        Number of ranges of the same cause that this record sums up.
    """

    cause: str
    offset: int
    length: int
    blocks: int = 0
    frames: int | None = None
    seconds: float | None = None
    other_frames: int = 0
    t_s: float | None = None
    ranges: int = 1

    def joined(self, other: Loss) -> Loss:
        """Return one record of this range and a later one of the same cause."""
        return replace(
            self,
            length=self.length + other.length,
            blocks=self.blocks + other.blocks,
            frames=(self.frames or 0) + (other.frames or 0),
            seconds=(self.seconds or 0.0) + (other.seconds or 0.0),
            other_frames=self.other_frames + other.other_frames,
            ranges=self.ranges + other.ranges,
        )

    def sentence(self) -> str:
        """Return the range in words."""
        frames = "?" if self.frames is None else str(self.frames)
        seconds = "?" if self.seconds is None else f"{self.seconds:.3f}"
        at = "" if self.t_s is None else f" after t = {self.t_s:.3f} s"
        more = f"{self.ranges} ranges from " if self.ranges > 1 else ""
        return (
            f"{more}byte {self.offset}, {self.length} bytes: {seconds} s, {frames}"
            f" identification frames{at}; {CAUSES[self.cause]}"
        )


@dataclass(frozen=True, slots=True)
class Ledger:
    """All losses of a log.

    Parameters
    ----------
    losses : tuple of Loss
        In the order of the log.
    complete : str
        ``complete``, ``truncated`` or ``damaged``.
    dropped_frames : int
        Frames of any kind the logger itself counted as dropped.
    unproven_bytes : int or None
        Bytes behind the last block of a file that was never closed; None where the log says itself
        that its session ended.
    received : bool
        The log was received from the radio: its end says nothing of the recorder's log.
    """

    losses: tuple[Loss, ...]
    complete: str
    dropped_frames: int
    unproven_bytes: int | None = None
    received: bool = False

    @property
    def ending(self) -> str | None:
        """The doubt about the log's end, in words; None if the end of its session is in it."""
        if self.received and self.complete != "complete":
            return "received from the radio, some of the frames: the card has all of them"
        if self.unproven_bytes is None:
            return None
        return (
            f"complete as far as blocks reach, {self.unproven_bytes} bytes behind the last block"
            " are not of this flight"
        )

    @property
    def any(self) -> bool:
        """True if anything was lost."""
        return bool(self.losses)

    @property
    def frames(self) -> int:
        """Identification frames known to be lost."""
        return sum(loss.frames or 0 for loss in self.losses)

    @property
    def seconds(self) -> float:
        """Seconds known to be lost."""
        return sum(loss.seconds or 0.0 for loss in self.losses)

    @property
    def lost_bytes(self) -> int:
        """Bytes lost."""
        return sum(loss.length for loss in self.losses)
