"""Test the airspeed's scale against its file by forces and turning wind angles.

A force along an axis turns the wind angle by itself over the airspeed: an airspeed that reads 10 %
high makes the force count 10 % too little. `driven_motion` tells the factor by what surfaces drive:
to 1 % in calm air, to 5 and 9 % in gusts of 0.5 and 1 m/s. It is asked without GPS only: with it
flight-path reconstruction tells the scale, without nothing else does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.instrument.deviations import SensorErrorModel, airspeed_share
from host.readers.named_channels import STANDARD_DENSITY_KGPM3
from host.sysid.checks.data_finding import Finding
from host.sysid.checks.driven_motion import (
    SENSOR_DELAY_S,
    DrivenTest,
    SensorTolerances,
    testable,
)
from host.sysid.checks.identity_factors import Identity
from host.sysid.checks.kinematic_checks import OVER_AIRSPEED
from host.sysid.checks.kinematic_identities import identities
from host.sysid.checks.unit_sign_checks import airborne

CHECK = "airspeed-scale"
# Of vane and IMU, and what their models leave of the motion: with none of it the twin's right
# sensors of a survey were 5 % off, by three deviations.
DELAY_S, UNKNOWN_SHARE = 0.01, 0.03
# Of deviations squared: an airspeed 10 % off comes to 60 to 110 in calm air. Right sensors pass it
# at times in gusts of 0.3 m/s (seeds 9 and 31303 of the card `demo`): errors that the tolerances do
# not know.
CERTAIN = 16.0
VANE_MODEL_SHARE = 0.006  # dry friction known to 20 % of its 3 %
TRIED = np.linspace(0.6, 1.6, 101)


@dataclass(frozen=True, slots=True)
class AirspeedScale:
    """Ratio of the airspeed read to the true one, and how unlikely that makes what the file claims.

    Attributes
    ----------
    factor : float
        The likeliest.
    claimed : float
        One deviation of it from one, by the file.
    excess : float
        Deviations squared by which the likeliest within the file's tolerance is worse.
    """

    factor: float
    claimed: float
    excess: float


def airspeed_scale_findings(
    columns: Mapping[str, Array], instrument: SensorErrorModel
) -> list[Finding]:
    """Return the finding of an airspeed that is further off than its file claims; none within.

    Parameters
    ----------
    columns : mapping
        SI columns on an even grid, corrected for places and delays.
    instrument : SensorErrorModel
        What the file claims.
    """
    if "airspeed_mps" not in columns:
        return []
    found = airspeed_scale(columns, instrument)
    if found is None or found.excess < CERTAIN:
        return []
    off = found.factor - 1.0
    return [
        Finding(
            CHECK,
            tuple(k for k in ("airspeed_mps", "qbar_pa") if k in columns),
            f"airspeed_mps reads about {100.0 * abs(off):.0f} % {'high' if off > 0.0 else 'low'},"
            " by how forces turn the wind angles where surfaces drive them; its file allows"
            f" {100.0 * found.claimed:.1f} % (one deviation)",
            ("a pitot that is not the calibrated one", "scales of vanes or accelerometers"),
        )
    ]


def airspeed_scale(
    columns: Mapping[str, Array], instrument: SensorErrorModel
) -> AirspeedScale | None:
    """Return the scale of the airspeed, of sensors that a file describes; None if nothing tells it.

    Parameters
    ----------
    columns, instrument
        As `airspeed_scale_findings`.
    """
    flown, dt_s = airborne(columns)
    tests = [
        (DrivenTest(law), part, _tolerances(law, part, instrument))
        for law in identities(flown, dt_s)
        for part in law.parts
        if part.endswith(OVER_AIRSPEED) and law.driven and testable(law)
    ]
    if not tests:
        return None
    own = np.sum([t.deviances(part, TRIED, within) for t, part, within in tests], axis=0)
    claimed = _claimed(flown, instrument)
    (factor, least), (_, within) = _least(own), _least(own + ((TRIED - 1.0) / claimed) ** 2)
    return AirspeedScale(factor, claimed, max(within - least, 0.0))


def _claimed(flown: Mapping[str, Array], instrument: SensorErrorModel) -> float:
    """Return one deviation of the airspeed's scale by the file, in flight."""
    density = flown.get("density_kgpm3", np.array([STANDARD_DENSITY_KGPM3]))
    qbar_pa = 0.5 * float(np.median(density)) * float(np.median(flown["airspeed_mps"])) ** 2
    return airspeed_share(instrument.errors, qbar_pa)


def _tolerances(law: Identity, slow: str, instrument: SensorErrorModel) -> SensorTolerances:
    """Return what the file claims of all else in an identity."""
    errors = instrument.errors
    pitching = law.name == "alpha_rad"
    vanes = ("alpha_a", "alpha_b") if pitching else ("beta_a", "beta_b")
    rates = {part: errors["gyro_scale"].sigma("y") for part in law.parts if part != slow}
    force = errors["accel_scale"].sigma("z" if pitching else "y")
    vane = float(np.hypot(errors["vane_scale"].of_mean(*vanes), VANE_MODEL_SHARE))
    shares = {**rates, slow: force, "": vane}
    return SensorTolerances(shares, DELAY_S / SENSOR_DELAY_S, UNKNOWN_SHARE)


def _least(values: Sequence[float] | Array) -> tuple[float, float]:
    """Return the factor at which values are least, by a parabola, and how small they are there."""
    k = int(np.clip(np.argmin(values), 1, len(values) - 2))
    before, least, after = (float(values[n]) for n in (k - 1, k, k + 1))
    curvature = before - 2.0 * least + after
    if not curvature > 0.0 or least > min(before, after):
        k = int(np.argmin(values))
        return float(TRIED[k]), float(values[k])
    steps = 0.5 * (before - after) / curvature
    return float(TRIED[k] + steps * (TRIED[1] - TRIED[0])), least - 0.5 * curvature * steps**2
