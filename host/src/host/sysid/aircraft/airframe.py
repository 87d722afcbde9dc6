"""What identification must know of the airframe, and turning derivatives into coefficients.

Conversions are written at the trim of the maneuvers; the uncertainty of mass, inertia, dynamic
pressure and reference sizes is carried into the intervals beside that of the fit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from host.compiled import Array
from host.sysid.models.result import FitResult
from host.sysid.models.templates import Trim


@dataclass(frozen=True, slots=True)
class AirframeData:
    """Mass, inertia, reference sizes, sensor positions with their relative uncertainties.

    Positions are in metres from the CG, x forward, y right, z down; relative numbers are standard
    deviations. `upwash` is the share by which the vanes over-read. Arms reach from the nominal CG
    back to where a tail surface's control force acts; 0 is not known.
    """

    name: str
    mass_kg: float
    ixx_kgm2: float
    iyy_kgm2: float
    izz_kgm2: float
    ixz_kgm2: float
    wing_area_m2: float
    span_m: float
    chord_m: float
    mass_share: float = 0.01
    inertia_share: float = 0.05
    pressure_share: float = 0.02
    imu_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    vanes_m: tuple[tuple[float, float, float], ...] = ()
    upwash: float = 0.0
    upwash_share: float = 0.2
    elevator_arm_m: float = 0.0
    rudder_arm_m: float = 0.0
    arm_share: float = 0.06


@dataclass(frozen=True, slots=True)
class Coefficient:
    """A non-dimensional derivative: value, standard error of the fit alone, and in total."""

    name: str
    value: float
    fit_error: float
    total_error: float
    half_width: float


@dataclass(frozen=True, slots=True)
class CoefficientTable:
    """Coefficients of one kind of maneuver: ``longitudinal``, ``lateral`` or another template."""

    template: str
    method: str
    alpha_rad: float
    coefficients: tuple[Coefficient, ...]


@dataclass(frozen=True, slots=True)
class Condition:
    """Where a coefficient is taken: mean over the maneuvers."""

    airspeed_mps: float
    qbar_pa: float


@dataclass(frozen=True, slots=True)
class Moved:
    """An estimate (P,) with one deviation of a sensor's error in it, and its condition then.

    `airspeed_gain` and `qbar_gain` are over those of the answer.
    """

    error: str
    estimate: Array
    airspeed_gain: float
    qbar_gain: float


def coefficients(
    result: FitResult,
    airframe: AirframeData,
    condition: Condition,
    moved: Sequence[Moved] = (),
) -> tuple[Coefficient, ...]:
    """Convert dimensional derivatives of the templates to coefficients.

    Parameters
    ----------
    result : FitResult
        Of a model whose parameters carry the template names (Z_alpha, M_q, L_p ...).
    airframe : AirframeData
        Mass properties and sizes.
    condition : Condition
        Airspeed and dynamic pressure of the maneuvers.
    moved : sequence of Moved
        By errors of sensors.

    Returns
    -------
    tuple of Coefficient
        The interval adds mass, inertia, dynamic pressure, upwash and what moved it to the fit's
        own. Errors of pitot and vanes are what pressure and upwash allow for: the larger counts.
    """
    values = {name: k for k, name in enumerate(result.names)}
    known = np.array(
        [
            airframe.mass_kg,
            airframe.ixx_kgm2,
            airframe.iyy_kgm2,
            airframe.izz_kgm2,
            condition.qbar_pa,
            1.0,  # scale of the vanes
        ]
    )
    shares = np.array(
        [
            airframe.mass_share,
            airframe.inertia_share,
            airframe.inertia_share,
            airframe.inertia_share,
            airframe.pressure_share,
            airframe.upwash * airframe.upwash_share,
        ]
    )
    elsewhere = [
        (
            SHARED.get(m.error, OWN),
            _rules(airframe, condition.airspeed_mps * m.airspeed_gain),
            m.estimate,
            np.where(np.arange(len(known)) == QBAR, m.qbar_gain * known, known),
        )
        for m in moved
    ]
    quantile = result.half_width() / np.maximum(result.standard_error, 1e-300)
    found = []
    for name, rule in _rules(airframe, condition.airspeed_mps).items():
        used = [p for p in rule.uses if p in values]
        if rule.uses[0] not in values:
            continue

        def evaluate(
            theta: Array, numbers: Array, rule: _Rule = rule, used: list[str] = used
        ) -> float:
            return rule.formula({p: float(theta[values[p]]) for p in used}, numbers)

        value = evaluate(result.estimate, known)
        slope = np.zeros(len(result.names))
        for parameter in used:
            k = values[parameter]
            step = 1e-6 * max(abs(result.estimate[k]), 1e-3)
            up, down = result.estimate.copy(), result.estimate.copy()
            up[k] += step
            down[k] -= step
            slope[k] = (evaluate(up, known) - evaluate(down, known)) / (2.0 * step)
        fit_variance = float(slope @ result.covariance @ slope)
        parts = np.zeros(len(shares) + 1)
        for k, share in enumerate(shares):
            other = known.copy()
            other[k] *= 1.0 + 1e-4
            parts[k] = ((evaluate(result.estimate, other) - value) / 1e-4 * share) ** 2
        by_sensors = np.zeros(len(parts))
        for k, rules, estimate, numbers in elsewhere:
            by_sensors[k] += (evaluate(estimate, numbers, rules[name]) - value) ** 2
        extra = float(np.sum(np.maximum(parts, by_sensors)))
        main = values[rule.uses[0]]
        total = float(np.sqrt(fit_variance + extra))
        half = float(np.hypot(quantile[main] * np.sqrt(fit_variance), 1.96 * np.sqrt(extra)))
        found.append(Coefficient(name, value, float(np.sqrt(fit_variance)), total, half))
    return tuple(found)


@dataclass(frozen=True, slots=True)
class _Rule:
    uses: tuple[str, ...]
    formula: Callable[[dict[str, float], Array], float]


MASS, IXX, IYY, IZZ, QBAR, VANE, OWN = range(7)
SHARED = {"pitot_scale": QBAR, "pitot_zero_pa": QBAR, "alpha_scale": VANE, "beta_scale": VANE}


def _rules(airframe: AirframeData, speed: float) -> dict[str, _Rule]:
    """Return coefficient name to formula; numbers are mass, Ixx, Iyy, Izz, qbar, vane scale."""
    S, b, c = airframe.wing_area_m2, airframe.span_m, airframe.chord_m
    ixz = airframe.ixz_kgm2
    hat_q, hat_p = 2.0 * speed / c, 2.0 * speed / b
    rules: dict[str, _Rule] = {}

    def scale_of(label: str) -> float:
        return {"q": hat_q, "p": hat_p, "r": hat_p}.get(label, 1.0)

    def vane(label: str, numbers: Array) -> float:
        return float(numbers[VANE]) if label in ("alpha", "beta") else 1.0

    def force(name: str, parameter: str, label: str, sign: float, by_speed: float) -> None:
        rules[name] = _Rule(
            (parameter,),
            lambda v, n: (
                sign * n[MASS] * by_speed * v[parameter] / (n[QBAR] * S)
                * scale_of(label) * vane(label, n)
            ),
        )  # fmt: skip

    def moment(name: str, label: str, axis: str) -> None:
        main, other = (f"{axis}_{label}", ("N" if axis == "L" else "L") + f"_{label}")
        own = IXX if axis == "L" else IZZ
        rules[name] = _Rule(
            (main, other),
            lambda v, n: (
                (n[own] * v[main] - ixz * v.get(other, 0.0)) / (n[QBAR] * S * b)
                * scale_of(label) * vane(label, n)
            ),
        )  # fmt: skip

    def pitch(label: str) -> None:
        rules[f"Cm_{label}"] = _Rule(
            (f"M_{label}",),
            lambda v, n: (
                n[IYY] * v[f"M_{label}"] / (n[QBAR] * S * c) * scale_of(label) * vane(label, n)
            ),
        )

    for label in ("alpha", "q", "de"):
        force(f"CL_{label}", f"Z_{label}", label, -1.0, speed)
        pitch(label)
    for label in ("alpha", "de"):
        force(f"CD_{label}", f"D_{label}", label, -1.0, 1.0)
    for label in ("beta", "p", "r", "da", "dr"):
        force(f"CY_{label}", f"Y_{label}", label, 1.0, speed)
        moment(f"Cl_{label}", label, "L")
        moment(f"Cn_{label}", label, "N")
    return rules


def trim_of(columns: dict[str, Array]) -> tuple[Trim, Condition]:
    """Return trim and condition as means of a cut of a flight table."""
    mean = {name: float(np.mean(values)) for name, values in columns.items()}
    speed = mean["airspeed_mps"]
    qbar = mean.get("qbar_pa", 0.5 * mean.get("density_kgpm3", 1.225) * speed**2)
    return (
        Trim(speed, mean.get("alpha_rad", 0.0), mean.get("theta_rad", mean.get("alpha_rad", 0.0))),
        Condition(speed, qbar),
    )


def corrected(columns: dict[str, Array], airframe: AirframeData) -> dict[str, Array]:
    """Move vanes and accelerometers to the CG.

    A vane at r sees the air of the CG plus omega x r, and over-reads by the upwash; an
    accelerometer at r feels omega' x r + omega x (omega x r) more than the CG. The mean of the
    vanes is corrected for the mean of their positions: roll cancels between two tips.
    """
    result = dict(columns)
    still = np.zeros(len(columns["t_s"]))  # a record of one axis has not all rates
    rates = [columns.get(f"{a}_radps", still) for a in "pqr"]
    p, q, r = rates
    if airframe.vanes_m:
        x, y, z = np.mean(airframe.vanes_m, axis=0)
        speed = np.maximum(columns["airspeed_mps"], 1.0)
        if "alpha_rad" in columns:
            result["alpha_rad"] = (
                columns["alpha_rad"] / (1.0 + airframe.upwash) + (q * x - p * y) / speed
            )
        if "beta_rad" in columns:
            result["beta_rad"] = columns["beta_rad"] - (r * x - p * z) / speed
    if any(airframe.imu_m):
        x, y, z = airframe.imu_m
        dt_s = float(np.median(np.diff(columns["t_s"])))
        dp, dq, dr = (np.gradient(rate, dt_s) for rate in rates)
        felt = {
            "ax_mps2": dq * z - dr * y + q * (p * y - q * x) - r * (r * x - p * z),
            "ay_mps2": dr * x - dp * z + r * (q * z - r * y) - p * (p * y - q * x),
            "az_mps2": dp * y - dq * x + p * (r * x - p * z) - q * (q * z - r * y),
        }
        result |= {name: columns[name] - more for name, more in felt.items() if name in columns}
    return result
