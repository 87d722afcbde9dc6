"""The IMU's tilt by the standstill before take-off, where the aircraft file says how it stands.

In flight nothing tells the tilt: all that an autopilot senses turns with its IMU, and every angle
of attack that no vane measured is off by it. At rest the accelerometer shows gravity: the pitch it
sees, less that of the aircraft on its wheels, is tilt + bias / g. GPS in turns
tells the bias.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.arrays import Array
from host.constants import GRAVITY_MPS2, NORMAL_95, POSTERIOR_PRIOR_RATIO
from host.sysid.reconstruction.reconstruction import Compatibility

TILT, BIAS = "imu_tilt_y_rad", "accel_x_bias_mps2"
LEAST_S = 0.5  # of a standstill; our own log may begin a second before the launch
STILL_RADPS, STILL_MPS2 = 0.03, 0.5  # motion about its mean: a hand's is ten times that
GRAVITY_SHARE = 0.05  # specific force within this of gravity's
GROUND_SPEED, STILL_MPS = ("v_north_mps", "v_east_mps"), 1.0  # of GPS, where there is one
FLYING_SHARE, LEAST_SPEED_MPS = 0.5, 5.0  # of the usual airspeed; below it a pitot at rest may read
LEVEL_RAD = np.radians(10.0)  # bank of an aircraft on its wheels
DOUBTED = 4.0  # deviations of what IMU and inclinometer allow: it did not stand on its wheels
NEEDED = ("t_s", *(f"{a}_radps" for a in "pqr"), *(f"a{a}_mps2" for a in "xyz"), "airspeed_mps")


def update_by_standstill(
    found: Compatibility, columns: Mapping[str, Array], airframe: AirframeData
) -> tuple[Compatibility, tuple[str, ...]]:
    """Update tilt about y and bias of the IMU by the standstill; also return notes.

    Parameters
    ----------
    found : Compatibility
        With tilt and bias as estimated from the flight.
    columns : mapping of (n,) Array
        SI on an even grid, as decoded.
    airframe : AirframeData
        With the pitch at which it stands and its deviation; without them `found` is unchanged.
    """
    sd = airframe.ground_pitch_sd_rad
    if not np.isfinite(sd):
        return found, ()
    still = standstill(columns)
    if still is None:
        why = f"no standstill of {LEAST_S:g} s before take-off: it does not tell the IMU's tilt"
        return found, (why,)
    along, across, down = (float(np.mean(columns[f"a{a}_mps2"][still])) for a in "xyz")
    seen_rad = float(np.arctan2(along, np.hypot(across, down)))
    tilt, bias = found[TILT], found[BIAS]
    # How the pitch that is seen goes with each, and one deviation of it by each.
    by = np.array([1.0, 1.0 / GRAVITY_MPS2])
    parts = by * [tilt.half_width, bias.half_width] / NORMAL_95
    off = seen_rad - airframe.ground_pitch_rad - float(by @ [tilt.value, bias.value])
    allowed = float(np.sqrt(sd**2 + parts @ parts))
    said = (
        f"standing before take-off the IMU sees a pitch of {np.degrees(seen_rad):.1f} deg, the"
        f" aircraft file says {np.degrees(airframe.ground_pitch_rad):.1f}"
    )
    if abs(np.arctan2(across, -down)) > LEVEL_RAD or abs(off) > DOUBTED * allowed:
        return found, (f"{said}: it did not stand on its wheels, or the file is wrong; not used",)
    gain = parts**2 / allowed**2
    changed = {}
    for one, share, slope in zip((tilt, bias), gain.tolist(), by.tolist(), strict=True):
        half = one.half_width * float(np.sqrt(1.0 - share))
        data_informed = one.data_informed or half < POSTERIOR_PRIOR_RATIO * one.prior_half_width
        changed[one.name] = replace(
            one,
            value=one.value + share * off / slope,
            half_width=half,
            data_informed=data_informed,
            reason="" if data_informed else one.reason,
        )
    updated = replace(found, findings=tuple(changed.get(f.name, f) for f in found.findings))
    within, known = np.degrees(NORMAL_95 * sd), np.degrees(changed[TILT].half_width)
    return updated, (f"{said} +- {within:.1f}: its tilt is known to {known:.1f} deg (95 %)",)


def standstill(columns: Mapping[str, Array]) -> slice | None:
    """Return the last time before take-off that the aircraft stood still, or None.

    Parameters
    ----------
    columns : mapping of (n,) Array
        SI on an even grid.
    """
    if any(name not in columns for name in NEEDED):
        return None
    t, speed = columns["t_s"], np.nan_to_num(columns["airspeed_mps"])
    flying = speed > max(FLYING_SHARE * float(np.median(speed)), LEAST_SPEED_MPS)
    ground = int(np.argmax(flying)) if flying.any() else len(t)
    count = max(round(LEAST_S / float(t[1] - t[0])), 2)
    rates, force = (np.column_stack([columns[n] for n in NEEDED[k : k + 3]]) for k in (1, 4))
    rolling = np.hypot(*(columns.get(name, np.zeros(len(t))) for name in GROUND_SPEED))
    # The moment of the launch is no standstill: the last one ends its own length before it.
    for begin in range(ground - 2 * count, -1, -max(count // 4, 1)):
        cut = slice(begin, begin + count)
        size = float(np.linalg.norm(force[cut].mean(axis=0)))
        if (
            np.abs(rates[cut] - rates[cut].mean(axis=0)).max() < STILL_RADPS
            and np.std(force[cut], axis=0).max() < STILL_MPS2
            and abs(size / GRAVITY_MPS2 - 1.0) < GRAVITY_SHARE
            and float(np.median(rolling[cut])) < STILL_MPS
        ):
            return cut
    return None
