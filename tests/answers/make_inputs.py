"""Make the stored inputs anew: virtual flights, the independent simulator, users' models, rows.

    PYTHONPATH=host .venv/bin/python -m tests.answers.make_inputs            all of them
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
from host.twin.flight.fly import FlightRecord, fly
from host.twin.outcome import truth_files
from host.twin.outcome.autopilot_logs import NAMES, write_autopilot_log
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import sitl
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors.local_flow import AirData, air_data
from host.twin.testcard.cards import load
from numpy.typing import NDArray
from studies.foreign.aeroplane import TRAINER
from studies.foreign.flight import SPEED_MPS, derivatives
from studies.foreign.flight import fly as fly_trainer
from studies.foreign.instrument import SENSORS_FILE, drawn_file, with_sensor_errors
from studies.independent import cells
from studies.users_models import TRUTH as USERS_TRUTH
from studies.users_models import flown as users_flight

from tests.answers.cases import CASES
from tests.answers.stored_input import HERE, write_sums

INPUTS, CARDS = HERE / "inputs", HERE / "cards"
Columns = Mapping[str, NDArray[Any]]
# Dimensional derivatives grow with a power of airspeed.
POWERS = {"alpha": 2.0, "beta": 2.0, "de": 2.0, "da": 2.0, "dr": 2.0, "p": 1.0, "q": 1.0, "r": 1.0}
MEASURED = (
    "t_s", "airspeed_mps", "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps", "phi_rad",
    "theta_rad", "psi_rad", "ax_mps2", "ay_mps2", "az_mps2", "elevator_rad", "aileron_rad",
    "rudder_rad", "throttle", "qbar_pa", "density_kgpm3", "static_pa", "altitude_m",
)  # fmt: skip


def store_table(name: str, columns: Columns) -> None:
    """Write columns as float32, time to the microsecond as float64."""
    found = {
        key: np.round(np.asarray(values, dtype=float), 6) if key == "t_s"
        else np.asarray(values, dtype=np.float32)
        for key, values in columns.items()
    }  # fmt: skip
    np.savez_compressed(INPUTS / f"{name}.npz", allow_pickle=False, **found)


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


def flown(card: str, seed: int) -> tuple[FlightRecord, AirData]:
    """Fly a card of this folder or a shipped one."""
    own = CARDS / f"{card}.toml"
    record = fly(load(own if own.is_file() else card), seed=seed)
    return record, air_data(record)


def twin_truth(name: str, record: FlightRecord, data: AirData) -> None:
    """Store local derivatives, averaged over the maneuvers of each axis."""
    every = truth_files.maneuvers(record, data)

    def mean(axes: set[str]) -> dict[str, tuple[float, float]]:
        found: list[Any] = [m["derivatives"] for m in every if axes & set(_list(m["axes"]))]
        return {key: (float(np.mean([d[key] for d in found])), 0.0) for key in found[0]}

    pitch, turn = mean({"elevator"}), mean({"aileron", "rudder"})
    both = {key: (turn if key[:2] in ("CY", "Cl", "Cn") else pitch)[key] for key in pitch}
    values = {
        "longitudinal": pitch, "short-period": pitch, "lateral": turn, "dutch-roll": turn,
        "coefficients": both,
    }  # fmt: skip
    store_truth(name, values, record.trim.airspeed_mps)


def _list(value: object) -> list[str]:
    return list(value) if isinstance(value, list | tuple) else [str(value)]


def own_log(name: str, card: str, seed: int) -> tuple[FlightRecord, AirData]:
    """Store the recorder's log of a flight, its calibration and its truth."""
    record, data = flown(card, seed)
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
            path = write_autopilot_log(
                kind, record, data, Path(folder) / "axes", airframe="conventional"
            )
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


def users() -> None:
    """A short period of a user behind a servo: white noise, noise with a memory, gusts."""
    values = {key: (value, 0.0) for key, value in USERS_TRUTH.items()}
    for noise in ("white", "coloured", "gust"):
        columns = users_flight(noise, 44020)
        store_table(f"users-{noise}", {key: v[::2] for key, v in columns.items()})
    store_truth("users", {"mine": values}, 17.0)


FLIGHTS: dict[str, Callable[[], object]] = {
    "axes": axes,
    "trainer-pitch": lambda: trainer("trainer-pitch", "calm", 44010, 0.0, 40.0),
    "trainer-turn": lambda: trainer(
        "trainer-turn", "karman, turning, spread, 0.5 m/s", 44011, 40.0, 100.0
    ),
    "users": users,
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
