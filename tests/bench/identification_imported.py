"""Imported virtual flights against a plain least-squares pipeline, as open PX4 projects have it,
and against AeroID.

    .venv/bin/python tests/bench/identification_imported.py --aeroid 3   # all flights, ten minutes

The pipeline (ethz-asl data-driven-dynamics is of this kind): velocity of GPS turned by the attitude
gives the angles, without wind; forces and moments over dynamic pressure are regressed on angles,
rates and commands over the whole flight, the interval is the regression's own. Ours is `host
identify` of the same log. AeroID (`identification_aeroid.py`) gets a stretch of the flight and
300 s of processor time. Logs are those a PX4 plane would have written.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from host.aircraft.mass_properties import airframe_data
from host.constants import NORMAL_95
from host.sysid.flight import read_flight_columns
from host.sysid.numerics.differentiation import local_polynomial
from host.sysid.pipeline import aircraft_data
from host.sysid.pipeline.surface_travel import with_surface_angles
from host.twin.flight.fly import fly
from host.twin.outcome.autopilot_logs import write_autopilot_log
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import load

import host

sys.path.insert(0, str(Path(__file__).parents[2]))
sys.path.insert(0, str(Path(__file__).parents[2] / "host"))
from studies.imported_logs import AIRCRAFT, MODELS, truth

from tests.bench.identification_aeroid import by_aeroid

FIRST_SEED, TURBULENCE_MPS = 430, 0.3
LEAST_SPEED_MPS = 10.0
SMOOTH_S = 0.05
AEROID_LIMIT_S = 300
Told = dict[str, tuple[float, float]]


def least_squares(path: Path) -> Told:
    """Return estimate and 95 % half-width of each coefficient by plain regression."""
    read = read_flight_columns(path)
    c, _ = with_surface_angles(read.columns, read.shares, aircraft_data(AIRCRAFT))
    frame = airframe_data(AIRCRAFT)
    t = c["t_s"]
    step_s = float(t[1] - t[0])
    phi, theta, psi = c["phi_rad"], c["theta_rad"], c["psi_rad"]
    north, east, down = c["v_north_mps"], c["v_east_mps"], c["v_down_mps"]
    along = np.cos(psi) * north + np.sin(psi) * east
    right = -np.sin(psi) * north + np.cos(psi) * east
    u = np.cos(theta) * along - np.sin(theta) * down
    dive = np.sin(theta) * along + np.cos(theta) * down
    v = np.cos(phi) * right + np.sin(phi) * dive
    w = -np.sin(phi) * right + np.cos(phi) * dive
    speed = np.maximum(c["airspeed_mps"], 1.0)
    force = 0.5 * c["density_kgpm3"] * speed**2 * frame.wing_area_m2
    alpha, beta = np.arctan2(w, u), np.arctan2(v, u)
    rates = np.column_stack([c[f"{a}_radps"] for a in "pqr"])
    turn = local_polynomial(rates, 2 * round(SMOOTH_S / step_s) + 1, 2, derivative=1, dt_s=step_s)
    span, chord = frame.span_m / (2.0 * speed), frame.chord_m / (2.0 * speed)
    p, q, r = rates[:, 0] * span, rates[:, 1] * chord, rates[:, 2] * span
    de, da, dr = (c[f"{n}_rad"] for n in ("elevator", "aileron", "rudder"))
    one, aloft = np.ones(len(t)), c["airspeed_mps"] > LEAST_SPEED_MPS
    lift = -frame.mass_kg * c["az_mps2"] / force
    pitch = frame.iyy_kgm2 * turn[:, 1] / (force * frame.chord_m)
    roll = frame.ixx_kgm2 * turn[:, 0] / (force * frame.span_m)
    yaw = frame.izz_kgm2 * turn[:, 2] / (force * frame.span_m)
    found: Told = {}
    longitudinal, lateral = (one, alpha, q, de), (one, beta, p, r, da, dr)
    for left, right_side, names in (
        (lift, longitudinal, ("", "CL_alpha", "", "")),
        (pitch, longitudinal, ("", "Cm_alpha", "Cm_q", "Cm_de")),
        (roll, lateral, ("", "", "Cl_p", "", "Cl_da", "")),
        (yaw, lateral, ("", "Cn_beta", "", "Cn_r", "", "Cn_dr")),
    ):
        x, y = np.column_stack(right_side)[aloft], left[aloft]
        inverse = np.linalg.inv(x.T @ x)
        estimate = inverse @ x.T @ y
        variance = float(np.sum((y - x @ estimate) ** 2)) / (len(y) - x.shape[1])
        half = NORMAL_95 * np.sqrt(variance * np.diag(inverse))
        found |= {
            n: (float(a), float(b)) for n, a, b in zip(names, estimate, half, strict=True) if n
        }
    return found


def ours(path: Path) -> Told:
    """Return the same by `host identify`."""
    table = host.identify(path, aircraft=AIRCRAFT, models=MODELS).table.reset_index()
    return {
        str(n): (float(a), float(b))
        for n, a, b in zip(table["name"], table["value"], table["half_width"], strict=True)
    }


def main(arguments: list[str] | None = None) -> int:
    """Print a row of each: median error, intervals that hold the truth, processor time."""
    parser = argparse.ArgumentParser(description="imported flights by three estimators")
    parser.add_argument("--flights", type=int, default=3)
    parser.add_argument("--aeroid", type=int, default=1, help="flights of them for AeroID")
    options = parser.parse_args(arguments)
    flights = options.flights
    card = load("demo")
    card = replace(card, air=replace(card.air, turbulence_mps=TURBULENCE_MPS))
    print(f"{flights} flights of the card demo in {TURBULENCE_MPS} m/s, as PX4 logs them")
    results: dict[str, list[tuple[float, bool]]] = {}
    seconds: dict[str, list[float]] = {}
    asked: dict[str, int] = {}
    for number, seed in enumerate(range(FIRST_SEED, FIRST_SEED + flights)):
        record = fly(card, seed=seed)
        data = air_data(record)
        true = truth(record, data)
        with tempfile.TemporaryDirectory() as folder:
            path = write_autopilot_log(
                "ulog", record, data, Path(folder) / "flight", airframe="conventional"
            )
            for name, by in (("plain least squares", timed(least_squares)),
                             ("host identify", timed(ours)),
                             ("AeroID, a stretch", aeroid_stretch)):  # fmt: skip
                if by is aeroid_stretch and number >= options.aeroid:
                    continue
                intervals, took = by(path)
                seconds.setdefault(name, []).append(took)
                asked[name] = asked.get(name, 0) + len(true)
                results.setdefault(name, []).extend(
                    (abs(intervals[n][0] / v - 1.0), abs(intervals[n][0] - v) <= intervals[n][1])
                    for n, v in true.items() if n in intervals
                )  # fmt: skip
    for name, rows in results.items():
        error = np.median([one for one, _ in rows]) if rows else float("nan")
        print(
            f"{name:22s} median error {100 * error:5.1f} %  held {sum(h for _, h in rows):3d} of"
            f" {len(rows)} estimated of {asked[name]}  {np.median(seconds[name]):6.1f} s a flight"
        )
    return 0


def timed(by: Callable[[Path], Told]) -> Callable[[Path], tuple[Told, float]]:
    """Return an estimator that tells its processor time too."""

    def run(path: Path) -> tuple[Told, float]:
        begin = time.process_time()
        return by(path), time.process_time() - begin

    return run


def aeroid_stretch(path: Path) -> tuple[Told, float]:
    """Return what AeroID tells within its time, and that time."""
    return by_aeroid(path, AIRCRAFT, AEROID_LIMIT_S)


if __name__ == "__main__":
    raise SystemExit(main())
