"""What a log lost, as records: every range with its place, length, seconds, frames and cause."""

from __future__ import annotations

from dataclasses import dataclass

# cause -> what it means to a reader
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
    "truncated": "the file stops without the end of its session",
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
        Bytes; 0 where no byte of the file stands for it.
    blocks : int
        Blocks lost.
    frames : int or None
        Identification frames lost; None where no counter on both sides tells.
    seconds : float or None
        Time without identification frames beyond the usual interval, s.
    other_frames : int
        Slower frames known to be lost with it.
    t_s : float or None
        Time of the last row before it.
    """

    cause: str
    offset: int
    length: int
    blocks: int = 0
    frames: int | None = None
    seconds: float | None = None
    other_frames: int = 0
    t_s: float | None = None

    def sentence(self) -> str:
        """Return the range in words."""
        frames = "?" if self.frames is None else str(self.frames)
        seconds = "?" if self.seconds is None else f"{self.seconds:.3f}"
        at = "" if self.t_s is None else f" after t = {self.t_s:.3f} s"
        return (
            f"byte {self.offset}, {self.length} bytes: {seconds} s, {frames} identification frames"
            f"{at}; {CAUSES[self.cause]}"
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
    """

    losses: tuple[Loss, ...]
    complete: str
    dropped_frames: int

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
