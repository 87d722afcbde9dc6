"""Which terms of a model a flight can determine: axes flown, surfaces that moved, thrust known.

What is missing of an axis that was not flown counts as zero; what is missing of the air follows
from what is there. Every such step is a remark of the answer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from host.aircraft.powerplant import Powerplant
from host.arrays import Array
from host.constants import GRAVITY_MPS2
from host.errors import IdentificationError
from host.sysid.aerodynamics.measured_thrust import thrust_column
from host.sysid.coefficients.window_spectra import Window
from host.sysid.models.coefficient_model import DRAG, CoefficientModel

SIDE = ("CY", "Cl", "Cn")
STANDARD_DENSITY, DENSITY_SHARE = 1.225, 0.05  # kg/m3; to 1000 m, 0 to 30 deg C: -6 +- 4 %
# Columns that an axis which was not flown does without.
SIDE_COLUMNS = (
    "beta_rad", "p_radps", "r_radps", "ay_mps2", "phi_rad", "aileron_rad", "rudder_rad",
)  # fmt: skip
PITCH_COLUMNS = ("q_radps", "elevator_rad")
LEVEL_COLUMNS = ("alpha_rad", "theta_rad", "ax_mps2", "az_mps2")  # of level flight without them
LEVEL_SD_RAD = 0.05  # of an angle of attack that nobody measured
CONTROLS = {"da": "aileron_rad", "dr": "rudder_rad"}
STILL_RAD = 1e-9


@dataclass(frozen=True, slots=True)
class FlightTerms:
    """The model that a flight determines, its windows and columns, and remarks on all of them.

    `assumed` are standard deviations of what rests on an assumption, by the name of its error.
    """

    model: CoefficientModel
    windows: tuple[Window, ...]
    columns: dict[str, Array]
    remarks: tuple[str, ...]
    assumed: dict[str, float]


def flight_terms(
    model: CoefficientModel,
    columns: Mapping[str, Array],
    windows: Sequence[Window],
    powerplant: Powerplant,
) -> FlightTerms:
    """Return the part of a model that a flight determines.

    Parameters
    ----------
    model : CoefficientModel
    columns : mapping of (n,) Array
        SI, as decoded, from after the launch to the end of the flight.
    windows : sequence of Window
        Maneuvers to be fitted.
    powerplant : Powerplant
        Powerplant of the aircraft file.

    Raises
    ------
    IdentificationError
        If no maneuver is there, or none of the model's equations is left.
    """
    # Maneuvers of an axis that the model has no equations of say nothing of it.
    has = {name not in SIDE for name in model.equations}
    windows = tuple(w for w in windows if w.longitudinal in has)
    if not windows:
        raise IdentificationError(
            "coefficients need a maneuver of the elevator, or one of aileron and rudder, for which"
            " the model has an equation"
        )
    flown = _FlownTerms(dict(columns), windows)
    flown.leave_axes_out(model)
    flown.fill_air()
    flown.leave_still_controls_out()
    flown.take_thrust(model, powerplant)
    equations = {
        name: tuple(t for t in terms if not {f[0] for f in t.factors} & set(flown.still))
        for name, terms in model.equations.items()
        if name not in flown.lost
    }
    if not equations:
        raise IdentificationError(f"coefficients: {'; '.join(flown.remarks)}; no equation is left")
    return FlightTerms(
        replace(model, equations=equations),
        windows,
        flown.columns,
        tuple(flown.remarks),
        flown.assumed,
    )


@dataclass(slots=True)
class _FlownTerms:
    """Columns and terms that a flight determines; each step adds its remark.

    `lost` are equations, `still` the labels of surfaces that it says nothing of; `level` are the
    columns taken as in level flight.
    """

    columns: dict[str, Array]
    windows: tuple[Window, ...]
    remarks: list[str] = field(default_factory=list)
    assumed: dict[str, float] = field(default_factory=dict)
    lost: list[str] = field(default_factory=list)
    still: list[str] = field(default_factory=list)
    level: list[str] = field(default_factory=list)

    @property
    def along(self) -> bool:
        """Whether a maneuver of the elevator was flown."""
        return any(w.longitudinal for w in self.windows)

    @property
    def across(self) -> bool:
        """Whether one of aileron or rudder was flown."""
        return not all(w.longitudinal for w in self.windows)

    @property
    def zeros(self) -> Array:
        """A column of what does not move."""
        return np.zeros(len(self.columns["t_s"]))

    def leave_axes_out(self, model: CoefficientModel) -> None:
        """Leave out the equations of an axis that was not flown; its columns are zero."""
        flown = {True: self.across, False: self.along}
        self.lost = [n for n in model.equations if not flown[n in SIDE]]
        if self.lost:
            which = "the elevator" if self.across else "aileron and rudder"
            self.remarks.append(f"no maneuver of {which}: {', '.join(self.lost)} left out")
        needless = (() if self.across else SIDE_COLUMNS) + (() if self.along else PITCH_COLUMNS)
        if unflown := [c for c in needless if c not in self.columns]:
            self.remarks.append(f"taken as zero, for the data have none: {', '.join(unflown)}")
        self.columns |= dict.fromkeys(unflown, self.zeros)

    def fill_air(self) -> None:
        """Add columns of the air: of level flight without the elevator, else from each other."""
        self.assumed = _air_assumed(self.columns)
        needed = ("ax_mps2",) if self.along else LEVEL_COLUMNS
        self.level = [c for c in needed if c not in self.columns]
        if self.level:
            which = ", ".join(self.level)
            self.remarks.append(f"taken as in level flight, for the data have none: {which}")
            self.columns |= _level_flight(self.columns)
        if "alpha_rad" in self.level:
            self.assumed["alpha_zero_rad"] = LEVEL_SD_RAD
        self.remarks += _complete_air(self.columns)

    def leave_still_controls_out(self) -> None:
        """Leave out the terms of surfaces that never moved where their axis was flown."""
        if self.across:
            moved = CONTROLS.items()
            self.still = [k for k, c in moved if _still(self.columns, c, self.windows)]
        if self.still:
            names = [CONTROLS[k] for k in self.still]
            self.remarks.append(
                f"{', '.join(names)} never moved, or not in the data: its terms are left out"
            )
            self.columns |= {c: self.zeros for c in names if c not in self.columns}

    def take_thrust(self, model: CoefficientModel, powerplant: Powerplant) -> None:
        """Add thrust; leave out drag, which nothing tells without it or without `ax_mps2`."""
        thrust = thrust_column(self.columns, powerplant)
        self.remarks += thrust.remarks
        drag = [n for n in model.equations if n in DRAG and n not in self.lost]
        has_drag = self.along and bool(drag)
        if has_drag and self.level:
            self.lost += drag
            self.remarks.append(f"no ax_mps2: {', '.join(drag)} left out")
        elif not thrust.known:
            self.lost += drag
            if has_drag:
                self.remarks.append(
                    f"no thrust known: {', '.join(drag)} left out, the other coefficients hold what"
                    " thrust adds; give [propulsion] and throttle, thrust_n or power_w"
                )
        if thrust.thrust_n is not None:
            self.columns["thrust_n"] = thrust.thrust_n
        self.columns.setdefault("throttle", self.zeros)
        if thrust.assumed_share is not None:
            self.assumed["thrust_share"] = thrust.assumed_share


def _level_flight(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Return what nobody measured as it is in level flight."""
    still = np.zeros(len(columns["t_s"]))
    theta = columns.get("theta_rad", columns.get("alpha_rad", still))
    steady = {
        "theta_rad": theta,
        "alpha_rad": theta,
        "ax_mps2": GRAVITY_MPS2 * np.sin(theta),
        "az_mps2": -GRAVITY_MPS2 * np.cos(theta),
    }
    return {name: values for name, values in steady.items() if name not in columns}


