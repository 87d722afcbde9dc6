"""Impact pressure of a row, from the airspeed that the stream shows."""

from __future__ import annotations

from host.physical.airdata import HEAT_RATIO, STANDARD_PRESSURE_PA, STANDARD_SOUND_MPS
from host.preflight.sample import Sample

# Sea level: 0.1 % off at 20 m/s where the compressible formula is exact.
_DENSITY = HEAT_RATIO * STANDARD_PRESSURE_PA / STANDARD_SOUND_MPS**2


def impact_pa(sample: Sample, side: str) -> float:
    """Return the signed impact pressure of a pitot, Pa; NaN where it has no valid value.

    Parameters
    ----------
    sample : Sample
    side : str
        ``a`` left, ``b`` right.
    """
    speed = sample[f"airspeed_{side}_mps"]
    return 0.5 * _DENSITY * speed * abs(speed)
