"""Natural modes of a model with the uncertainty of its parameters carried through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.sysid.models.model import LinearModel
from host.sysid.models.result import NORMAL_95, FitResult

REAL = 1e-9  # relative imaginary part below which an eigenvalue is called real


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
        return abs(self.eigenvalue.imag) > REAL * abs(self.eigenvalue)


def modes(result: FitResult) -> tuple[Mode, ...]:
    """Return the modes of a fitted model, fastest first.

    Uncertainty is first order: d lambda = w' dA v / (w' v) with the left and right eigenvectors.
    """
    model = result.model
    A = result.matrices()[0]
    count = len(model.parameters)
    covariance = result.covariance[:count, :count]
    return modes_of(model, A, covariance)


def modes_of(model: LinearModel, A: Array, covariance: Array) -> tuple[Mode, ...]:
    """Return the modes of a system matrix whose parameters have the given covariance."""
    values, right = np.linalg.eig(A)
    left = np.linalg.inv(right)
    slopes = [model.gradient("A", p.name) for p in model.parameters]
    found = []
    for k in range(len(values)):
        value = complex(values[k])
        if value.imag < -REAL * abs(value):
            continue
        gradient = np.array([left[k] @ slope @ right[:, k] for slope in slopes])
        J = np.vstack([gradient.real, gradient.imag])
        spread = J @ covariance @ J.T
        found.append(mode_of("", value, spread))
    found.sort(key=lambda mode: -mode.frequency_radps)
    names = _names(model, found)
    return tuple(
        Mode(
            name,
            m.eigenvalue,
            m.covariance,
            m.frequency_radps,
            m.frequency_sd_radps,
            m.damping,
            m.damping_sd,
        )
        for name, m in zip(names, found, strict=True)
    )


def mode_of(name: str, value: complex, spread: Array) -> Mode:
    """Return the mode of an eigenvalue; `spread` (2, 2) is of its real and imaginary part."""
    frequency = float(np.hypot(value.real, value.imag))
    if frequency == 0.0:
        return Mode(name, value, spread, 0.0, float(np.sqrt(spread[0, 0])), 0.0, 0.0)
    by_frequency = np.array([value.real, value.imag]) / frequency
    # zeta = -Re / |lambda|
    by_damping = np.array([-(value.imag**2), value.real * value.imag]) / frequency**3
    return Mode(
        name,
        value,
        spread,
        float(frequency),
        float(np.sqrt(np.maximum(by_frequency @ spread @ by_frequency, 0.0))),
        float(-value.real / frequency),
        float(np.sqrt(np.maximum(by_damping @ spread @ by_damping, 0.0))),
    )


def longitudinal_names(oscillatory: Sequence[bool]) -> list[str]:
    """Return the names of longitudinal modes, fastest first, by whether each is a pair.

    The two fastest roots are the short period, the next two the phugoid; one that is damped beyond
    swinging is two real roots. A pair of one of each has no name of its own.
    """
    names, roots = [], 0
    for pair in oscillatory:
        label = "short period" if roots < 2 else "phugoid"
        if pair:
            names.append("oscillatory mode" if roots % 2 else label)
        else:
            names.append(f"root of the {label}")
        roots += 2 if pair else 1
    return names


def _names(model: LinearModel, found: list[Mode]) -> list[str]:
    pairs = [m for m in found if m.oscillatory]
    single = [m for m in found if not m.oscillatory]
    names: dict[int, str] = {}
    if "q_radps" in model.states:
        return longitudinal_names([m.oscillatory for m in found])
    if "airspeed_mps" in model.states and pairs:
        names[id(pairs[0])] = "phugoid"
    elif "r_radps" in model.states or "p_radps" in model.states:
        if pairs:
            names[id(pairs[0])] = "dutch roll"
        if "p_radps" in model.states and single:
            names[id(single[0])] = "roll"
            if len(single) > 1:
                # Without yaw the second root is the integration of roll rate to bank.
                names[id(single[-1])] = "spiral" if "r_radps" in model.states else "bank"
    return [names.get(id(m), "oscillatory mode" if m.oscillatory else "real mode") for m in found]
