"""What can go wrong in a way a user can act on: one class, one clear line."""

from __future__ import annotations

from host.errors import UsageError


class IdentificationError(UsageError):
    """Say what was found, what was expected and what to do, in one line."""
