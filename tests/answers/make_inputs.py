"""Make the stored inputs anew: virtual flights, the independent simulator, users' models, rows.

    PYTHONPATH=host .venv/bin/python -m tests.answers.make_inputs          all of them
    PYTHONPATH=host .venv/bin/python -m tests.answers.make_inputs axes       this flight

What comes out is the same to the digit on one machine only; a file whose SHA-256 changes moves
answers, so that inputs are made anew only where one is wanted otherwise. Files in `../data` and
those in `inputs/` that are written by hand (models, maps) are not made here.
"""

from __future__ import annotations

import argparse
import gzip
import json
import shutil
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from host.constants import GRAVITY_MPS2
from host.twin.flight.fly import FlightRecord, fly
from host.twin.outcome import ideal, original_logger, truth_files
from host.twin.outcome.autopilot_logs import NAMES, write_autopilot_log
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import sitl
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors.local_flow import AirData, air_data
from host.twin.testcard.cards import load
from numpy.typing import NDArray
from scipy import integrate
from studies.clean_records import AIRCRAFT
from studies.clean_records import NAMES as CLEAN_NAMES
from studies.clean_records import flown as flown_clean
from studies.foreign.aeroplane import TRAINER
from studies.foreign.flight import SPEED_MPS, derivatives
from studies.foreign.flight import fly as fly_trainer
from studies.foreign.instrument import SENSORS_FILE, drawn_file, with_sensor_errors
from studies.independent import cells
from studies.spoilt_columns import SLOW, held, quantised
from studies.users_models import TRUTH as USERS_TRUTH
from studies.users_models import flown as users_flight

from tests.answers.cases import CASES
from tests.answers.stored_input import HERE, write_sums

INPUTS, CARDS = HERE / "inputs", HERE / "cards"
Columns = Mapping[str, NDArray[Any]] | pd.DataFrame
# Dimensional derivatives grow with a power of airspeed.
POWERS = {"alpha": 2.0, "beta": 2.0, "de": 2.0, "da": 2.0, "dr": 2.0, "p": 1.0, "q": 1.0, "r": 1.0}
MEASURED = (
    "t_s", "airspeed_mps", "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps", "phi_rad",
    "theta_rad", "psi_rad", "ax_mps2", "ay_mps2", "az_mps2", "elevator_rad", "aileron_rad",
    "rudder_rad", "throttle", "qbar_pa", "density_kgpm3", "static_pa", "altitude_m",
)  # fmt: skip
GPS = ("latitude_deg", "longitude_deg", "gps_height_m", "v_north_mps", "v_east_mps", "v_down_mps")
LONGITUDINAL = (
    "t_s", "airspeed_mps", "alpha_rad", "q_radps", "theta_rad", "ax_mps2", "az_mps2",
    "elevator_rad",
)  # fmt: skip


def store_table(name: str, columns: Columns) -> None:
    """Write columns as float32, time to the microsecond as float64."""
    found: dict[str, Any] = {
        str(key): np.round(np.asarray(values, dtype=float), 6) if key == "t_s"
        else np.asarray(values, dtype=np.float32)
        for key, values in columns.items()
    }  # fmt: skip
    np.savez_compressed(INPUTS / f"{name}.npz", **found)


def store_bytes(name: str, content: bytes) -> None:
    """Write what ends in `.gz` packed, without a date."""
    packed = gzip.compress(content, 9, mtime=0) if name.endswith(".gz") else content
    (INPUTS / name).write_bytes(packed)


def store_truth(
    name: str, values: Mapping[str, Mapping[str, tuple[float, float]]], airspeed_mps: float
) -> None:
    """Write true values of each template: value at an airspeed, and the power it grows with."""
    document = {"airspeed_mps": airspeed_mps, "values": values}
    text = json.dumps(document, indent=1) + "\n"
    (INPUTS / f"{name}.truth.json").write_text(text, encoding="utf-8")


