"""What contradicts physics in the columns of a flight is a finding with a consequence.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.checks.agreement_findings import calibration_findings
    from host.sysid.checks.data_finding import (
        CHECKS,
        Feedback,
        Finding,
        accepted_checks,
        check_lines,
        finding_document,
        open_channels,
    )
    from host.sysid.checks.finding_consequences import blamed, checked
    from host.sysid.checks.kinematic_checks import consistent
    from host.sysid.checks.unit_sign_checks import check

__all__ = [
    "CHECKS",
    "Feedback",
    "Finding",
    "accepted_checks",
    "blamed",
    "calibration_findings",
    "check",
    "check_lines",
    "checked",
    "consistent",
    "finding_document",
    "open_channels",
]

__getattr__ = lazily(
    __name__,
    {
        "CHECKS": "data_finding",
        "Feedback": "data_finding",
        "Finding": "data_finding",
        "accepted_checks": "data_finding",
        "blamed": "finding_consequences",
        "calibration_findings": "agreement_findings",
        "check": "unit_sign_checks",
        "check_lines": "data_finding",
        "checked": "finding_consequences",
        "consistent": "kinematic_checks",
        "finding_document": "data_finding",
        "open_channels": "data_finding",
    },
)
