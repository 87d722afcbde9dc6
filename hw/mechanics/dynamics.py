"""The vane in the air: frequency, damping and standing error from its geometry; needs no CAD.

python hw/mechanics/dynamics.py       a table by airspeed, and the shipped aircraft's figures

The equation is the twin's (host/twin/sensors/filters.py):

    I angle'' + (q S a r^2 / V) angle' + q S a r angle = M


    frequency / V = sqrt(rho S a r / (2 I)) / (2 pi)
    damping       = r / 2 * sqrt(rho S a r / (2 I)), whatever the airspeed
    error         = M_friction / (q S a r)

with S the fin's area, r from the shaft to its quarter chord, and a its lift slope by Helmbold
(low aspect ratio).
"""

from __future__ import annotations

import csv
import math
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

from sources import hash_of

HERE = Path(__file__).resolve().parent
# What bodies and drawings are made of.
SOURCES = ("vane.toml", "solids.py", "drawing.py")
RHO_KGPM3 = 1.225
REFERENCE_MPS = 17.0
# Numbers of every shipped aircraft file (host/src/host/aircraft/airframes).
SHIPPED = {"frequency_hz_per_mps": 0.8, "damping": 0.35, "friction_rad": 0.0017}


def sources_hash() -> str:
    """Return the hash of the sources of the bodies."""
    return hash_of(HERE / name for name in SOURCES)


@dataclass(frozen=True, slots=True)
class Fin:
    """What the air sees of the vane.

    Attributes
    ----------
    area_m2, arm_m
        Fin, and the distance from shaft to quarter chord.
    aspect_ratio
        span^2 / area.
    inertia_kgm2
        All that turns.
    friction_newton_m
        Dry friction of both bearings.
    """

    area_m2: float
    arm_m: float
    aspect_ratio: float
    inertia_kgm2: float
    friction_newton_m: float

    @property
    def lift_slope(self) -> float:
        """Return dCL/dangle per rad (Helmbold)."""
        ratio = self.aspect_ratio
        return 2.0 * math.pi * ratio / (2.0 + math.sqrt(ratio**2 + 4.0))

    @property
    def stiffness_Nm_per_Pa(self) -> float:
        """Return moment per rad and per Pa of dynamic pressure."""
        return self.area_m2 * self.lift_slope * self.arm_m

    @property
    def frequency_hz_per_mps(self) -> float:
        """Return natural frequency over airspeed."""
        omega = math.sqrt(RHO_KGPM3 * self.stiffness_Nm_per_Pa / (2.0 * self.inertia_kgm2))
        return omega / (2.0 * math.pi)

    @property
    def damping(self) -> float:
        """Return the share of critical damping."""
        return math.pi * self.frequency_hz_per_mps * self.arm_m

    def friction_rad(self, airspeed_mps: float = REFERENCE_MPS) -> float:
        """Return the angle at which dry friction can hold the vane."""
        pressure = 0.5 * RHO_KGPM3 * airspeed_mps**2
        return self.friction_newton_m / (pressure * self.stiffness_Nm_per_Pa)


def load(sizes_text: str, masses_text: str) -> Fin:
    """Read vane.toml and masses.csv, whose first line gives inertia and residual moment."""
    sizes = tomllib.loads(sizes_text)
    fin = sizes["fin"]
    area = fin["chord"] * fin["span"] * 1e-6
    head = dict(part.split("=") for part in masses_text.splitlines()[1].lstrip("# ").split(", "))
    return Fin(
        area_m2=area,
        arm_m=(fin["leading_edge"] + fin["chord"] / 4.0) * 1e-3,
        aspect_ratio=fin["span"] / fin["chord"],
        inertia_kgm2=float(head["inertia_kgm2"]),
        friction_newton_m=sizes["bearing"]["friction_Nm"],
    )


def vane_file(fin: Fin) -> str:
    """Return the vane in the words of an aircraft file's [sensors] table."""
    return (
        "# made by hw/mechanics/make_parts.py from the solids; do not edit\n"
        '# An aircraft file flies it by [sensors] vane = "vane.toml", this file beside it.\n'
        'source = "hw/mechanics: its solids, quasi-steady lift, assumed friction"\n'
        f"vane_frequency_hz_per_mps = {fin.frequency_hz_per_mps:.3f}\n"
        f"vane_damping = {fin.damping:.3f}\n"
        f"vane_friction_rad = {fin.friction_rad():.5f}  # at {REFERENCE_MPS:g} m/s\n"
    )


def masses(masses_text: str) -> list[dict[str, str]]:
    """Read the rows of masses.csv."""
    return list(csv.DictReader(masses_text.splitlines()[2:]))


def main() -> int:
    """Print the table."""
    text = (HERE / "generated" / "masses.csv").read_text(encoding="utf-8")
    fin = load((HERE / "vane.toml").read_text(encoding="utf-8"), text)
    print("airspeed  frequency  lag      standing error")
    for speed in (8.0, 12.0, 17.0, 25.0):
        frequency = fin.frequency_hz_per_mps * speed
        lag_ms = 1e3 * 2.0 * fin.damping / (2.0 * math.pi * frequency)
        error = math.degrees(fin.friction_rad(speed))
        print(f"{speed:4.0f} m/s {frequency:7.1f} Hz {lag_ms:6.1f} ms {error:8.3f} deg")
    print(
        f"damping {fin.damping:.2f}; the shipped aircraft have {SHIPPED['damping']} and"
        f" {SHIPPED['frequency_hz_per_mps']} Hz per m/s, this vane {fin.frequency_hz_per_mps:.2f}"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