def flown(card: str, seed: int, instrument_seed: int | None = None) -> tuple[FlightRecord, AirData]:
    """Fly a card of this folder or a shipped one."""
    own = CARDS / f"{card}.toml"
    record = fly(load(own if own.is_file() else card), seed=seed, instrument_seed=instrument_seed)
    return record, air_data(record)


def twin_truth(name: str, record: FlightRecord, data: AirData) -> None:
    """Store local derivatives, averaged over the maneuvers of each axis."""
    every = truth_files.maneuvers(record, data)

    def mean(axes: set[str]) -> dict[str, tuple[float, float]]:
        found: list[Any] = [m["derivatives"] for m in every if axes & set(_list(m["axes"]))]
        names = found[0] if found else ()
        return {key: (float(np.mean([d[key] for d in found])), 0.0) for key in names}

    pitch, turn = mean({"elevator"}), mean({"aileron", "rudder"})
    both = pitch | {key: value for key, value in turn.items() if key[:2] in ("CY", "Cl", "Cn")}
    values = {
        "longitudinal": pitch, "short-period": pitch, "lateral": turn, "dutch-roll": turn,
        "coefficients": both,
    }  # fmt: skip
    store_truth(name, values, record.trim.airspeed_mps)


def _list(value: object) -> list[str]:
    return list(value) if isinstance(value, list | tuple) else [str(value)]


def own_log(
    name: str, card: str, seed: int, instrument_seed: int | None = None
) -> tuple[FlightRecord, AirData]:
    """Store the recorder's log of a flight, its calibration and its truth."""
    record, data = flown(card, seed, instrument_seed)
    recording = sitl.record(
        stimuli(record, data),
        rate_hz=sitl.recorder_rate_hz(record.card.flight.rate_hz),
        aircraft=record.aircraft.name,
        seed=record.seed,
    )
    store_bytes(f"{name}.bin.gz", recording.log)
    text = calibration(record.aircraft, record.draws.errors)
    store_bytes(f"{name}.calibration.toml", text.encode())
    twin_truth(name, record, data)
    return record, data


def axes() -> None:
    """Three axes: our log, and those of a PX4, an ArduPilot plane and telemetry."""
    record, data = own_log("axes", "axes", 44001)
    with tempfile.TemporaryDirectory() as folder:
        for kind in NAMES:
            _autopilot(kind, record, data, Path(folder) / "axes", "conventional")


def pitch() -> None:
    """Two more flights of the same instrument, elevator alone; one also of an ArduPilot plane."""
    record, data = own_log("pitch", "pitch", 44002, instrument_seed=44001)
    own_log("again", "pitch", 44005, instrument_seed=44001)
    with tempfile.TemporaryDirectory() as folder:
        _autopilot("dataflash", record, data, Path(folder) / "elevons", "elevons")


def _autopilot(kind: str, record: FlightRecord, data: AirData, stem: Path, airframe: str) -> None:
    path = write_autopilot_log(kind, record, data, stem, airframe=airframe)
    store_bytes(f"{path.name}.gz", path.read_bytes())


def multisine() -> None:
    """Sensors without a recorder, with GPS, at 50 Hz; and the truth of elevator alone."""
    record, data = flown("multisine", 44003)
    table = ideal.measured_table(record, data).assign(**ideal.gps_columns(record))
    kept = [name for name in (*MEASURED, *GPS) if name in table]
    store_table("multisine", _airborne(record, table)[kept][::2])
    twin_truth("multisine", record, data)
    table = _airborne(record, ideal.true_table(record, data))
    store_table("multisine-true", table[[*LONGITUDINAL, "thrust_n"]][:1700:2])


def _airborne(record: FlightRecord, table: pd.DataFrame) -> pd.DataFrame:
    return table[table["t_s"] > record.card.flight.ground_s + 1.0]


def rows() -> None:
    """Original rows of a trainer, of single sensors and of pairs."""
    record, data = flown("rows", 44004)
    printed = original_logger.rows(record, data)
    with tempfile.TemporaryDirectory() as folder:
        for name, paired in (("rows", False), ("rows-paired", True)):
            path = Path(folder) / f"{name}.txt"
            original_logger.write_rows(printed, path, paired=paired)
            store_bytes(f"{path.name}.gz", path.read_bytes())


