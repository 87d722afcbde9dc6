"""The equations that are shipped, on flights of the twin: do their intervals hold?

3-2-1-1s and doublets on three axes in calm air and in turbulence of 0.5 m/s, the truth at the CG
with white noise of usual sensors; constants are the aircraft's, density and spin of the rotor the
flight's. Each file is fitted as a user fits it, by the default or a method that is named.
Flight-path reconstruction gets sensors with errors that are drawn from its priors. One row a model,
air, flight and parameter goes to a file that a later run continues.
"""

from __future__ import annotations

import argparse
import functools
import sys
import tomllib
from collections.abc import Sequence
from dataclasses import asdict, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from host.aircraft.mass_properties import airframe_data
from host.aircraft.powerplant import powerplant
from host.errors import IdentificationError
from host.sysid.models import NonlinearModel, equations_from
from host.twin.testcard.cards import Card, load
from host.twin.virtual import VirtualFlight, virtual_flight

import host
from studies.stored_rows import flown_rows, rows_file

FIRST_SEED = 14650
AIRCRAFT = "ultrastick25e"
MODELS = ("longitudinal", "lateral", "six_degrees", "flight_path")
AIRS_MPS = (0.0, 0.5)
COLUMNS = (
    "model", "air_mps", "seed", "method", "name", "true", "estimate", "half_width", "mark",
)  # fmt: skip
PRINCIPAL = (
    "CL_alpha", "Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "Cn_r", "Cn_dr",
)  # fmt: skip
NOISE = {
    "airspeed_mps": 0.15, "alpha_rad": 0.004, "beta_rad": 0.004, "p_radps": 0.008,
    "q_radps": 0.008, "r_radps": 0.008, "phi_rad": 0.005, "theta_rad": 0.005, "ax_mps2": 0.08,
    "ay_mps2": 0.08, "az_mps2": 0.15,
}  # fmt: skip
AXES = {"longitudinal": ("elevator",), "lateral": ("aileron", "rudder")}
# Errors of flight-path reconstruction that these maneuvers tell, and what they are drawn with.
ERROR_SD = {
    "p_bias_radps": 0.01, "q_bias_radps": 0.01, "r_bias_radps": 0.01, "alpha_scale": 0.1,
    "beta_scale": 0.1,
}  # fmt: skip


def card(air_mps: float) -> Card:
    """Return the card: each input twice."""
    calm = load("calm")
    first, *inputs, last = calm.segments
    return replace(
        calm,
        segments=(first, *inputs, *inputs, last),
        air=replace(calm.air, turbulence_mps=air_mps),
        sensors=replace(calm.sensors, tolerances=False),
    )


def shipped(name: str, flight: VirtualFlight) -> NonlinearModel:
    """Return a model of the package with the constants of the aircraft and the flight."""
    path = files("host.sysid.models").joinpath("equations", f"{name}.toml")
    document = tomllib.loads(path.read_text(encoding="utf-8"))
    engine, table = powerplant(AIRCRAFT), flight.record.frame.alpha_nodes_rad
    known = asdict(airframe_data(AIRCRAFT)) | {
        "density_kgpm3": airborne(flight)["density_kgpm3"].mean(),
        "alpha_ref_rad": np.mean([m["condition"]["alpha_rad"] for m in of_axes(flight, "lateral")]),
        "gust_length_m": flight.record.card.flight.height_m,
        "alpha_low_rad": table[0],
        "alpha_high_rad": table[-1],
        "spin_kgm2ps": engine.rotor_kgm2 * airborne(flight)["rotor_radps"].mean(),
        "thrust_pitch_rad": -np.arcsin(engine.axis[2]),
        "thrust_arm_m": engine.hub_m[2] * engine.axis[0] - engine.hub_m[0] * engine.axis[2],
    }
    constants = document["constants"]
    document["constants"] = {k: float(known.get(k, value)) for k, value in constants.items()}
    return equations_from(document, name)


@functools.lru_cache(maxsize=1)
def flown(air_mps: float, seed: int) -> VirtualFlight:
    """Return one flight; all models are fitted to it in a row."""
    return virtual_flight(card(air_mps), seed, chain="true")


def of_axes(flight: VirtualFlight, axis: str) -> list[dict[str, Any]]:
    """Return what the truth says of the longitudinal or lateral maneuvers."""
    maneuvers: list[dict[str, Any]] = flight.maneuvers
    return [m for m in maneuvers if m["axes"][0] in AXES[axis]]


def airborne(flight: VirtualFlight) -> pd.DataFrame:
    """Return the true columns behind the launch."""
    return flight.table[flight.table["t_s"] > flight.record.card.flight.ground_s + 1.0]


