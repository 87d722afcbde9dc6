"""Prepare a flight for reconstruction: priors, corrections, segments with excitation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.arrays import Array, BoolArray
from host.constants import BLOCK_S
from host.errors import IdentificationError
from host.instrument.deviations import (
    SensorErrorModel,
    deviations,
    unknown_sensors,
    vane_delay_s,
)
from host.physical.recording import FOREIGN
from host.sysid.numerics.differentiation import local_polynomial
from host.sysid.reconstruction.flight_path import (
    AIR,
    DELAY_DIFFERENCE,
    DELAYS,
    FLOW,
    GPS,
    HEIGHT,
    INERTIAL,
    LEAST_SPEED_MPS,
    PITOT,
    PLACES,
    START,
    WITH_GPS,
    PathProblem,
    Segment,
)
from host.sysid.reconstruction.position_correction import transfer_to_cg
from host.sysid.reconstruction.strapdown import rotation, zeros_by_attitude

# Above this rate a vane slides; noise of its rate after the low-pass is about 0.015 rad/s.
SLIDING_RADPS = 0.02
SEGMENT_S = 12.0
SHORT_SEGMENT_S = 6.0  # without GPS nothing holds the path for longer
# Without GPS a tilt of the IMU, a bias of an accelerometer and the attitude look alike.
WITHOUT_GPS = (*INERTIAL[0:3], *FLOW, *DELAYS, DELAY_DIFFERENCE)
IMU = (*(f"{a}_radps" for a in "pqr"), *(f"a{a}_mps2" for a in "xyz"))
MOST_SEGMENTS = 8
LEAST_EXCITATION = 0.1  # of the most excited segment: initial value of each axis
# Three velocities each: fewer say no more than a segment's start, the wind and GPS's delay take.
FEWEST_FIXES = 1 + (len(START) + len(WITH_GPS)) // len(GPS)
QUADRANTS = 4  # of heading: wind and pitot scale need them
INPUT_LAGS = (*range(0, 10), *range(10, 31, 2))  # in blocks: duration of a response
START_SD = np.array([1.0, 1.0, 1.0, *np.radians([5.0, 5.0, 20.0])])
SURFACES = ("elevator_rad", "aileron_rad", "rudder_rad", "throttle")
SMOOTH_S = 0.03  # half a window for derivatives: 9 Hz at 100 Hz
SPEED_SMOOTH_S = 0.25  # half a window: one count of the pitot is 1.4 % of trim speed
SMOOTHED = "airspeed_mps smoothed"
NO_OFFSETS = AirframeData("nothing but places", 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0)
FLYING_SHARE = 0.5  # of the median airspeed
FIX_BEND_MPS = 1e-6
# Not in any calibration: deviation of the steady wind, mean and deviation of delays.
WIND_SD_MPS = 10.0
VANE_DELAY_S = (0.010, 0.010)
GPS_DELAY_S = (0.10, 0.08)


def prepare_path_problem(
    columns: Mapping[str, Array],
    airframe: AirframeData | None,
    instrument: SensorErrorModel | None,
    usual: SensorErrorModel | None = None,
) -> tuple[PathProblem, list[Array], tuple[tuple[float, float], ...]]:
    """Return the problem, the lagged inputs of every segment, and begin and end of each (s).

    GPS without a fix in any segment is no GPS: a flight may have it in the cruise alone.
    `usual` gives the priors of sensors of which no file speaks.

    Raises
    ------
    IdentificationError
        If inertial sensors or all air data are missing, or no part of the flight is long enough.
    """
    outputs = _outputs(columns)
    gps, vanes = GPS[0] in outputs, AIR[1] in outputs
    data, dt_s = _sensors_at_cg(columns, outputs, airframe, instrument)
    block = max(1, round(BLOCK_S / dt_s))
    cuts = _select_segments(data, dt_s, block, SEGMENT_S if gps else SHORT_SEGMENT_S)
    fixes = _fixes(data, gps, cuts)
    if gps and not fixes.any():
        if not vanes:
            raise IdentificationError(
                f"data compatibility: GPS has no fixes where the aircraft moved most, and without"
                f" it {AIR[1]} and {AIR[2]} are needed"
            )
        without = {name: values for name, values in columns.items() if name not in GPS}
        return prepare_path_problem(without, airframe, instrument, usual)
    vane_s_mps = _vane_s_mps(instrument)
    place_m = _vane_place_m(airframe)
    segments = [
        replace(_segment(data, cut, outputs, dt_s, block, vane_s_mps, fixes[cut]), vane_m=place_m)
        for cut in cuts
    ]
    start_sd = START_SD if gps else np.where(np.arange(len(START)) == 5, 1e-6, START_SD)
    priors = prior(instrument or usual, vanes=vanes)
    priors = {k: v for k, v in priors.items() if gps or k in WITHOUT_GPS}
    zeros = zip(INERTIAL[0:3], zeros_by_attitude(data, cuts, dt_s), strict=False)
    problem = PathProblem(segments, outputs, priors, start_sd, block, dict(zeros))
    t = data["t_s"]
    when = tuple((float(t[c.start]), float(t[c.stop - 1])) for c in cuts)
    return problem, [_lagged_inputs(columns, cut, block) for cut in cuts], when


def _fixes(data: Mapping[str, Array], gps: bool, cuts: Sequence[slice]) -> BoolArray:
    """Return which samples have a fix of GPS, in segments with enough of them."""
    result = np.zeros(len(data["t_s"]), dtype=bool)
    if gps:
        fixes = gps_fixes(data)
        for cut in cuts:
            result[cut] = fixes[cut] & (np.sum(fixes[cut]) >= FEWEST_FIXES)
    return result


def gps_fixes(data: Mapping[str, Array]) -> BoolArray:
    """Return which samples are GPS fixes: between them a decoded table is linear."""
    bend = sum(np.abs(np.diff(data[name], n=2)) for name in GPS)
    bend = np.concatenate([[0.0], bend, [0.0]])
    known = bend > FIX_BEND_MPS
    peak = (bend >= np.roll(bend, 1)) & (bend > np.roll(bend, -1))
    return np.asarray(known & peak)


def _outputs(columns: Mapping[str, Array]) -> tuple[str, ...]:
    """Return what tells the path; refuse a record without inertial sensors or air data.

    Without vanes GPS tells the path, and airspeed the wind.
    """
    gps = all(name in columns for name in GPS)
    vanes = all(name in columns for name in AIR[1:])
    needed = (*IMU, AIR[0], "t_s") if gps else (*IMU, *AIR, "t_s")
    missing = [c for c in needed if c not in columns]
    if missing:
        raise IdentificationError(f"data compatibility needs {', '.join(missing)}")
    height = (HEIGHT,) if HEIGHT in columns else ()
    return (*(AIR if vanes else AIR[:1]), *height, *(GPS if gps else ()))


def _sensors_at_cg(
    columns: Mapping[str, Array],
    outputs: tuple[str, ...],
    airframe: AirframeData | None,
    instrument: SensorErrorModel | None,
) -> tuple[dict[str, Array], float]:
    """Return what is used of a record, friction, filters and places of sensors taken out; its step.

    The airspeed behind local polynomials is kept as well.
    """
    wanted = {*IMU, *outputs, "t_s", "phi_rad", "theta_rad", "psi_rad", "density_kgpm3"}
    data = {k: v for k, v in columns.items() if k in wanted}
    dt_s = float(data["t_s"][1] - data["t_s"][0])
    if instrument is not None:
        vanes = [name for name in AIR[1:] if name in outputs]
        data |= {name: compensate_friction(data, name, instrument, dt_s) for name in vanes}
        data |= {name: compensate_lowpass(data[name], instrument, dt_s) for name in IMU}
    if airframe is not None:
        data = _at_cg(data, airframe, dt_s)
    half = max(2, round(SPEED_SMOOTH_S / dt_s))
    data[SMOOTHED] = local_polynomial(data[AIR[0]][:, None], 2 * half + 1, 2)[:, 0]
    return data, dt_s


def _vane_s_mps(instrument: SensorErrorModel | None) -> float:
    """Return the time constant of a vane times the airspeed, m; none where no file says it."""
    return 0.0 if instrument is None else 1.0 / (2.0 * np.pi * instrument.vane_hz_per_mps)


def _vane_place_m(airframe: AirframeData | None) -> tuple[float, float]:
    """Return how far the vanes are before the CG and below it, m; at the CG where nobody knows."""
    if airframe is None or not airframe.vanes_m:
        return 0.0, 0.0
    x, _, z = np.mean(airframe.vanes_m, axis=0)
    return float(x), float(z)


def vane_delay_by_file(i: SensorErrorModel, columns: Mapping[str, Array]) -> tuple[float, float]:
    """Return the vanes' delay by the aircraft file, 2 damping / omega, and its deviation, s."""
    omega = 2.0 * np.pi * i.vane_hz_per_mps * float(np.median(columns[AIR[0]]))
    nominal = 2.0 * i.vane_damping / omega
    return nominal, vane_delay_s(i, nominal)


