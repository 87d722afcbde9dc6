"""What the data-compatibility check finds: sensors that disagree by more than their file allows."""

from __future__ import annotations

from host.sysid.checks.data_finding import Finding
from host.sysid.reconstruction.calibration_consistency import calibration_lines
from host.sysid.reconstruction.reconstruction import Compatibility


def calibration_findings(agreement: Compatibility) -> list[Finding]:
    """Return the finding that sensor errors are larger than their file says; none if they fit.

    It leaves no column in doubt: `widened_to_flight` puts them into the intervals.
    """
    causes = ("a calibration that is another instrument's", "wind that changes", "a wrong unit")
    done = "intervals count errors as large as that"
    lines = calibration_lines(agreement.calibration_tests)
    return [Finding("calibration", (), line, causes, done) for line in lines]