def measured(flight: VirtualFlight, seed: int, errors: dict[str, float]) -> pd.DataFrame:
    """Return the table as sensors with noise and these errors give it."""
    rng, table = np.random.default_rng([seed, 17]), airborne(flight)
    changed = {}
    for name, sd in NOISE.items():
        stem = name.rsplit("_", 1)[0]
        scaled = table[name].to_numpy() * (1.0 + errors.get(f"{stem}_scale", 0.0))
        off = next((v for k, v in errors.items() if k.startswith(f"{stem}_bias")), 0.0)
        changed[name] = scaled + off + sd * rng.standard_normal(len(table))
    kept = ["t_s", "thrust_n", "elevator_rad", "aileron_rad", "rudder_rad"]
    return table[kept].assign(**changed)


def rows_of(
    model: str, air_mps: float, seed: int, method: str | None = None
) -> list[dict[str, object]]:
    """Fly and fit once; a fit without an answer leaves a row that says why."""
    rng = np.random.default_rng([seed, 18])
    path = model == "flight_path"
    errors = {n: sd * rng.standard_normal() for n, sd in ERROR_SD.items()} if path else {}
    cell: dict[str, object] = {"model": model, "air_mps": air_mps, "seed": seed}
    flight = flown(air_mps, seed)
    own = shipped(model, flight)
    try:
        found = host.identify(measured(flight, seed, errors), models=own, methods=method)
    except IdentificationError as error:
        return [cell | dict.fromkeys(COLUMNS[3:], "") | {"mark": str(error)}]
    answer = found.linear[0]
    marks = found.verdicts[0].marks
    half = answer.result.half_width()
    rows = []
    for name in [p.name for p in own.parameters]:
        truth = errors.get(name) if path else true_value(name, flight)
        if truth is None or name not in answer.result.names:
            continue
        k = answer.result.index(name)
        values = (answer.method, name, truth, float(answer.result.estimate[k]), float(half[k]))
        rows.append(cell | dict(zip(COLUMNS[3:], (*values, marks.get(name, "")), strict=True)))
    return rows


def true_value(name: str, flight: VirtualFlight) -> float | None:
    """Return the local derivative, mean over the maneuvers of its axis; None where it has none."""
    axis = "longitudinal" if name[:2] in ("CL", "CD", "Cm") else "lateral"
    tables = [m["derivatives"] for m in of_axes(flight, axis)]
    found = [float(t[name]) for t in tables if name in t]
    return float(np.mean(found)) if found else None


def table_of(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return a line for each model, air and parameter, and what each cell comes to."""
    lines = ["model         air  parameter     mean error %   rms   half  over rms  holds"]
    for model in MODELS:
        for air in AIRS_MPS:
            own = [
                r for r in rows
                if r["model"] == model and float(r["air_mps"]) == air and r["name"]
            ]  # fmt: skip
            good = 0
            for name in dict.fromkeys(r["name"] for r in own):
                one = [r for r in own if r["name"] == name]
                truth, value, half = (
                    np.array([float(r[k]) for r in one]) for k in ("true", "estimate", "half_width")
                )
                held = int(np.sum(np.abs(value - truth) <= half))
                if model != "flight_path" and name not in PRINCIPAL:
                    continue
                good += held
                size = 1.0 if model == "flight_path" else np.abs(truth) / 100.0
                off, wide = (value - truth) / size, np.median(half / size)
                rms = float(np.sqrt(np.mean(off**2)))
                lines.append(
                    f"{model:12s}  {air:3.1f}  {name:12s}  {np.mean(off):+11.3g}  {rms:6.3g}"
                    f"  {wide:6.3g}  {wide / rms:7.1f}  {held} of {len(one)}"
                )
            judged = [r for r in own if model == "flight_path" or r["name"] in PRINCIPAL]
            if judged:
                came = dict.fromkeys(r["method"] for r in own)
                lines.append(f"{model}, {air} m/s: {good} of {len(judged)} hold, by {[*came]}")
    lines.append(f"fits without an answer: {sum(not r['name'] for r in rows)}")
    return lines


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=50, help="of each model and air")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed")
    parser.add_argument("--models", nargs="+", choices=MODELS, default=list(MODELS))
    parser.add_argument("--airs", nargs="+", type=float, choices=AIRS_MPS, default=list(AIRS_MPS))
    parser.add_argument("--method", help="in place of the default")
    parser.add_argument("--rows", type=rows_file, default=Path("../build/study/shipped_models.csv"))
    options = parser.parse_args(arguments)
    seeds = range(options.first, options.first + options.flights)
    keys = ((m, air, seed) for seed in seeds for air in options.airs for m in options.models)
    fly = functools.partial(rows_of, method=options.method)
    rows = flown_rows(options.rows, COLUMNS, keys, fly)
    sys.stdout.write("\n".join(table_of([r for r in rows if int(r["seed"]) in seeds])) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