def prior(
    instrument: SensorErrorModel | None, *, vanes: bool = True
) -> dict[str, tuple[float, float]]:
    """Return mean and standard deviation of every unknown before the flight."""
    i = instrument or unknown_sensors()
    e, sd = i.errors, deviations(i, NO_OFFSETS)
    kinds = (
        *("gyro_{}_bias_radps", "gyro_{}_scale", "accel_{}_bias_mps2", "accel_{}_scale"),
        "imu_tilt_{}_rad",
    )
    alike = [sd[kind.format(axis)] for kind in kinds for axis in "xyz"]
    result = {name: (0.0, own) for name, own in zip(INERTIAL, alike, strict=True)}
    known = {
        "alpha_scale": float(np.hypot(sd["alpha_scale"], i.upwash * sd["upwash_share"])),
        "alpha_zero_rad": sd["alpha_zero_rad"],
        "beta_scale": sd["beta_scale"],
        "beta_zero_rad": e["vane_zero_rad"].of_mean("beta_a", "beta_b"),
        "pitot_scale": float(np.hypot(sd["pitot_scale"], density_share(i))),
        "pitot_zero_pa": sd["pitot_zero_pa"],
    }
    flow = e["vane_flow_share"].mean
    expected = {FLOW[0]: flow, FLOW[2]: flow}
    result |= {name: (expected.get(name, 0.0), known[name]) for name in (*FLOW, *PITOT)}
    pitot = (i.pitot_lag_s, max(i.pitot_lag_s, sd["pitot_delay_s"]))
    result |= dict(zip(DELAYS, (VANE_DELAY_S, pitot), strict=True))
    # As two pairs differ: as the places of the vanes it turned up, up to five deviations of them.
    result[DELAY_DIFFERENCE] = (0.0, math.sqrt(2.0) * vane_delay_s(i, VANE_DELAY_S[0]))
    # Both were measured from the same point, so the position of the CG does not matter.
    place = float(np.hypot(sd["imu_x_m"], sd["vane_x_m"]))
    ahead = (e["vane_ahead_m"].mean, 0.0)
    result |= {name: (m, place) for name, m in zip(PLACES, ahead, strict=True)}
    wind = (0.0, WIND_SD_MPS)
    result |= dict(zip(WITH_GPS, (GPS_DELAY_S, wind, wind), strict=True))
    of_vanes = () if vanes else (*FLOW, DELAYS[0], DELAY_DIFFERENCE, *PLACES)
    return {n: (float(mean), float(own)) for n, (mean, own) in result.items() if n not in of_vanes}


