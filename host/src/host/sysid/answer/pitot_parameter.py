"""What the reconstruction says of an autopilot's pitot, as the parameter to set."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from pathlib import Path

from host.physical.recording import AUTOPILOT
from host.sysid.flight.reconstructed_flight import ReconstructedFlight
from host.sysid.reconstruction.reconstruction import Compatibility
from host.sysid.reconstruction.sensor_corrections import pressure_scale

RATIO = "ArduPilot's ARSPD_RATIO"  # on dynamic pressure: by the square of the airspeed
SCALE = "PX4's ASPD_SCALE_n"  # on airspeed


def pitot_lines(
    flights: Sequence[ReconstructedFlight], agreements: Sequence[Compatibility | None]
) -> list[str]:
    """Return a line for each autopilot's flight whose pitot errs beyond its interval.

    With k = true over indicated airspeed the new ratio is the old one times k squared, and the new
    scale the old one times k.

    Parameters
    ----------
    flights : sequence of ReconstructedFlight
    agreements : sequence of Compatibility or None
        Agreement of each flight.
    """
    lines = []
    for flight, found in zip(flights, agreements, strict=True):
        if flight.maker != AUTOPILOT or found is None:
            continue
        high = pressure_scale(found)
        if high is None or abs(high[0]) <= high[1]:
            continue
        share, half = high
        squared, squared_half = 1.0 / (1.0 + share), half / (1.0 + share) ** 2
        k, k_half = sqrt(squared), 0.5 * squared_half / sqrt(squared)
        ratio = f"{RATIO} its value times {squared:.3f} +- {squared_half:.2g}"
        scale = f"{SCALE} its value times {k:.3f} +- {k_half:.2g}"
        kind = Path(flight.source.partition("#")[0]).suffix.lower()
        which = {".ulg": scale, ".bin": ratio, ".log": ratio}.get(kind, f"{ratio}, or {scale}")
        of = f"{flight.source}: " if len(flights) > 1 else ""
        lines.append(
            f"{of}pitot: true over indicated airspeed is {k:.3f} +- {k_half:.2g}; set {which}"
        )
    return lines