def trainer(name: str, cell: str, seed: int, from_s: float, to_s: float) -> None:
    """The independent simulator: a stretch without errors of sensors, and with file and errors."""
    measured, _ = fly_trainer(cells()[cell], seed)
    rng = np.random.default_rng([44, seed])
    spoilt = with_sensor_errors(measured, rng)
    inside = (measured["t_s"] >= from_s) & (measured["t_s"] < to_s)
    inside &= np.arange(len(inside)) % 2 == 0  # 50 Hz
    store_table(name, {key: values[inside] for key, values in measured.items()})
    store_table(f"{name}-errors", {key: values[inside] for key, values in spoilt.items()})
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(drawn_file(Path(folder), rng), INPUTS / f"{name}.aircraft.toml")
    shutil.copy(SENSORS_FILE, INPUTS / "trainer-sensors.toml")
    dimensional = {
        key: (value, 1.0 if key == "Z_alpha" else POWERS[key.split("_")[1]])
        for key, value in derivatives(SPEED_MPS).items()
    }
    direct = {
        key: (float(getattr(TRAINER, key)), 0.0)
        for key in TRAINER.__dataclass_fields__
        if key.split("_")[0] in ("CL", "Cm", "CY", "Cl", "Cn") and "_" in key
    }
    linear = dimensional | direct
    models = ("longitudinal", "short-period", "lateral", "dutch-roll", "roll")
    store_truth(name, dict.fromkeys(models, linear) | {"coefficients": direct}, SPEED_MPS)


