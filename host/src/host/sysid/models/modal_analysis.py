"""Natural modes of a linear model and their uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from host.aircraft.mode_names import DUTCH_ROLL, LONGITUDINAL, ROLL, ROLL_SPIRAL, SPIRAL
from host.constants import NORMAL_95

if TYPE_CHECKING:
    from host.arrays import Array
    from host.sysid.models.fit_result import FitResult
    from host.sysid.models.state_space_model import LinearModel

PAIR, ROOT = "oscillatory mode", "real mode"  # where a mode has no name of its own
REAL_LIMIT = 1e-9  # relative imaginary part below which an eigenvalue is called real


@dataclass(frozen=True, slots=True)
class Mode:
    """One mode: a real eigenvalue or a conjugate pair.

    `frequency_radps` is the undamped natural frequency (the rate constant of a real mode),
    `damping` the damping ratio (-1 or +1 for a real mode); `_sd` are standard deviations. The
    covariance is of real and imaginary part.
    """

    name: str
    eigenvalue: complex
    covariance: Array
    frequency_radps: float
    frequency_sd_radps: float
    damping: float
    damping_sd: float

    @property
    def frequency_half_width_radps(self) -> float:
        """Half-width of the 95 % interval of the natural frequency or rate constant."""
        return NORMAL_95 * self.frequency_sd_radps

    @property
    def damping_half_width(self) -> float:
        """Half-width of the 95 % interval of the damping ratio."""
        return NORMAL_95 * self.damping_sd

    @property
    def oscillatory(self) -> bool:
        """Whether the mode is a conjugate pair."""
        return abs(self.eigenvalue.imag) > REAL_LIMIT * abs(self.eigenvalue)


def modes(result: FitResult, model: LinearModel | None = None) -> tuple[Mode, ...]:
    """Return the modes of a fitted model, fastest first, with first-order uncertainty.

    Parameters
    ----------
    result : FitResult
    model : LinearModel, optional
        With the same parameters about another condition.
    """
    model = model or result.model
    count = len(model.parameters)
    A = model.matrices(result.estimate[:count])[0]
    return modes_of(model, A, result.covariance[:count, :count])


def modes_of(model: LinearModel, A: Array, covariance: Array) -> tuple[Mode, ...]:
    """Return the modes of a system matrix whose parameters have the given covariance."""
    found = eigenmodes(A, [model.gradient("A", p.name) for p in model.parameters], covariance)
    names = _names(model, found)
    return tuple(replace(m, name=name) for name, m in zip(names, found, strict=True))


def eigenmodes(A: Array, derivatives: Sequence[Array], covariance: Array) -> list[Mode]:
    """Return the modes of a matrix without names, fastest first.

    Parameters
    ----------
    A : Array, shape (n, n)
        System matrix, 1/s.
    derivatives : sequence of Array, shape (n, n)
        Derivative of A by each unknown.
    covariance : Array, shape (unknowns, unknowns)

    Notes
    -----
    An eigenvalue moves by d lambda = w' dA v / (w' v), with the left and right eigenvectors w and v
    (Stevens & Lewis, Aircraft Control and Simulation, sec. 1.3).
    """
    values, right = np.linalg.eig(A)
    left = np.linalg.inv(right)
    found = []
    for k in range(len(values)):
        value = complex(values[k])
        if value.imag < -REAL_LIMIT * abs(value):
            continue
        gradient = np.array([left[k] @ derivative @ right[:, k] for derivative in derivatives])
        J = np.vstack([gradient.real, gradient.imag])
        found.append(mode_of("", value, J @ covariance @ J.T))
    return sorted(found, key=lambda mode: -mode.frequency_radps)


def mode_of(name: str, value: complex, covariance_re_im: Array) -> Mode:
    """Return the mode of an eigenvalue lambda.

    Frequency is |lambda| and damping ratio -Re lambda / |lambda| (Stevens & Lewis, Aircraft Control
    and Simulation, ch. 4); their deviations follow to first order from `covariance_re_im` (2, 2),
    that of real and imaginary part.
    """
    frequency = float(np.hypot(value.real, value.imag))
    if frequency == 0.0:
        return Mode(
            name, value, covariance_re_im, 0.0, float(np.sqrt(covariance_re_im[0, 0])), 0.0, 0.0
        )
    by_frequency = np.array([value.real, value.imag]) / frequency
    # zeta = -Re / |lambda|
    by_damping = np.array([-(value.imag**2), value.real * value.imag]) / frequency**3
    return Mode(
        name,
        value,
        covariance_re_im,
        float(frequency),
        float(np.sqrt(np.maximum(by_frequency @ covariance_re_im @ by_frequency, 0.0))),
        float(-value.real / frequency),
        float(np.sqrt(np.maximum(by_damping @ covariance_re_im @ by_damping, 0.0))),
    )


def longitudinal_names(oscillatory: Sequence[bool]) -> list[str]:
    """Return the names of longitudinal modes, fastest first, by whether each is a pair.

    The two fastest roots are the short period, the next two the phugoid; an overdamped mode is two
    real roots. A pair that has one root of each has no name of its own.
    """
    names, roots = [], 0
    for pair in oscillatory:
        label = LONGITUDINAL[0] if roots < 2 else LONGITUDINAL[1]
        if pair:
            names.append(PAIR if roots % 2 else label)
        else:
            names.append(f"root of the {label}")
        roots += 2 if pair else 1
    return names


def lateral_names(oscillatory: Sequence[bool], *, yaw: bool = True) -> list[str]:
    """Return the names of lateral modes, fastest first, by whether each is a pair.

    The fastest pair is the dutch roll, another one roll and spiral coupled; the fastest real root
    is the roll, the slowest the spiral. Without `yaw` that is the integration of roll rate to bank.
    """
    pairs = [k for k, pair in enumerate(oscillatory) if pair]
    single = [k for k, pair in enumerate(oscillatory) if not pair]
    names = [PAIR if pair else ROOT for pair in oscillatory]
    for k, name in zip(pairs, (DUTCH_ROLL, ROLL_SPIRAL), strict=False):
        names[k] = name
    if single:
        names[single[0]] = ROLL
    if len(single) > 1:
        names[single[-1]] = SPIRAL if yaw else "bank"
    return names


def _names(model: LinearModel, found: Sequence[Mode]) -> list[str]:
    """Return the names of modes, which depend on the states of their model."""
    pairs = [m.oscillatory for m in found]
    names = [PAIR if pair else ROOT for pair in pairs]
    if "q_radps" in model.states:
        return longitudinal_names(pairs)
    if "p_radps" in model.states:
        return lateral_names(pairs, yaw="r_radps" in model.states)
    if any(pairs) and "airspeed_mps" in model.states:
        names[pairs.index(True)] = LONGITUDINAL[1]
    elif any(pairs) and "r_radps" in model.states:
        names[pairs.index(True)] = DUTCH_ROLL
    return names
