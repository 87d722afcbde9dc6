"""The error that ends a run of a fleet, in one line."""

from __future__ import annotations

from host.errors import UsageError


class FleetError(UsageError):
    """A fleet that cannot be run: what was found, what was expected, what to do."""
