"""What the loop drives: servo, delay, aircraft and gyro filter, sampled at the autopilot's rate."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.control.margins import Spectra

RATES = {"roll": "p_radps", "pitch": "q_radps"}
ANGLES = {"roll": "phi_rad", "pitch": "theta_rad"}


@dataclass(frozen=True, slots=True)
class Plant:
    """A sampled linear system from shares of travel to measured angles (rad) and rates (rad/s)."""

    a: Array
    b: Array
    c: Array
    period_s: float

    def response(self, frequency_radps: Array) -> Spectra:
        """Return angle and rate per unit of the one output at each frequency, shape (F, 2)."""
        return self.transfer(frequency_radps)[..., 0]

    def transfer(self, frequency_radps: Array) -> Spectra:
        """Return what is measured per unit of each output, shape (F, measured, outputs)."""
        z = np.exp(1j * frequency_radps * self.period_s)
        left = z[:, None, None] * np.eye(len(self.a)) - self.a
        columns = np.broadcast_to(self.b.astype(complex), (len(z), *self.b.shape))
        return np.asarray(self.c @ np.linalg.solve(left, columns))


def continuous(
    axis: str,
    dynamics: tuple[Array, Array, tuple[str, ...]],
    travel_rad: float,
    bandwidth_hz: float,
    gyro_filter_hz: float,
    sense: float,
) -> tuple[Array, Array, Array]:
    """Return A, B, C from share of travel to angle and filtered rate.

    States are the aircraft's, the angle where the model has none, the surface and the filter's two.
    A surface angle counts positive as the aircraft's signs have it. `sense` is 1 or -1, that of the
    surface's moment as it was estimated: so the output is connected that every gain is positive.
    An aircraft with the other sign is fed back wrongly.
    """
    a, b, states = dynamics
    n = len(states)
    rate, angle = states.index(RATES[axis]), ANGLES[axis]
    own = angle not in states
    total = n + own + 3
    at_angle = n if own else states.index(angle)
    surface, low, slope = total - 3, total - 2, total - 1
    full = np.zeros((total, total))
    full[:n, :n] = a
    full[:n, surface] = b[:, 0] * sense
    if own:
        full[at_angle, rate] = 1.0
    lag = 2.0 * math.pi * bandwidth_hz
    full[surface, surface] = -lag
    corner = 2.0 * math.pi * gyro_filter_hz  # Butterworth's second order
    full[low, slope] = 1.0
    full[slope, [rate, low, slope]] = corner**2, -(corner**2), -math.sqrt(2.0) * corner
    into = np.zeros((total, 1))
    into[surface] = lag * travel_rad
    out = np.zeros((2, total))
    out[0, at_angle] = 1.0
    out[1, low] = 1.0
    return full, into, out


def sampled(system: tuple[Array, Array, Array], delay_s: float, period_s: float) -> Plant:
    """Return a system behind held outputs and one delay of all of them, exactly.

    A delay between two samples splits the held input (Astrom & Wittenmark, Computer-Controlled
    Systems, 3rd ed., section 2.6).
    """
    from scipy.linalg import expm

    a, b, c = system
    n, m = b.shape
    whole = int(delay_s / period_s)
    late = delay_s - whole * period_s

    def held(span_s: float) -> tuple[Array, Array]:
        joint = np.zeros((n + m, n + m))
        joint[:n, :n], joint[:n, n:] = a * span_s, b * span_s
        e = expm(joint)
        return e[:n, :n], e[:n, n:]

    after, new = held(period_s - late)
    _, old = held(late)
    transition, _ = held(period_s)
    # Past outputs u[k-1] ... u[k-whole-1] are states.
    size = n + m * (whole + 1)
    full, into = np.zeros((size, size)), np.zeros((size, m))
    full[:n, :n] = transition
    full[:n, size - m :] = after @ old
    if whole:
        full[:n, size - 2 * m : size - m] = new
    else:
        into[:n] = new
    into[n : n + m] = np.eye(m)
    full[n + m :, n : size - m] = np.eye(m * whole)
    out = np.zeros((c.shape[0], size))
    out[:, :n] = c
    return Plant(full, into, out, period_s)
