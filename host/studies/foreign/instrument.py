"""The trainer's sensors and file with errors, each drawn by the deviation that a file states."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from host.export.toml import dumps
from host.physical.calibration import load_calibration
from numpy.typing import NDArray

from studies.foreign.aeroplane import DENSITY_KGPM3, TRAINER, Trainer, thrust_n, trimmed
from studies.foreign.flight import SPEED_MPS

Columns = dict[str, NDArray[np.float64]]
TRAINER_FILE, WING_FILE, SENSORS_FILE = (
    Path(__file__).with_name(f"{n}.toml") for n in ("trainer", "flying_wing", "sensors")
)
GYROS, ACCELEROMETERS = ("p_radps", "q_radps", "r_radps"), ("ax_mps2", "ay_mps2", "az_mps2")
PLACES = ("imu_m", "vane_a_m", "vane_b_m", "pitot_a_m", "pitot_b_m")


def with_sensor_errors(
    measured: Columns, rng: np.random.Generator, a: Trainer = TRAINER
) -> Columns:
    """Return columns as these sensors tell them, thrust by the airspeed they tell, and density."""
    sd = {name: float(table["sigma"]) for name, table in _errors().items() if "sigma" in table}
    found = dict(measured)

    def drawn(error: str) -> float:
        return float(sd[error] * rng.standard_normal())

    turn = np.cross(np.eye(3), [drawn("misalignment_rad") for _ in range(3)])
    for names, bias, scale in (
        (GYROS, "gyro_bias_radps", "gyro_scale"),
        (ACCELEROMETERS, "accel_bias_mps2", "accel_scale"),
    ):
        turned = np.column_stack([measured[n] for n in names]) @ (np.eye(3) + turn)
        for name, values in zip(names, turned.T, strict=True):
            found[name] = values * (1.0 + drawn(scale)) + drawn(bias)
    vane = 1.0 + drawn("vane_scale")
    for name in ("alpha_rad", "beta_rad"):  # two vanes each
        zero = 0.5 * (drawn("vane_zero_rad") + drawn("vane_zero_rad"))
        found[name] = measured[name] * vane + zero
    pressure = 0.5 * DENSITY_KGPM3 * measured["airspeed_mps"] ** 2
    pressure = pressure * (1.0 + drawn("pitot_scale")) + drawn("pitot_zero_pa")
    density = DENSITY_KGPM3 * (1.0 + drawn("density_share"))
    found["airspeed_mps"] = np.sqrt(2.0 * np.maximum(pressure, 0.0) / density)
    for name, pots in (("elevator_rad", 1), ("aileron_rad", 2), ("rudder_rad", 1)):
        slope = 1.0 + np.mean([drawn("pot_scale") for _ in range(pots)])
        zero = float(np.mean([drawn("pot_zero_rad") for _ in range(pots)]))
        found[name] = measured[name] * slope + zero
    _, _, throttle = trimmed(SPEED_MPS, a)  # where it stays
    found["thrust_n"] = thrust_n(throttle, found["airspeed_mps"], a)
    found["density_kgpm3"] = np.full(len(measured["t_s"]), density)
    return found


def drawn_file(folder: Path, rng: np.random.Generator, own: Path = TRAINER_FILE) -> Path:
    """Write the aircraft's file with mass, inertia and places as its owner measured them."""
    document: dict[str, Any] = tomllib.loads(own.read_text(encoding="utf-8"))
    mass, sensors = document["mass"], document["sensors"]

    def off(tolerance: float, size: int = 1) -> NDArray[np.float64]:
        return rng.uniform(-tolerance, tolerance, size)

    mass["mass_kg"] *= 1.0 + float(off(mass["mass_tolerance"])[0])
    for name in ("ixx_kgm2", "iyy_kgm2", "izz_kgm2"):
        mass[name] *= 1.0 + float(off(mass["inertia_tolerance"])[0])
    mass["cg_m"] = off(mass["cg_tolerance_m"], 3)
    for name in PLACES:
        sensors[name] = off(sensors["position_tolerance_m"], 3)
    path = folder / own.name
    path.write_text(dumps(document), encoding="utf-8")
    return path


def _errors() -> dict[str, Any]:
    return dict(load_calibration(SENSORS_FILE).errors)