def density_share(instrument: SensorErrorModel | None) -> float:
    """Return the relative standard deviation of density: instruments and a warm fuselage."""
    e = (instrument or unknown_sensors()).errors
    return float(np.hypot(e["density_share"].of_mean(), e["fuselage_heat_share"].of_mean()))


def compensate_friction(
    data: Mapping[str, Array], name: str, i: SensorErrorModel, dt_s: float
) -> Array:
    """Return a vane's angle (rad) with dry friction compensated, by the sign of its rate."""
    angle = data[name]
    window = 2 * max(2, round(SMOOTH_S / dt_s)) + 1
    moving = local_polynomial(angle[:, None], window, 2, derivative=1, dt_s=dt_s)[:, 0]
    speed_ratio = i.friction_speed_mps / np.maximum(data[AIR[0]], LEAST_SPEED_MPS)
    friction_rad = i.vane_friction_rad * np.minimum(speed_ratio, 3.0) ** 2
    return np.asarray(angle + friction_rad * np.tanh(moving / SLIDING_RADPS))


def compensate_lowpass(signal: Array, i: SensorErrorModel, dt_s: float) -> Array:
    """Return an inertial signal with low-pass and interpolation inverted to second order.

    Tables of others have neither: sharpened all the same, L_p and L_da would be 10 % too large
    where the air rolls.
    """
    if i.recording.maker == FOREIGN:
        return signal
    lost_s2 = 0.5 / (2.0 * np.pi * i.imu_bandwidth_hz) ** 2 + dt_s**2 / 12.0
    return np.asarray(signal - lost_s2 * np.gradient(np.gradient(signal, dt_s), dt_s))


