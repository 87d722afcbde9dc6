"""What contradicts physics in the columns of a flight is a finding with a consequence.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.checks.data_finding import (
        CHECKS,
        Feedback,
        Finding,
        accepted_checks,
        check_lines,
        finding_document,
        open_channels,
    )

__all__ = [
    "CHECKS",
    "Feedback",
    "Finding",
    "accepted_checks",
    "check_lines",
    "finding_document",
    "open_channels",
]

__getattr__ = lazily(__name__, dict.fromkeys(__all__, "data_finding"))
