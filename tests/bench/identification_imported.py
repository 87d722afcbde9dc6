"""Imported virtual flights beside a plain least-squares pipeline, as open PX4 projects have it.

The pipeline (ethz-asl data-driven-dynamics is of this kind): velocity of GPS turned by the attitude
gives the angles, without wind; forces and moments over dynamic pressure are regressed on angles,
rates and commands over the whole flight, the interval is the regression's own. Ours is `host
identify` of the same log. Logs are those a PX4 plane would have written.
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from host.aircraft.mass_properties import airframe_data
from host.sysid.flight.flight_tables import read_flight_columns
from host.sysid.numerics.differentiation import local_polynomial
from host.sysid.pipeline.aircraft_data import aircraft_data
from host.sysid.pipeline.surface_travel import with_surface_angles
from host.twin.flight.fly import fly
from host.twin.outcome.autopilot_logs import write_autopilot_log
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import load

import host

sys.path.insert(0, str(Path(__file__).parents[2] / "host"))
from studies.imported_logs import AIRCRAFT, MODELS, truth

FIRST_SEED, TURBULENCE_MPS = 430, 0.3
LEAST_SPEED_MPS = 10.0
SMOOTH_S = 0.05
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
        half = 1.96 * np.sqrt(variance * np.diag(inverse))
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


def main(flights: int = 3) -> int:
    """Print a row of each: median error, intervals that hold the truth, processor time."""
    card = load("demo")
    card = replace(card, air=replace(card.air, turbulence_mps=TURBULENCE_MPS))
    print(f"{flights} flights of the card demo in {TURBULENCE_MPS} m/s, as PX4 logs them")
    results: dict[str, list[tuple[float, bool, float]]] = {}
    for seed in range(FIRST_SEED, FIRST_SEED + flights):
        record = fly(card, seed=seed)
        data = air_data(record)
        true = truth(record, data)
        with tempfile.TemporaryDirectory() as folder:
            path = write_autopilot_log(
                "ulog", record, data, Path(folder) / "flight", airframe="conventional"
            )
            for name, by in (("plain least squares", least_squares), ("host identify", ours)):
                begin = time.process_time()
                told = by(path)
                took = time.process_time() - begin
                results.setdefault(name, []).extend(
                    (abs(told[n][0] / v - 1.0), abs(told[n][0] - v) <= told[n][1], took)
                    for n, v in true.items()
                )
    for name, rows in results.items():
        error, held, seconds = (np.array(x) for x in zip(*rows, strict=True))
        print(
            f"{name:22s} median error {100 * np.median(error):5.1f} %  held {held.sum():3d} of"
            f" {len(held)}  {np.median(seconds):5.1f} s"
        )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
