"""What the data-compatibility check finds: sensors that disagree by more than their file allows."""

from __future__ import annotations

from host.sysid.checks.data_finding import Finding
from host.sysid.reconstruction.calibration_consistency import (
    ALL,
    calibration_lines,
    inconsistent_groups,
)
from host.sysid.reconstruction.reconstruction import Compatibility

RATES = ("p_radps", "q_radps", "r_radps")
FORCES = ("ax_mps2", "ay_mps2", "az_mps2")
# The columns that a group of errors of an instrument's file moves.
MOVED = {
    "gyro": RATES,
    "accel": FORCES,
    "misalignment": FORCES,
    "vane": ("alpha_rad", "beta_rad"),
    "pitot": ("airspeed_mps",),
    "place": ("alpha_rad", "beta_rad", *FORCES),
}


def calibration_findings(agreement: Compatibility) -> list[Finding]:
    """Return the finding that sensor errors are larger than their file says; none if they fit."""
    tests = agreement.calibration_tests
    lines = calibration_lines(tests)
    if not lines:
        return []
    named = [test.name for test in inconsistent_groups(tests)]
    groups = MOVED if ALL in named else [name.split("_")[0] for name in named]
    channels = [k for group in groups for k in MOVED[group]]
    causes = ("a calibration that is another instrument's", "wind that changes", "a wrong unit")
    done = "intervals rest on the file all the same"
    return [Finding("calibration", tuple(dict.fromkeys(channels)), lines[0], causes, done)]
