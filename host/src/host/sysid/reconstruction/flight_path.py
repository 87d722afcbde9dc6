"""Kinematic model of flight-path reconstruction, with exact first-order sensitivities.

Angular rates give the attitude, specific force and gravity the velocity. These kinematics contain
no aerodynamics, so that vanes, pitot, barometer and GPS must agree with them for any aircraft
(Klein & Morelli, Aircraft System Identification, ch. 10).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, IntArray
from host.sysid.numerics.simulator import Response
from host.sysid.reconstruction.strapdown import (
    cross,
    path_sensitivities,
    rotation_from_vector,
    rotation_slope,
    strapdown,
)

# Errors of the inertial sensors, in the order of their slopes.
INERTIAL = (
    *(f"gyro_{a}_bias_radps" for a in "xyz"),
    *(f"gyro_{a}_scale" for a in "xyz"),
    *(f"accel_{a}_bias_mps2" for a in "xyz"),
    *(f"accel_{a}_scale" for a in "xyz"),
    *(f"imu_tilt_{a}_rad" for a in "xyz"),
)
FLOW = ("alpha_scale", "alpha_zero_rad", "beta_scale", "beta_zero_rad")
PITOT = ("pitot_scale", "pitot_zero_pa")
DELAYS = ("vane_delay_s", "pitot_delay_s")
# Delay of the beta vanes behind the alpha vanes; half of it on either side of the vanes' delay.
DELAY_DIFFERENCE = "beta_delay_difference_s"
PLACES = ("vane_x_m", "vane_z_m")  # errors of the vanes' position from the IMU
WITH_GPS = ("gps_delay_s", "wind_north_mps", "wind_east_mps")
START = ("north_mps", "east_mps", "down_mps", "turn_north_rad", "turn_east_rad", "turn_down_rad")
AIR = ("airspeed_mps", "alpha_rad", "beta_rad")
GPS = ("v_north_mps", "v_east_mps", "v_down_mps")
HEIGHT = "altitude_m"
LEAST_SPEED_MPS = 1.0


@dataclass(frozen=True, slots=True)
class Segment:
    """A segment of flight on an even grid, at the CG.

    Attributes
    ----------
    dt_s : float
    rates, force : Array, shape (n, 3)
    density_kgpm3 : float
        Mean.
    airspeed_mps : Array, shape (n,)
        As measured, smoothed: a longitudinal gust changes the angle of a given velocity.
    measured : Array, shape (p, blocks)
        Means over blocks of samples.
    attitude : Array, shape (3, 3)
        First guess at the first sample, body to north-east-down.
    velocity_mps : Array, shape (3,)
        First guess at the first sample.
    fixes : IntArray, shape (blocks,)
        Sample of the GPS fix in a block, -1 where there is none.
    vane_s2 : float
        Inverse square of the vanes' natural frequency (rad/s); 0: a pure delay.
    vane_m : tuple of float
        Position of the vanes by the aircraft file, x and z from the CG, m.
    """

    dt_s: float
    rates: Array
    force: Array
    density_kgpm3: float
    airspeed_mps: Array
    measured: Array
    attitude: Array
    velocity_mps: Array
    fixes: IntArray
    vane_s2: float = 0.0
    vane_m: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class PathModel:
    """Name and outputs of the model, as the search needs them."""

    name: str
    outputs: tuple[str, ...]


class PathProblem:
    """Outputs of all segments as a function of sensor errors, wind and initial values.

    Parameters
    ----------
    segments : sequence of Segment
    outputs : tuple of str
        Some of `AIR`, `HEIGHT` and `GPS`, in the order of `Segment.measured`.
    prior : dict
        Mean and standard deviation of every common unknown; those not in it are not free.
    start_sd : Array, shape (6,)
        Standard deviations of the first guess of velocity, m/s, and attitude, rad.
    block : int
        Samples averaged to one.
    start : mapping, optional
        Where the search begins, of common unknowns that may be far from their mean.
    """

    def __init__(
        self,
        segments: Sequence[Segment],
        outputs: tuple[str, ...],
        prior: dict[str, tuple[float, float]],
        start_sd: Array,
        block: int,
        start: Mapping[str, float] | None = None,
    ) -> None:
        self.segments = tuple(segments)
        self.model = PathModel("flight path", outputs)
        self.block = block
        self._weights = np.full(block, 1.0 / block)
        self.common = tuple(prior)
        self._place = {name: k for k, name in enumerate(self.common)}
        places = np.array([self._place.get(n, -1) for n in (*INERTIAL, *WITH_GPS[1:])])
        # Bias, scale and tilt of gyro and accelerometer, in the order of `INERTIAL`.
        kinds = np.array([[0, 3, 12], [6, 9, 12]])
        self._inertial_place = places[kinds[:, None, :] + np.arange(3)[:, None]]
        self._wind_place = places[-2:]
        local = START + (("height_m",) if HEIGHT in outputs else ())
        names = list(self.common)
        self._index: list[IntArray] = []
        for number in range(1, len(self.segments) + 1):
            own = np.arange(len(names), len(names) + len(local))
            names += [f"{name}@{number}" for name in local]
            self._index.append(np.concatenate([np.arange(len(self.common)), own]))
        self.names = tuple(names)
        mean, sd = (np.array(column) for column in zip(*prior.values(), strict=True))
        own_sd = np.concatenate([start_sd, np.full(len(local) - len(START), np.inf)])
        count = len(self.segments)
        self.prior_mean = np.concatenate([mean, np.zeros(count * len(local))])
        self.start = self.prior_mean.copy()
        for name, value in (start or {}).items():
            self.start[self._place[name]] = value
        self.prior_precision = np.concatenate([sd**-2.0, np.tile(own_sd**-2.0, count)])
        self.lower = np.full(len(names), -np.inf)
        self.upper = np.full(len(names), np.inf)

    @property
    def samples(self) -> int:
        """Blocks of all segments together."""
        return sum(s.measured.shape[1] for s in self.segments)

    def counted(self, output: str) -> int:
        """Return the number of blocks of all segments in which an output was measured."""
        if output in GPS:
            return sum(int(np.sum(s.fixes >= 0)) for s in self.segments)
        return self.samples

    def columns(self, maneuver: int) -> IntArray:
        """Return which unknowns a segment depends on."""
        return self._index[maneuver]

    def measured(self, maneuver: int) -> Array:
        """Return the measured outputs of a segment, (p, blocks)."""
        return self.segments[maneuver].measured

    def respond(self, theta: Array) -> list[Response] | None:
        """Return outputs and sensitivities of all segments; None if one is not finite."""
        found = [self._one(s, theta[i]) for s, i in zip(self.segments, self._index, strict=True)]
        return found if all(np.isfinite(r.y).all() for r in found) else None

    def _value(self, local: Array, names: Sequence[str]) -> Array:
        return np.array([local[self._place[n]] if n in self._place else 0.0 for n in names])

    def _one(self, s: Segment, local: Array) -> Response:
        common = len(self.common)
        errors = self._value(local, INERTIAL)
        gyro_gain, accel_gain, tilt = 1.0 + errors[3:6], 1.0 + errors[9:12], errors[12:15]
        unaligned = (s.rates - errors[0:3]) / gyro_gain, (s.force - errors[6:9]) / accel_gain
        rates, force = (x + cross(tilt, x) for x in unaligned)
        own = local[common:]
        attitude = rotation_from_vector(own[3:6]) @ s.attitude
        C, v = strapdown(rates, force, attitude, s.velocity_mps + own[0:3], s.dt_s)
        step_s = self.block * s.dt_s
        air_velocity = v - np.append(self._value(local, WITH_GPS[1:]), 0.0)
        mean_C = self._mean(C)
        width = common + len(own)
        ground, fall, air = path_sensitivities(
            mean_C,
            self._mean(unaligned[0]),
            self._mean(unaligned[1]),
            np.einsum("nij,nj->ni", mean_C, self._mean(force)),
            self._mean(air_velocity),
            np.stack([gyro_gain, accel_gain]),
            self._inertial_place,
            self._wind_place,
            common,
            rotation_slope(own[3:6]),
            step_s,
            0.5 / self.block,  # the first block begins half a sample early
            width,
        )

        y, slopes = [], []
        if AIR[0] in self.model.outputs:
            flow = np.einsum("nij,ni->nj", C, air_velocity)
            for delayed, slope in self._air(s, local, flow, air, rates):
                y.append(delayed)
                slopes.append(slope)
        if HEIGHT in self.model.outputs:
            slope = -fall
            slope[:, -1] += 1.0
            y.append(self._mean(own[-1] - _integral(v[:, 2], s.dt_s)))
            slopes.append(slope)
        if GPS[0] in self.model.outputs:
            delay = self._value(local, WITH_GPS[:1])[0]
            for axis in range(3):
                # Between fixes the table interpolates GPS; only the fixes count.
                t = np.arange(len(v)) * s.dt_s
                delayed = np.interp(t - delay, t, v[:, axis])
                back = np.clip(np.arange(len(ground)) - round(delay / step_s), 0, len(ground) - 1)
                slope = ground[back, axis]
                self._add(slope, WITH_GPS[0], -np.gradient(delayed, s.dt_s)[s.fixes])
                slope[s.fixes < 0] = 0.0
                row = self.model.outputs.index(GPS[axis])
                y.append(np.where(s.fixes < 0, s.measured[row], delayed[s.fixes]))
                slopes.append(slope)
        return Response(np.stack(y), np.ascontiguousarray(np.stack(slopes)))

    def _air(
        self, s: Segment, local: Array, flow: Array, x: Array, rates: Array
    ) -> list[tuple[Array, Array]]:
        """Return airspeed, alpha and beta as the sensors read them, with sensitivities.

        The pitot reads V_m^2 = (1 + scale) V^2 + 2 zero / rho; a vane at (x, z) reads
        (1 + scale) (atan(w / u) - q x / u) + zero, or (1 + scale) (atan(v / u) + (r x - p z) / u) +
        zero, behind its dynamics (Klein & Morelli, Aircraft System Identification, ch. 10).
        """
        alpha_scale, alpha_zero, beta_scale, beta_zero = self._value(local, FLOW)
        scale, zero = self._value(local, PITOT)
        vane_delay, pitot_delay = self._value(local, DELAYS)
        (difference,) = self._value(local, (DELAY_DIFFERENCE,))
        # Angles refer to the measured airspeed, which has longitudinal gusts (3 % of speed) in it.
        least = LEAST_SPEED_MPS**2
        square_speed = np.maximum(s.airspeed_mps**2 - 2.0 * zero / s.density_kgpm3, least) / (
            1.0 + scale
        )
        u = np.sqrt(np.maximum(square_speed - flow[:, 1] ** 2 - flow[:, 2] ** 2, least))
        speed = np.maximum(np.linalg.norm(flow, axis=1), LEAST_SPEED_MPS)
        square = (1.0 + scale) * speed**2 + 2.0 * zero / s.density_kgpm3
        sensed = np.sqrt(np.maximum(square, least))
        result = []

        delayed, change = self._late(sensed, pitot_delay, s.dt_s)
        mean_flow, size = self._mean(flow), self._mean(sensed)
        slope = ((1.0 + scale) / size)[:, None] * np.einsum("ni,nik->nk", mean_flow, x)
        self._add(slope, "pitot_scale", self._mean(speed) ** 2 / (2.0 * size))
        self._add(slope, "pitot_zero_pa", 1.0 / (s.density_kgpm3 * size))
        self._add(slope, "pitot_delay_s", change)
        result.append((delayed, slope))
        arm_x, arm_z = self._value(local, PLACES) + s.vane_m
        by_x, by_z = rates[:, [1, 2]] * [-1.0, 1.0] / u[:, None], -rates[:, 0] / u
        for across, gain, offset, name, side in (
            (2, alpha_scale, alpha_zero, "alpha", -0.5),
            (1, beta_scale, beta_zero, "beta", 0.5),
        ):
            if f"{name}_rad" not in self.model.outputs:
                continue
            along = by_x[:, 2 - across]
            angle = np.arctan2(flow[:, across], u) + arm_x * along
            if across == 1:
                angle = angle + arm_z * by_z
            sensed = (1.0 + gain) * angle + offset
            # A vane is of second order: beyond its delay tau it has (tau^2/2 - 1/omega^2) s^2.
            delay_s = vane_delay + side * difference
            curvature_s2 = 0.5 * delay_s**2 - s.vane_s2 if s.vane_s2 else 0.0
            sensed = sensed + curvature_s2 * np.gradient(np.gradient(sensed, s.dt_s), s.dt_s)
            delayed, change = self._late(sensed, delay_s, s.dt_s)
            forward, sideways = self._mean(u), mean_flow[:, across]
            part = (1.0 + gain) / (forward**2 + sideways**2)
            in_plane = np.einsum("ni,nik->nk", mean_flow[:, 1:], x[:, 1:]) / forward[:, None]
            slope = part[:, None] * (forward[:, None] * x[:, across] + sideways[:, None] * in_plane)
            self._add(
                slope, "pitot_scale", 0.5 * part * sideways * self._mean(square_speed) / forward
            )
            self._add(slope, "pitot_zero_pa", part * sideways / (s.density_kgpm3 * forward))
            self._add(slope, f"{name}_scale", self._mean(angle))
            self._add(slope, f"{name}_zero_rad", np.ones(len(slope)))
            self._add(slope, "vane_x_m", (1.0 + gain) * self._mean(along))
            if across == 1:
                self._add(slope, "vane_z_m", (1.0 + gain) * self._mean(by_z))
            self._add(slope, "vane_delay_s", change)
            self._add(slope, DELAY_DIFFERENCE, side * change)
            result.append((delayed, slope))
        return result

    def _add(self, slope: Array, name: str, value: Array) -> None:
        if name in self._place:
            slope[:, self._place[name]] += value

    def _late(self, signal: Array, delay_s: float, dt_s: float) -> tuple[Array, Array]:
        """Return block means of a signal delayed by `delay_s`, and their derivative by it."""
        t = np.arange(len(signal)) * dt_s
        delayed = np.interp(t - delay_s, t, signal)
        rate = np.gradient(delayed, dt_s)
        return self._mean(delayed), -self._mean(rate)

    def _mean(self, signal: Array) -> Array:
        blocks = signal.reshape(-1, self.block, *signal.shape[1:])
        return np.asarray(np.einsum("nb...,b->n...", blocks, self._weights), dtype=np.float64)


def _integral(values: Array, dt_s: float) -> Array:
    """Integrate along the first axis from zero (trapezoid)."""
    result = np.zeros_like(values)
    np.cumsum(0.5 * dt_s * (values[1:] + values[:-1]), axis=0, out=result[1:])
    return result
