"""Aircraft files: mass, geometry, aerodynamics, propulsion, sensors, and where each number comes
from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from host.aircraft.aircraft_ranges import RANGES, UNKNOWN_ANGLE_RAD
from host.aircraft.airframe import COEFFICIENTS, Airframe, Array
from host.aircraft.dimension_file import from_dimensions, is_dimensions
from host.aircraft.linear_dynamics import LinearDynamics
from host.aircraft.size_ratios import doubts, impossible
from host.aircraft.vane_file import with_vane
from host.constants import GRAVITY_MPS2
from host.errors import UsageError
from host.files import toml_reader

FOLDER = Path(__file__).parent / "airframes"
# Sizes of a trainer, to be copied: the handbook makes an aircraft of them.
SIZES = FOLDER.with_name("dimensions") / "kadetlt40.toml"

_SCALARS: Mapping[str, tuple[str, ...]] = {
    "mass": (
        "mass_kg", "ixx_kgm2", "iyy_kgm2", "izz_kgm2", "ixz_kgm2",
        "mass_tolerance", "inertia_tolerance", "cg_tolerance_m",
    ),
    "geometry": ("wing_area_m2", "span_m", "chord_m"),
    "trim": ("airspeed_mps", "minimum_airspeed_mps", "maximum_airspeed_mps"),
    "aerodynamics": ("cd_0", "induced_factor", "stall_lift_perrad2", "stall_drag_perrad2"),
    "propulsion": (
        "diameter_m", "advance_ratio_max", "rotor_inertia_kgm2", "motor_torque_max_nm",
        "friction_torque_nm", "brake_torque_nm", "stopped_drag_area_m2", "thrust_pitch_rad",
    ),
    "servo": ("bandwidth_hz", "rate_limit_radps"),
    "surfaces": ("elevator_limit_rad", "aileron_limit_rad", "rudder_limit_rad"),
    "sensors": ("position_tolerance_m", "upwash", "upwash_tolerance",
        "vane_frequency_hz_per_mps", "vane_damping", "vane_friction_rad", "pitot_lag_s"),
}  # fmt: skip
_VECTORS: Mapping[str, tuple[str, ...]] = {
    "mass": ("cg_m",),
    "geometry": (),
    "trim": (),
    "aerodynamics": ("alpha_rad", "stall_alpha_rad", *COEFFICIENTS),
    "propulsion": ("ct_polynomial", "cp_polynomial", "motor_power_polynomial_w", "hub_m"),
    "servo": (),
    "surfaces": (),
    "sensors": ("imu_m", "vane_a_m", "vane_b_m", "pitot_a_m", "pitot_b_m", "gps_m"),
}

# Keys that a file may leave out, with the value that then counts.
_OPTIONAL: Mapping[str, Mapping[str, float]] = {
    "geometry": {
        "elevator_arm_m": 0.0, "rudder_arm_m": 0.0, "arm_tolerance": 0.10,
        "ground_pitch_rad": 0.0, "ground_pitch_tolerance_rad": UNKNOWN_ANGLE_RAD,
    },
}  # fmt: skip

# Sections of a measured aircraft: enough to identify it, not enough to simulate it.
MEASURED = ("mass", "geometry", "trim", "sensors")
MEASURED_IF_THERE = ("propulsion", "servo", "surfaces")
_MEASURED_TRIM = ("airspeed_mps",)
_LONGEST = 200  # numbers of one list
_LENGTHS = {"alpha_rad": (2, _LONGEST), "stall_alpha_rad": (2, 2)}


class AircraftError(UsageError):
    """An aircraft file that cannot be used: what was found, what was expected."""


@dataclass(frozen=True, slots=True)
class Aircraft:
    """One aircraft file.

    Attributes
    ----------
    name, title : str
        Name of the file, name for people.
    scalars, vectors : mapping
        Numbers under "section.key", SI.
    sources : mapping
        Where each of them comes from, under the same keys.
    straight : LinearDynamics, optional
        Matrices of a linear aircraft, which replace its aerodynamics and propulsion.
    """

    name: str
    title: str
    scalars: Mapping[str, float]
    vectors: Mapping[str, Array]
    sources: Mapping[str, str]
    straight: LinearDynamics | None = None

    def scalar(self, key: str) -> float:
        """Return one number by "section.key"."""
        return self.scalars[key]

    @property
    def doubts(self) -> tuple[str, ...]:
        """Warnings for the user, a line for each ratio of sizes that no known aircraft has."""
        return tuple(f"{self.name}: {one}" for one in doubts(self.scalars, self.vectors))

    def vector(self, key: str) -> Array:
        """Return a copy of one array by "section.key"."""
        return self.vectors[key].copy()

    def airframe(self) -> Airframe:
        """Return the nominal aircraft as the equations of motion take it."""
        s, v = self.scalars, self.vectors
        pitch = s["propulsion.thrust_pitch_rad"]
        frame = Airframe(
            mass_kg=s["mass.mass_kg"],
            ixx_kgm2=s["mass.ixx_kgm2"],
            iyy_kgm2=s["mass.iyy_kgm2"],
            izz_kgm2=s["mass.izz_kgm2"],
            ixz_kgm2=s["mass.ixz_kgm2"],
            cg_m=v["mass.cg_m"].copy(),
            wing_area_m2=s["geometry.wing_area_m2"],
            span_m=s["geometry.span_m"],
            chord_m=s["geometry.chord_m"],
            alpha_nodes_rad=v["aerodynamics.alpha_rad"].copy(),
            derivatives=np.column_stack([v[f"aerodynamics.{name}"] for name in COEFFICIENTS]),
            cd_0=s["aerodynamics.cd_0"],
            induced_factor=s["aerodynamics.induced_factor"],
            stall_alpha_low_rad=float(v["aerodynamics.stall_alpha_rad"][0]),
            stall_alpha_high_rad=float(v["aerodynamics.stall_alpha_rad"][1]),
            stall_lift_perrad2=s["aerodynamics.stall_lift_perrad2"],
            stall_drag_perrad2=s["aerodynamics.stall_drag_perrad2"],
            propeller_diameter_m=s["propulsion.diameter_m"],
            ct_polynomial=v["propulsion.ct_polynomial"].copy(),
            cp_polynomial=v["propulsion.cp_polynomial"].copy(),
            advance_ratio_max=s["propulsion.advance_ratio_max"],
            rotor_inertia_kgm2=s["propulsion.rotor_inertia_kgm2"],
            motor_power_polynomial_w=v["propulsion.motor_power_polynomial_w"].copy(),
            motor_torque_max_nm=s["propulsion.motor_torque_max_nm"],
            friction_torque_nm=s["propulsion.friction_torque_nm"],
            brake_torque_nm=s["propulsion.brake_torque_nm"],
            stopped_drag_area_m2=s["propulsion.stopped_drag_area_m2"],
            thrust_axis=np.array([math.cos(pitch), 0.0, -math.sin(pitch)]),
            hub_m=v["propulsion.hub_m"].copy(),
            servo_bandwidth_radps=2.0 * math.pi * s["servo.bandwidth_hz"],
            servo_rate_radps=s["servo.rate_limit_radps"],
            surface_limit_rad=np.array(
                [s[f"surfaces.{name}_limit_rad"] for name in ("elevator", "aileron", "rudder")]
            ),
            gravity_mps2=GRAVITY_MPS2,
            free=1.0,
        )
        return frame if self.straight is None else self.straight.fitted(frame)


def names() -> list[str]:
    """Return the names of the aircraft that come with the package, linear ones too, sorted."""
    return toml_reader.names(FOLDER)


def read_document(source: str | Path) -> dict[str, object]:
    """Read an aircraft file; a file of dimensions is first completed by the handbook.

    Parameters
    ----------
    source : str or Path
        Name of a packaged aircraft, or path of a file.

    Raises
    ------
    AircraftError
        No such file, not TOML, or of another format.
    """
    document = toml_reader.read(source, FOLDER, "aircraft", AircraftError)
    if is_dimensions(document):
        document = from_dimensions(document, source, AircraftError)
    if "states" in document and "format" not in document:
        raise AircraftError(
            f"{source}: a model of one axis, no aircraft; `host identify LOG --aircraft NAME"
            " --save-aircraft FILE` writes an aircraft with what was identified"
        )
    toml_reader.check_format(document, Path(source).name, AircraftError)
    return with_vane(document, Path(source).parent, Path(source).name, AircraftError)


def load(source: str | Path) -> Aircraft:
    """Load a non-linear aircraft.

    Parameters
    ----------
    source : str or Path
        Name of a packaged aircraft, or path of a file.

    Returns
    -------
    Aircraft

    Raises
    ------
    AircraftError
        A number is missing, is not a number, has no source, or a table has the wrong length.
    """
    document = read_document(source)
    kind = document.get("kind")
    if kind == "measured":
        raise AircraftError(
            f"{source}: a measured aircraft has no aerodynamics; take a file of its dimensions"
            f" (copy {SIZES}, put yours in), or, after a flight, the models of host identify LOG"
            " --save-model FILE"
        )
    if kind != "nonlinear":
        raise AircraftError(f"{source}: kind is {kind!r}, expected 'nonlinear'")
    loaded = _loaded(source, document, _SCALARS)
    nodes = len(loaded.vectors["aerodynamics.alpha_rad"])
    for name in COEFFICIENTS:
        found = len(loaded.vectors[f"aerodynamics.{name}"])
        if found != nodes:
            raise AircraftError(
                f"{source}: aerodynamics.{name} has {found} values, expected {nodes} as alpha_rad"
            )
    for name in ("alpha_rad", "stall_alpha_rad"):
        if np.any(np.diff(loaded.vectors[f"aerodynamics.{name}"]) <= 0.0):
            raise AircraftError(f"{source}: aerodynamics.{name} must increase")
    return loaded


def load_measured(source: str | Path) -> Aircraft:
    """Load what can be measured on the ground: mass, sizes, places of the sensors.

    Parameters
    ----------
    source : str or Path
        Name of a packaged aircraft, or path of a file; of kind ``measured`` (sections mass,
        geometry, trim, sensors, and propulsion if it is known) or ``nonlinear``.

    Returns
    -------
    Aircraft
        Aerodynamics and surfaces of a measured file are zeros. It has a servo or propulsion only
        where it has a section of that name.

    Raises
    ------
    AircraftError
        A number is missing, is not a number or has no source.
    """
    document = read_document(source)
    if document.get("kind") == "linear":  # its sizes are those of its base aircraft
        base = load_measured(str(document.get("base", "")))
        return replace(base, title=str(document.get("title", source)))
    if document.get("kind") != "measured":
        return load(source)
    there = tuple(name for name in MEASURED_IF_THERE if name in document)
    wanted = {name: _SCALARS[name] for name in (*MEASURED, *there)}
    found = _loaded(source, document, wanted | {"trim": _MEASURED_TRIM})
    scalars, vectors = dict(found.scalars), dict(found.vectors)
    unsaid = (name for name in ("aerodynamics", "servo", "surfaces") if name not in there)
    for section in unsaid:
        scalars |= {f"{section}.{key}": 0.0 for key in _SCALARS[section]}
        vectors |= {f"{section}.{key}": np.zeros(2) for key in _VECTORS[section]}
    return replace(found, scalars=scalars, vectors=vectors)


def _loaded(
    source: str | Path, document: Mapping[str, object], wanted: Mapping[str, tuple[str, ...]]
) -> Aircraft:
    scalars: dict[str, float] = {}
    vectors: dict[str, Array] = {}
    sources: dict[str, str] = {}
    for section, keys in wanted.items():
        table = document.get(section)
        if not isinstance(table, dict):
            raise AircraftError(f"{source}: section [{section}] is missing")
        optional = _OPTIONAL.get(section, {})
        for key in (*keys, *optional):
            where = f"{source}: {section}.{key}"
            value = table.get(key, optional.get(key))
            scalars[f"{section}.{key}"] = RANGES[f"{section}.{key}"].check(
                where, value, AircraftError
            )
        for key in _VECTORS[section]:
            where = f"{source}: {section}.{key}"
            quantity = RANGES[f"{section}.{key}"]
            listed = toml_reader.listed(where, table.get(key), AircraftError)
            if key.endswith("_m") and len(listed) != 3:  # a place
                raise AircraftError(f"{where} has {len(listed)} numbers, expected 3: x, y, z")
            least, most = _LENGTHS.get(key, (1, _LONGEST))
            if not least <= len(listed) <= most:
                raise AircraftError(
                    f"{where} has {len(listed)} numbers, expected {least} to {most}"
                )
            vectors[f"{section}.{key}"] = np.array(
                [quantity.check(f"{where}[{k}]", x, AircraftError) for k, x in enumerate(listed)]
            )
        own = table.get("sources", {})
        if not isinstance(own, dict):
            raise AircraftError(f"{source}: {section}.sources is no table")
        for key in (*keys, *optional, *_VECTORS[section]):
            origin = own.get(key, table.get("source", ""))
            if not isinstance(origin, str) or not origin:
                raise AircraftError(f"{source}: {section}.{key} has no source")
            sources[f"{section}.{key}"] = origin
    for wrong in impossible(scalars, vectors):
        raise AircraftError(f"{source}: {wrong}")
    return Aircraft(
        name=str(document.get("name", Path(source).stem)),
        title=str(document.get("title", source)),
        scalars=scalars,
        vectors=vectors,
        sources=sources,
    )
