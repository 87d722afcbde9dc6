"""The attitude filter of the firmware, compiled for this computer."""

from __future__ import annotations

import ctypes
import os
import subprocess
from dataclasses import astuple, dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = ROOT / "build" / "attitude" / "libattitude.so"
SOURCES = (
    "tests/attitude/attitude_library.cpp",
    "firmware/core/imu/attitude.cpp",
    "firmware/core/imu/fixed_point.cpp",
    "firmware/core/imu/rest_detector.cpp",
)
FLAGS = ("-std=gnu++14", "-O2", "-fPIC", "-shared", "-Wall", "-Wextra", "-Wconversion", "-Werror")
CDEG_RAD = np.deg2rad(0.01)


@dataclass(frozen=True, slots=True)
class Settings:
    """`core::AttitudeSettings`; the defaults are the firmware's."""

    declination_cdeg: int = 413
    filter_delay_us: int = 2800
    tilt_gain_permille: int = 80
    heading_gain_permille: int = 300
    bias_gain_ppm: int = 1000


@dataclass(frozen=True, slots=True)
class Estimate:
    """Angles (n, 3) in rad, gyro bias (n, 3) in rad/s, validity (n,)."""

    angles_rad: NDArray[np.float64]
    bias_radps: NDArray[np.float64]
    valid: NDArray[np.bool_]


@cache
def library() -> ctypes.CDLL:
    """Compile and load; a process compiles at most once."""
    LIBRARY.parent.mkdir(parents=True, exist_ok=True)
    part = LIBRARY.with_suffix(f".{os.getpid()}")
    compiler = os.environ.get("CXX", "c++")
    subprocess.run(
        [compiler, *FLAGS, "-Ifirmware", "-Iprotocol", "-o", str(part), *SOURCES],
        cwd=ROOT,
        check=True,
    )
    part.replace(LIBRARY)
    return ctypes.CDLL(str(LIBRARY))


def run(
    rates: NDArray[np.int16],
    force: NDArray[np.int16],
    *,
    speed_cmps: NDArray[np.uint16],
    field: NDArray[np.int16],
    dt_us: int = 5000,
    settings: Settings | None = None,
) -> Estimate:
    """Run the filter over samples.

    Parameters
    ----------
    rates, force : (n, 3) int16 arrays
        65.5 LSB per deg/s, 8192 LSB per g.
    speed_cmps : (n,) uint16 array
        cm/s where a speed arrives, else 0.
    field : (n, 3) int16 array
        Where the magnetometer is read, else 0.
    dt_us : int
        Between two samples.
    settings : Settings, optional

    Returns
    -------
    Estimate
    """
    count = len(rates)
    chosen = np.array(astuple(settings or Settings()), dtype=np.int16)
    angles, biases = np.empty((count, 3), np.int16), np.empty((count, 3), np.int16)
    valid = np.empty(count, np.uint8)
    arrays = [np.ascontiguousarray(a, np.int16) for a in (rates, force)]
    speed = np.ascontiguousarray(speed_cmps, np.uint16)
    seen = np.ascontiguousarray(field, np.int16)
    buffers: list[NDArray[np.generic]] = [*arrays, speed, seen, angles, biases, valid]
    library().run_attitude(
        chosen.ctypes.data_as(ctypes.c_void_p),
        ctypes.c_uint32(count),
        ctypes.c_uint32(dt_us),
        *(buffer.ctypes.data_as(ctypes.c_void_p) for buffer in buffers),
    )
    return Estimate(angles * CDEG_RAD, biases * np.deg2rad(1.0 / 65.5), valid != 0)
