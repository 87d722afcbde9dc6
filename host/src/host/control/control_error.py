"""What tuning refuses."""

from __future__ import annotations

from host.errors import UsageError


class ControlError(UsageError):
    """Gains that cannot be had: what was found, what was expected, what to do."""
