"""Imported flights by AeroID: output error of equations that its user writes.

    .venv/bin/python tests/bench/identification_aeroid.py flight.ulg ultrastick25e 300

AeroID takes one unbroken record and no maneuvers. Given all test points of an axis it did not end
within 550 s, so it is given the shortest stretch with a 3-2-1-1 of each surface: airspeed and
bank as measured inputs, surfaces behind the aircraft's servos, handbook values to start from. It
knows no free start states: they are parameters of a shift. Its intervals are its own standard
errors. With the side force in the fit it rests where the roll rate is a third of the measured one,
so that is left out. Processor time is limited; each axis is printed as it ends.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path

import aeroid
import numpy as np
from host.aircraft.mass_properties import AirframeData, airframe_data
from host.arrays import Array
from host.constants import GRAVITY_MPS2, NORMAL_95
from host.errors import IdentificationError
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.pipeline import ReadingOptions, aircraft_data, prepare, read_flight
from numpy.typing import NDArray

Float = NDArray[np.float64]
Intervals = dict[str, tuple[float, float]]
RATE_HZ = 50.0
BEFORE_S, BEHIND_S = 0.5, 1.5
LONGITUDINAL = {
    "CL_0": 0.3, "CL_alpha": 4.5, "CL_de": 0.3, "Cm_0": 0.05, "Cm_alpha": -1.0, "Cm_q": -10.0,
    "Cm_de": -1.0,
}  # fmt: skip
LATERAL = {
    "CY_beta": -0.3, "Cl_0": 0.001, "Cl_beta": -0.03, "Cl_p": -0.4,
    "Cl_r": 0.1, "Cl_da": 0.2, "Cn_0": 0.001, "Cn_beta": 0.06, "Cn_p": -0.01, "Cn_r": -0.07,
    "Cn_da": -0.01, "Cn_dr": -0.05,
}  # fmt: skip
LONGITUDINAL_INPUTS = ("elevator_rad", "qbar_pa", "airspeed_mps", "gravity_mps2")
LATERAL_INPUTS = (
    "aileron_rad", "rudder_rad", "qbar_pa", "airspeed_mps", "gravity_mps2", "trim_alpha_rad",
)  # fmt: skip


def by_aeroid(path: Path, aircraft: str, limit_s: int) -> tuple[Intervals, float]:
    """Return what a process of its own found within its processor time, and that time, s.

    An axis that AeroID refused, or did not end, is not in it.
    """
    command = [sys.executable, __file__, str(path), aircraft, str(limit_s)]
    done = subprocess.run(command, capture_output=True, text=True)
    found: Intervals = {}
    took_s = 0.0
    for line in done.stdout.splitlines():
        one = json.loads(line)
        found |= {n: (value, half) for n, (value, half) in one["intervals"].items()}
        took_s = one["took_s"]
    return found, took_s if done.returncode == 0 else float(limit_s)


def _print_axes(path: Path, aircraft: str) -> None:
    flight = prepare(read_flight(path, ReadingOptions(), aircraft_data(aircraft))).flight
    frame = airframe_data(aircraft)
    columns = dict(flight.corrected)
    columns["qbar_pa"] = 0.5 * columns["density_kgpm3"] * columns["airspeed_mps"] ** 2
    down = GRAVITY_MPS2 * np.cos(columns["theta_rad"])
    climb = np.arcsin(np.clip(-columns["v_down_mps"] / columns["airspeed_mps"], -1.0, 1.0))
    begin_s = time.process_time()
    for axes, inputs, outputs, start, bank in (
        (("elevator_rad",), LONGITUDINAL_INPUTS, ("q_radps", "az_mps2"), LONGITUDINAL, np.cos),
        (("aileron_rad", "rudder_rad"), LATERAL_INPUTS, ("p_radps", "r_radps"), LATERAL,
         np.sin),
    ):  # fmt: skip
        columns["gravity_mps2"] = down * bank(columns["phi_rad"])
        first, last = _stretch([_sharpest(flight.maneuvers, axis) for axis in axes])
        within = (columns["t_s"] >= first) & (columns["t_s"] <= last)
        trim_rad = float(np.nanmean((columns["theta_rad"] - climb)[within]))
        columns["trim_alpha_rad"] = np.full(len(climb), trim_rad)
        cut = _means(columns, (*inputs, *outputs), first, last)
        build = _longitudinal if axes == ("elevator_rad",) else _lateral
        try:
            intervals = _fitted(build(frame), cut, outputs, start)
        except (aeroid.IdentificationError, IdentificationError):
            intervals = {}
        took_s = time.process_time() - begin_s
        print(
            json.dumps({"intervals": intervals, "took_s": took_s, "stretch_s": last - first}),
            flush=True,
        )


def _sharpest(found: Sequence[DetectedManeuver], axis: str) -> list[DetectedManeuver]:
    """Return the 3-2-1-1s of an axis, all of its maneuvers if it has none."""
    mine = [m for m in found if m.axis == axis]
    return [m for m in mine if m.kind == "3-2-1-1"] or mine


def _stretch(by_axis: Sequence[Sequence[DetectedManeuver]]) -> tuple[float, float]:
    """Return the shortest stretch with one maneuver of each axis."""
    spans = [(min(m.start_s for m in one), max(m.end_s for m in one)) for one in product(*by_axis)]
    first, last = min(spans, key=lambda span: span[1] - span[0])
    return first - BEFORE_S, last + BEHIND_S


def _means(
    columns: Mapping[str, Array], names: Sequence[str], first: float, last: float
) -> dict[str, Float]:
    t = columns["t_s"]
    block = max(1, round(1.0 / (RATE_HZ * float(t[1] - t[0]))))
    at = np.flatnonzero((t >= first) & (t <= last))
    at = at[: len(at) // block * block]
    blocks = {n: columns[n][at].reshape(-1, block) for n in ("t_s", *names)}
    return {n: np.asarray(np.mean(v, axis=1), dtype=np.float64) for n, v in blocks.items()}


def _fitted(
    model: aeroid.Model,
    cut: Mapping[str, Float],
    outputs: Sequence[str],
    start: Mapping[str, float],
) -> Intervals:
    names = list(model.parameters)
    data = aeroid.FlightData(
        cut["t_s"] - cut["t_s"][0],
        {**{n: cut[n] for n in model.controls}, **{f"{y}_measured": cut[y] for y in outputs}},
    )
    weights = {f"{y}_measured": 1.0 / float(np.std(cut[y])) for y in outputs}
    result = aeroid.identify(
        model, data, names, weights=weights, x0=np.zeros(len(model.states)),
        simulate_options={"method": "RK45", "rtol": 1e-5, "atol": 1e-7, "max_step": 0.1},
    )  # fmt: skip
    return {n: (float(result.parameters[n]), NORMAL_95 * float(result.stderr[n])) for n in start}


def _longitudinal(a: AirframeData) -> aeroid.Model:
    """Return angle of attack and pitch rate with coefficients; bank and airspeed are measured."""

    def lift(x: Float, u: Float, p: Mapping[str, float]) -> float:
        coefficient = p["CL_0"] + p["CL_alpha"] * x[0] + p["CL_de"] * u[0]
        return float(u[1] * a.wing_area_m2 / a.mass_kg * coefficient)

    def at(xi: Float, p: Mapping[str, float]) -> Float:
        return np.asarray(xi + np.array([p["start_alpha"], p["start_q"]]))

    def dynamics(_t: float, xi: Float, u: Float, p: Mapping[str, float]) -> Float:
        x = at(xi, p)
        moment = p["Cm_0"] + p["Cm_alpha"] * x[0] + p["Cm_de"] * u[0]
        moment += p["Cm_q"] * x[1] * a.chord_m / (2.0 * u[2])
        turn = u[1] * a.wing_area_m2 * a.chord_m / a.iyy_kgm2 * moment
        return np.array([x[1] + (u[3] - lift(x, u, p)) / u[2], turn])

    def measurement(_t: float, xi: Float, u: Float, p: Mapping[str, float]) -> Float:
        x = at(xi, p)
        return np.array([x[1], -lift(x, u, p)])

    return aeroid.Model(
        states=("alpha", "q"), controls=LONGITUDINAL_INPUTS,
        parameters={**LONGITUDINAL, "start_alpha": 0.05, "start_q": 0.01},
        dynamics=dynamics, outputs=("q_radps_measured", "az_mps2_measured"),
        measurement=measurement,
    )  # fmt: skip


def _lateral(a: AirframeData) -> aeroid.Model:
    """Return sideslip, roll and yaw rate with coefficients; bank and airspeed are measured."""
    names = ("start_beta", "start_p", "start_r")

    def side(x: Float, u: Float, p: Mapping[str, float]) -> float:
        return float(u[2] * a.wing_area_m2 / a.mass_kg * p["CY_beta"] * x[0])

    def at(xi: Float, p: Mapping[str, float]) -> Float:
        return np.asarray(xi + np.array([p[n] for n in names]))

    def dynamics(_t: float, xi: Float, u: Float, p: Mapping[str, float]) -> Float:
        x = at(xi, p)
        hats = x * a.span_m / (2.0 * u[3])
        torque = u[2] * a.wing_area_m2 * a.span_m
        roll = p["Cl_0"] + p["Cl_beta"] * x[0] + p["Cl_p"] * hats[1] + p["Cl_r"] * hats[2]
        yaw = p["Cn_0"] + p["Cn_beta"] * x[0] + p["Cn_p"] * hats[1] + p["Cn_r"] * hats[2]
        roll += p["Cl_da"] * u[0]
        yaw += p["Cn_da"] * u[0] + p["Cn_dr"] * u[1]
        return np.array([
            (side(x, u, p) + u[4]) / u[3] - x[2] + x[1] * u[5],
            torque / a.ixx_kgm2 * roll,
            torque / a.izz_kgm2 * yaw,
        ])  # fmt: skip

    def measurement(_t: float, xi: Float, u: Float, p: Mapping[str, float]) -> Float:
        x = at(xi, p)
        return np.array([x[1], x[2]])

    return aeroid.Model(
        states=("beta", "p", "r"), controls=LATERAL_INPUTS,
        parameters={**LATERAL, **dict.fromkeys(names, 0.01)},
        dynamics=dynamics,
        outputs=("p_radps_measured", "r_radps_measured"),
        measurement=measurement,
    )  # fmt: skip


if __name__ == "__main__":
    limit_s = int(sys.argv[3])
    resource.setrlimit(resource.RLIMIT_CPU, (limit_s, limit_s))
    _print_axes(Path(sys.argv[1]), sys.argv[2])