def spoilt() -> None:
    """Elevator inputs of the trainer in gusts, as tables that something is wrong with."""
    measured, _ = fly_trainer(cells()["dryden, turning, point, 0.5 m/s"], 44012)
    inside = measured["t_s"] < 33.0
    clean = {key: values[inside][::2] for key, values in measured.items()}
    alpha, rest = clean["alpha_rad"], np.arange(len(clean["t_s"]))
    stuck = np.where(rest > len(rest) // 3, alpha[len(rest) // 3], alpha)
    theta, phi = clean["theta_rad"], clean["phi_rad"]
    weight = {
        "ax_mps2": -GRAVITY_MPS2 * np.sin(theta),
        "ay_mps2": GRAVITY_MPS2 * np.cos(theta) * np.sin(phi),
        "az_mps2": GRAVITY_MPS2 * np.cos(theta) * np.cos(phi),
    }
    tables = {
        "gusty": clean,
        "quantised": quantised(clean),
        "held": held(clean, SLOW),
        "stuck": clean | {"alpha_rad": stuck},
        "degrees": clean | {"alpha_rad": np.degrees(alpha)},
        "backwards": clean | {"elevator_rad": -clean["elevator_rad"]},
        "weightless": clean | {key: clean[key] + w for key, w in weight.items()},
        "no-vane": {key: v for key, v in clean.items() if key != "alpha_rad"},
        "no-airspeed": {key: v for key, v in clean.items() if key != "airspeed_mps"},
    }
    for name, table in tables.items():
        kept = LONGITUDINAL if name not in ("gusty", "weightless") else tuple(table)
        store_table(f"trainer-{name}", {key: table[key] for key in kept if key in table})
    gap = (clean["t_s"] > 15.0) & (clean["t_s"] < 15.6)
    store_table("trainer-gap", {key: clean[key][~gap] for key in LONGITUDINAL})


def users() -> None:
    """A short period of a user behind a servo: white noise, noise with a memory, gusts."""
    values = {key: (value, 0.0) for key, value in USERS_TRUTH.items()}
    for noise in ("white", "coloured", "gust"):
        columns = users_flight(noise, 44020)
        store_table(f"users-{noise}", {key: v[::2] for key, v in columns.items()})
        first = columns["t_s"] < 4.5
        if noise == "white":  # a second record of another rate
            again = users_flight(noise, 44021)
            store_table("users-quick", {key: v[first] for key, v in again.items()})
    store_truth("users", {"mine": values, "short-period": values}, 17.0)


def clean() -> None:
    """Records without noise, by how the input moved between samples."""
    true = AIRCRAFT[1]
    for kind in ("servo", "steps", "steps, held"):
        table = flown_clean(kind, true, 0.02, np.random.default_rng(44030))
        store_table(f"clean-{kind.replace(', ', '-')}", table)
    named = {key: (value, 0.0) for key, value in zip(CLEAN_NAMES, true, strict=True)}
    store_truth("clean", {"mine": named, "short-period": named}, 17.0)


def equations() -> None:
    """Users' equations: pitch with a bend in its lift, two records; a pendulum without an input."""
    rng = np.random.default_rng(44040)
    t = np.arange(125) * 0.04
    for number, bias in enumerate((0.02, -0.03), start=1):
        u = 0.08 * np.where((t > 1.0) & (t < 4.0), np.sign(np.sin((2.0 + number) * t)), 0.0)

        def bent(now: float, x: NDArray[Any], command: NDArray[Any] = u) -> list[float]:
            lift = -5.0 * x[0] + 4.0 * x[0] * abs(x[0]) + 0.1
            de = float(command[min(int(now / 0.04 + 1e-9), len(command) - 1)])
            return [x[1] + lift, -50.0 * np.sin(x[0]) - 5.0 * x[1] - 60.0 * de - 0.5]

        x = _path(bent, [0.01, 0.0], t, largest_s=0.005)
        y = x + np.array([0.0, bias]) + rng.standard_normal(x.shape) * [0.002, 0.008]
        columns = {"t_s": t, "elevator_rad": u, "alpha_rad": y[:, 0], "q_radps": y[:, 1]}
        store_table(f"bend-{number}", columns)
    bend = {"Za": -5.0, "Zaa": 4.0, "Z0": 0.1, "Ma": -50.0, "Mq": -5.0, "Mde": -60.0, "M0": -0.5}
    store_truth("bend", {"pitch with a bend": {k: (v, 0.0) for k, v in bend.items()}}, 17.0)
    x = _path(lambda _, x: [x[1], -25.0 * np.sin(x[0]) - 0.4 * x[1]], [0.8, 0.0], t)
    store_table("pendulum", {"t_s": t, "phi_rad": x[:, 0] + 0.003 * rng.standard_normal(len(t))})
    swing = {"stiffness": (25.0, 0.0), "damping": (0.4, 0.0)}
    store_truth("pendulum", {"pendulum": swing}, 17.0)


def _path(
    rates: Callable[[float, NDArray[Any]], list[float]],
    start: list[float],
    t_s: NDArray[Any],
    largest_s: float = np.inf,
) -> NDArray[np.float64]:
    """Integrate with an integrator that is not ours."""
    span = (0.0, float(t_s[-1]))
    found = integrate.solve_ivp(
        rates, span, start, t_eval=t_s, rtol=1e-9, atol=1e-9, max_step=largest_s
    )
    return np.asarray(found.y.T)


FLIGHTS: dict[str, Callable[[], object]] = {
    "axes": axes,
    "pitch": pitch,
    "multisine": multisine,
    "rows": rows,
    "trainer-pitch": lambda: trainer("trainer-pitch", "calm", 44010, 0.0, 40.0),
    "trainer-turn": lambda: trainer(
        "trainer-turn", "karman, turning, spread, 0.5 m/s", 44011, 40.0, 100.0
    ),
    "spoilt": spoilt,
    "users": users,
    "clean": clean,
    "equations": equations,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly what is asked for, and write the sums of all that the cases read."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", choices=[[], *FLIGHTS], help="none means all")
    INPUTS.mkdir(exist_ok=True)
    for name in parser.parse_args(arguments).names or FLIGHTS:
        print(name, flush=True)
        FLIGHTS[name]()
    write_sums(name for case in CASES for name in case.files)
    return 0


if __name__ == "__main__":
    sys.exit(main())
