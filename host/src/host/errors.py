"""What can go wrong for a user, and the exit code each case ends in."""

from __future__ import annotations

from enum import IntEnum


class ExitCode(IntEnum):
    """Exit codes of every verb; documented in host/README.md and in --help."""

    OK = 0
    INTERNAL = 1
    USAGE = 2
    LOSSES = 3
    NOT_A_LOG = 4
    DEVICE = 5
    CHECK = 6
    INTERRUPTED = 130  # what a shell expects after Ctrl-C


class HostError(Exception):
    """An error a user can act on: one line that says what was found, expected and what to do."""

    exit_code = ExitCode.INTERNAL


class UsageError(HostError):
    """Wrong argument, missing file, missing extra."""

    exit_code = ExitCode.USAGE


class IdentificationError(UsageError):
    """Data, a model or an aircraft that nothing can be identified from."""


class CalibrationError(UsageError):
    """A calibration file that cannot be read or does not fit."""


class LogError(HostError):
    """A log that cannot be decoded as asked (unknown session, unknown schema)."""

    exit_code = ExitCode.USAGE


class NotALogError(LogError):
    """A file without one intact block, or a folder without a flight."""

    exit_code = ExitCode.NOT_A_LOG


class CheckError(HostError):
    """A check asked for (--strict) did not pass."""

    exit_code = ExitCode.CHECK
