"""The delay of each sensor on one flight: the nominal one of its kind and the drawn error."""

from __future__ import annotations

import math

from host.aircraft.file import Aircraft
from host.twin.faults import PITOTS, VANES
from host.twin.flight.draws import Draws, delay_s

# DLPF_CFG of the MPU-6000: bandwidth Hz and delay s of gyro and accelerometer (register map).
FILTERS = {
    2: ((98.0, 2.8e-3), (94.0, 3.0e-3)),
    3: ((42.0, 4.8e-3), (44.0, 4.9e-3)),
    4: ((20.0, 8.3e-3), (21.0, 8.5e-3)),
}
GPS_LATENCY_S = 0.15  # u-blox 6 without PPS: 50 to 200 ms; +-20 % drawn


def dlpf_for(rate_hz: float) -> int:
    """Return the IMU's low-pass setting that goes with a logging rate."""
    return 2 if rate_hz > 100.0 else 3


def nominal_vane_s(aircraft: Aircraft) -> float:
    """Return 2 damping / omega of a vane at the aircraft's trim airspeed."""
    turns_per_s = aircraft.scalar("sensors.vane_frequency_hz_per_mps") * aircraft.scalar(
        "trim.airspeed_mps"
    )
    return 2.0 * aircraft.scalar("sensors.vane_damping") / (2.0 * math.pi * turns_per_s)


def sensor_delays(aircraft: Aircraft, draws: Draws, dlpf: int) -> dict[str, float]:
    """Return the delay (s) of every sensor on this flight, for slow signals.

    Parameters
    ----------
    aircraft : Aircraft
    draws : Draws
    dlpf : int
        DLPF_CFG of the IMU, a key of `FILTERS`.

    Returns
    -------
    dict
        ``gyro``, ``accelerometer`` (the low-pass), ``alpha_a`` ... ``beta_b`` (at trim airspeed,
        else in inverse proportion to airspeed), ``dp_a``, ``dp_b``, ``gps``.
    """
    found = {}
    for name, (_, nominal_s) in zip(("gyro", "accelerometer"), FILTERS[dlpf], strict=True):
        found[name] = delay_s(
            nominal_s,
            draws.scalar("imu_delay_share"),
            draws.scalar("imu_delay_s"),
            draws.errors,
        )
    for kind, names, nominal_s in (
        ("vane", VANES, nominal_vane_s(aircraft)),
        ("pitot", PITOTS, aircraft.scalar("sensors.pitot_lag_s")),
    ):
        shares, least = draws.vector(f"{kind}_delay_share"), draws.vector(f"{kind}_delay_s")
        for name, share, least_s in zip(names, shares, least, strict=True):
            found[name] = delay_s(nominal_s, float(share), float(least_s), draws.errors)
    found["gps"] = GPS_LATENCY_S * (1.0 + draws.scalar("gps_delay_share"))
    return found
