"""Whether the numbers of an aircraft file can belong to one aircraft.

Ratios serve for model aircraft and airliners alike. A ratio that no body can have is an error. One
that no known aircraft has is a warning with both numbers, most often of a wrong unit. Bounds are
from: F-104, X-15, F-16, Concorde, An-225, eta (sailplane of 31 m), Ultra Stick 25e, indoor models;
Roskam, Airplane Design part V, table B.1.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from host.aircraft.aircraft_ranges import UNKNOWN_ANGLE_RAD
from host.aircraft.airframe import Array
from host.constants import GRAVITY_MPS2

SEA_LEVEL_KGPM3 = 1.225


@dataclass(frozen=True, slots=True)
class Ratio:
    """A ratio of numbers in a file.

    Attributes
    ----------
    name : str
        In words, with the numbers it is made of.
    value : float
    usual : (float, float)
        Range of known aircraft; outside it the user is warned.
    possible : (float, float)
        Outside this range the file is refused.
    """

    name: str
    value: float
    usual: tuple[float, float]
    possible: tuple[float, float]


def ratios(s: Mapping[str, float], v: Mapping[str, Array]) -> Iterator[Ratio]:
    """Yield every ratio of an aircraft.

    Parameters
    ----------
    s, v : mapping
        Numbers and arrays by "section.key", each within its own range.
    """
    mass, area = s["mass.mass_kg"], s["geometry.wing_area_m2"]
    span, chord = s["geometry.span_m"], s["geometry.chord_m"]
    sizes = f"wing_area_m2 {area:g}, span_m {span:g}"
    yield Ratio(f"aspect ratio, span2 / area ({sizes})", span**2 / area, (0.5, 55.0), (0.1, 300.0))
    # 0.5 of a biplane, whose area is both wings'; 1.33 of a triangle, 2 of the root of one.
    yield Ratio(
        f"chord over area / span (chord_m {chord:g}, {sizes})",
        chord * span / area, (0.45, 2.1), (0.05, 20.0),
    )  # fmt: skip
    yield Ratio(
        f"mass / area (mass_kg {mass:g}, wing_area_m2 {area:g}), kg/m2",
        mass / area, (0.05, 1000.0), (1e-3, 1e4),
    )  # fmt: skip
    # The same for aircraft of one kind at any size: trainers 8, F-16 80.
    yield Ratio(
        f"mass / area^1.5 (mass_kg {mass:g}, wing_area_m2 {area:g}), kg/m3",
        mass / area**1.5, (0.3, 300.0), (1e-3, 1e4),
    )  # fmt: skip
    # All mass at the tips would have 0.5 of the span. A fuselage may be longer than that.
    for axis, usual in (("ixx", (0.03, 0.3)), ("iyy", (0.03, 1.0)), ("izz", (0.05, 1.0))):
        inertia = s[f"mass.{axis}_kgm2"]
        yield Ratio(
            f"radius of gyration / span ({axis}_kgm2 {inertia:g}, mass_kg {mass:g},"
            f" span_m {span:g})",
            float(np.sqrt(inertia / mass)) / span, usual, (1e-3, 5.0),
        )  # fmt: skip
    speed = s["trim.airspeed_mps"]
    pressure = 0.5 * SEA_LEVEL_KGPM3 * speed**2
    yield Ratio(
        f"lift coefficient at sea level (airspeed_mps {speed:g}, mass_kg {mass:g},"
        f" wing_area_m2 {area:g})",
        mass * GRAVITY_MPS2 / (pressure * area), (0.01, 3.0), (1e-4, 100.0),
    )  # fmt: skip
    for key, most in (("mass.cg_m", 1.0), *((k, 3.0) for k in v if k.startswith("sensors."))):
        far = float(np.linalg.norm(v[key]))
        name = f"distance of {key} / span ({far:g} m, span_m {span:g})"
        yield Ratio(name, far / span, (0.0, most), (0.0, 10.0))


def impossible(s: Mapping[str, float], v: Mapping[str, Array]) -> Iterator[str]:
    """Yield a line for each ratio of sizes and moment of inertia that no body can have."""
    for ratio in ratios(s, v):
        least, most = ratio.possible
        if not least <= ratio.value <= most:
            yield f"{ratio.name} is {ratio.value:.3g}, possible are {least:g} to {most:g}"
    moments, names = _principal(s), "ixx, iyy, izz, ixz (kg m2)"
    given = ", ".join(f"{s[f'mass.{n}_kgm2']:g}" for n in ("ixx", "iyy", "izz", "ixz"))
    if moments[0] <= 0.0:
        yield f"{names} {given}: a principal moment of inertia is {moments[0]:.3g}, not above 0"
    elif _excess(moments) > 1.0 + _inexact(s):
        yield (
            f"{names} {given}: the largest principal moment {moments[2]:.4g} exceeds the sum of"
            f" the others {moments[0] + moments[1]:.4g}, which no body has"
        )
    low, mid, high = (
        s.get(f"trim.{n}airspeed_mps") for n in ("minimum_", "", "maximum_")
    )  # a measured aircraft has the middle one only
    if low is not None and high is not None and mid is not None and not low <= mid <= high:
        yield f"trim: airspeeds {low:g}, {mid:g}, {high:g} m/s are not minimum, trim, maximum"
    standing = s["geometry.ground_pitch_rad"]
    if standing and s["geometry.ground_pitch_tolerance_rad"] >= UNKNOWN_ANGLE_RAD:
        yield (
            f"geometry.ground_pitch_rad is {standing:g} rad without ground_pitch_tolerance_rad:"
            " say how well it was measured"
        )


def doubts(s: Mapping[str, float], v: Mapping[str, Array]) -> Iterator[str]:
    """Yield a line for each ratio of sizes outside the range of known aircraft."""
    for ratio in ratios(s, v):
        least, most = ratio.usual
        if not least <= ratio.value <= most:
            yield (
                f"{ratio.name} is {ratio.value:.3g}, known aircraft have {least:g} to {most:g}:"
                " a wrong unit?"
            )
    if _excess(_principal(s)) > 1.0:
        yield (
            "the largest principal moment of inertia exceeds the sum of the others, within the"
            " tolerance of the file"
        )


def _principal(s: Mapping[str, float]) -> Array:
    x, y, z, xz = (s[f"mass.{n}_kgm2"] for n in ("ixx", "iyy", "izz", "ixz"))
    return np.linalg.eigvalsh(np.array([[x, 0.0, -xz], [0.0, y, 0.0], [-xz, 0.0, z]]))


def _excess(moments: Array) -> float:
    return float(moments[2] / (moments[0] + moments[1]))


def _inexact(s: Mapping[str, float]) -> float:
    """Return the allowance of the triangle inequality of inertia: the tolerances of the moments."""
    return 2.0 * max(s["mass.inertia_tolerance"], 0.005)