def _air_assumed(columns: Mapping[str, Array]) -> dict[str, float]:
    """Return the deviations of a density that nobody measured, and of pressure made of it."""
    if "density_kgpm3" in columns:
        return {}
    known = {"density_share": DENSITY_SHARE}
    return known if "qbar_pa" in columns else known | {"pitot_scale": DENSITY_SHARE}


def _still(columns: Mapping[str, Array], name: str, windows: Sequence[Window]) -> bool:
    if name not in columns:
        return True
    t, values = columns["t_s"], columns[name]
    return all(
        float(np.ptp(values[(t >= w.first_s) & (t <= w.last_s)])) < STILL_RAD for w in windows
    )


def _complete_air(found: dict[str, Array]) -> list[str]:
    """Add dynamic pressure, density and static pressure where they follow from other columns."""
    remarks = []
    if "density_kgpm3" not in found:
        found["density_kgpm3"] = np.full(len(found["t_s"]), STANDARD_DENSITY)
        remarks.append(f"no density_kgpm3: {STANDARD_DENSITY} kg/m3 taken")
    if "qbar_pa" not in found and "airspeed_mps" in found:
        found["qbar_pa"] = 0.5 * found["density_kgpm3"] * found["airspeed_mps"] ** 2
        remarks.append("qbar_pa made of airspeed_mps and density")
    flown = ("theta_rad", "alpha_rad", "airspeed_mps")
    height_m = found.get("altitude_m")
    if height_m is None and all(name in found for name in flown):
        theta, alpha, speed = (found[name] for name in flown)
        dt_s = float(found["t_s"][1] - found["t_s"][0])
        height_m = np.cumsum(speed * np.sin(theta - alpha)) * dt_s
    if "static_pa" not in found and height_m is not None:
        found["static_pa"] = 101325.0 - GRAVITY_MPS2 * found["density_kgpm3"] * height_m
        of = "altitude_m" if "altitude_m" in found else "the path's angle"
        remarks.append(f"static_pa made of {of}")
    return remarks