def _at_cg(data: dict[str, Array], airframe: AirframeData, dt_s: float) -> dict[str, Array]:
    """Return data with accelerometers moved to the CG and vanes without upwash.

    Rates are smoothed for their derivative. The vanes' arms are part of the model instead, because
    the effect of a rotation on a vane has the vane's delay.
    """
    smooth = dict(data)
    window = 2 * max(2, round(SMOOTH_S / dt_s)) + 1
    for axis in "pqr":
        name = f"{axis}_radps"
        smooth[name] = local_polynomial(data[name][:, None], window, 2)[:, 0]
    at_cg = transfer_to_cg(smooth, replace(airframe, vanes_m=()))
    rates = {f"{axis}_radps": data[f"{axis}_radps"] for axis in "pqr"}
    if "alpha_rad" not in data:
        return {**at_cg, **rates}
    without_upwash = np.arctan(np.tan(data["alpha_rad"]) / (1.0 + airframe.upwash))
    return {**at_cg, **rates, "alpha_rad": without_upwash}


def _select_segments(
    data: Mapping[str, Array], dt_s: float, block: int, length_s: float
) -> list[slice]:
    """Return the segments with most excitation: one per quadrant of heading, then by axes."""
    samples = max(block, round(length_s / dt_s) // block * block)
    speed = np.nan_to_num(data["airspeed_mps"])
    flying = speed > max(FLYING_SHARE * float(np.median(speed)), LEAST_SPEED_MPS)
    candidates = [
        slice(k, k + samples)
        for k in range(0, len(speed) - samples + 1, samples)
        if flying[k : k + samples].all()
    ]
    if not candidates:
        raise IdentificationError(
            f"data compatibility: no {length_s:.0f} s of flight without interruption"
        )
    rates = np.stack([data[f"{a}_radps"] for a in "pqr"])
    # Each axis relative to its maximum: rolling is fast and does not inform the alpha vane.
    moving = np.array([np.var(rates[:, c], axis=1) for c in candidates])
    shares = moving / np.maximum(moving.max(axis=0), 1e-12)
    excitation = {c.start: share for c, share in zip(candidates, shares, strict=True)}
    selected: list[slice] = []
    if "psi_rad" in data:
        selected = _of_each_heading(data["psi_rad"], excitation, candidates)
    rest = [c for c in candidates if c not in selected]
    while rest and len(selected) < MOST_SEGMENTS:
        known = LEAST_EXCITATION + sum(
            (excitation[c.start] for c in selected), np.zeros(len(rates))
        )
        best = max(rest, key=lambda c: float(np.sum(np.log(known + excitation[c.start]))))
        selected.append(best)
        rest.remove(best)
    return sorted(selected, key=lambda c: c.start)


def _of_each_heading(
    psi_rad: Array, excitation: Mapping[int, Array], candidates: Sequence[slice]
) -> list[slice]:
    """Return the segment of each quadrant of heading with most excitation."""
    selected: list[slice] = []
    middle = np.array([np.median(psi_rad[c]) for c in candidates])
    for quadrant in range(QUADRANTS):
        low = 2.0 * np.pi * quadrant / QUADRANTS
        own = [
            c
            for c, psi in zip(candidates, np.mod(middle, 2.0 * np.pi), strict=True)
            if low <= psi < low + 2.0 * np.pi / QUADRANTS
        ]
        selected += sorted(own, key=lambda c: -float(np.sum(excitation[c.start])))[:1]
    return selected


def _lagged_inputs(columns: Mapping[str, Array], cut: slice, block: int) -> Array:
    """Return the control inputs at lags of whole blocks, (blocks, surfaces x lags)."""
    at = np.arange(cut.start, cut.stop)
    lagged = [
        columns[name][np.maximum(at - lag * block, 0)].reshape(-1, block).mean(axis=1)
        for name in SURFACES
        if name in columns
        for lag in INPUT_LAGS
    ]
    return np.column_stack(lagged) if lagged else np.zeros((len(at) // block, 0))


def _segment(
    data: Mapping[str, Array],
    cut: slice,
    outputs: tuple[str, ...],
    dt_s: float,
    block: int,
    vane_s_mps: float,
    fixes: BoolArray,
) -> Segment:
    gps = bool(fixes.any())
    zero = np.zeros(cut.stop - cut.start)
    measured = np.stack([data[name][cut].reshape(-1, block).mean(axis=1) for name in outputs])
    blocks = fixes.reshape(-1, block)
    first = np.arange(len(blocks)) * block + np.argmax(blocks, axis=1)
    at = np.where(blocks.any(axis=1), first, -1)
    for row, name in enumerate(outputs):
        if name in GPS:
            measured[row] = np.where(at < 0, measured[row], data[name][cut][at])
    # Without a compass or GPS heading is arbitrary, and nothing depends on it.
    angles = [
        float(data.get(f"{a}_rad", zero)[cut.start if f"{a}_rad" in data else 0])
        for a in ("phi", "theta", "psi")
    ]
    if not gps:
        angles[2] = 0.0
    attitude = rotation(*angles)
    speed, alpha, beta = (
        float(np.median(data[name][cut][:block])) if name in data else 0.0 for name in AIR
    )
    air_velocity = speed * np.array(
        [np.cos(alpha) * np.cos(beta), np.sin(beta), np.sin(alpha) * np.cos(beta)]
    )
    velocity = attitude @ air_velocity
    if gps:
        velocity = np.array([float(np.median(data[name][cut][:block])) for name in GPS])
    density = data.get("density_kgpm3", np.full(cut.stop, 1.225))
    return Segment(
        dt_s=dt_s,
        rates=np.column_stack([data[f"{a}_radps"][cut] for a in "pqr"]),
        force=np.column_stack([data[f"a{a}_mps2"][cut] for a in "xyz"]),
        density_kgpm3=float(np.mean(density[cut])),
        airspeed_mps=data[SMOOTHED][cut],
        measured=measured,
        attitude=attitude,
        velocity_mps=velocity,
        fixes=at.astype(np.int64),
        vane_s2=(vane_s_mps / float(np.median(data[AIR[0]][cut]))) ** 2,
    )
