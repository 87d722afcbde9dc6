"""Filter error against output error in Dryden turbulence, open loop and with a pilot correcting.

Vertical gusts reach the linear NAVION through the angle of attack; the model of the fit carries the
gust as a state of its own, its entries tied to those of alpha, so that only its intensity is new.
Dryden vertical spectrum (MIL-F-8785C) as its first-order form of equal variance and scale.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from host.compiled import Array, BoolArray
from host.sysid.errors import IdentificationError
from host.sysid.fit import fit
from host.sysid.maneuver import Maneuver
from host.sysid.model import LinearModel, Term
from host.sysid.study.aircraft import FOOT_M, SPEED_FTPS, navion, navion_structured
from host.sysid.study.data import TRUTH, clean

SPEED_MPS = SPEED_FTPS * FOOT_M
SCALE_M = 150.0  # of vertical gusts at the height of a light aircraft's test, m
SENSOR_SHARE = 0.02  # noise over rms of each clean signal
FINE = 4  # integration steps per sample
PILOT_GAIN = (0.15, 0.05)  # elevator per theta and q: a pilot who holds the attitude


def gusty(seed: int, dt_s: float, *, intensity_mps: float = 0.5, pilot: bool = False) -> Maneuver:
    """Return one flight of the NAVION through gusts.

    Parameters
    ----------
    seed : int
        Of gust and sensor noise.
    dt_s : float
        Sample period, s.
    intensity_mps : float
        Standard deviation of the vertical gust, m/s.
    pilot : bool
        Whether attitude and rate feed back to the elevator on top of the test input.
    """
    u, y = clean(dt_s)
    A, B = navion()
    rng = np.random.default_rng([20260401, seed])
    rate = SPEED_MPS / SCALE_M
    wide = np.zeros((5, 5))
    wide[:4, :4] = A
    wide[:3, 4] = A[:3, 1]  # a gust is an angle of attack to the forces and moments
    wide[4, 4] = -rate
    step = dt_s / FINE
    push = np.vstack([B, [[0.0]]])
    block = linalg.expm(np.block([[wide, push], [np.zeros((1, 6))]]) * step)
    F, G = block[:5, :5], block[:5, 5]
    sigma = intensity_mps / SPEED_MPS
    kick = sigma * np.sqrt(1.0 - np.exp(-2.0 * rate * step))
    x = np.zeros(5)
    x[4] = sigma * rng.standard_normal()
    states, inputs = np.zeros_like(y), u.copy()
    for k in range(len(u)):
        if pilot:
            inputs[k, 0] += PILOT_GAIN[0] * x[3] + PILOT_GAIN[1] * x[2]
        states[k] = x[:4]
        states[k, 1] += x[4]  # the vane sees the gust
        for _ in range(FINE):
            x = F @ x + G * inputs[k, 0]
            x[4] += kick * rng.standard_normal()
    deviation = SENSOR_SHARE * np.sqrt(np.mean(y**2, axis=0))
    return Maneuver(
        dt_s, inputs, states + deviation * rng.standard_normal(y.shape), name=f"gusts, seed {seed}"
    )


def gust_model() -> LinearModel:
    """Return the structured NAVION with the gust angle as fifth state."""
    base = navion_structured()
    A = np.zeros((5, 5))
    A[:4, :4] = base.A
    A[4, 4] = -SPEED_MPS / SCALE_M
    C = np.zeros((4, 5))
    C[:, :4] = base.C
    C[1, 4] = 1.0
    extra = tuple(
        Term("A", t.row, 4, t.parameter) for t in base.terms if t.matrix == "A" and t.column == 1
    )
    return replace(
        base,
        name="NAVION with gust",
        states=(*base.states, "gust_rad"),
        A=A,
        B=np.vstack([base.B, np.zeros((1, 1))]),
        C=C,
        terms=(*base.terms, *extra),
        initial_states=(*base.initial_states, "gust_rad"),
    )


@dataclass(frozen=True)
class GustCase:
    """Both methods over many flights of one case."""

    intensity_mps: float
    pilot: bool
    names: tuple[str, ...]
    failed: int
    filter_rms: Array
    output_rms: Array
    filter_mean: Array
    filter_covered: float
    output_covered: float


SHOWN = ("Z_alpha", "M_alpha", "M_q", "M_de")


def run_case(intensity_mps: float, flights: int, *, pilot: bool, dt_s: float = 0.02) -> GustCase:
    """Run one case; errors are relative to the truth."""
    model, plain = gust_model(), navion_structured()
    picked = [[p.name for p in plain.parameters].index(name) for name in SHOWN]
    errors: tuple[list[Array], list[Array]] = ([], [])
    covered: tuple[list[BoolArray], list[BoolArray]] = ([], [])
    failed = 0
    for seed in range(flights):
        maneuver = gusty(seed, dt_s, intensity_mps=intensity_mps, pilot=pilot)
        try:
            start = fit("output-error-white", plain, [maneuver])
            first = np.concatenate([start.estimate, [0.0]])
            ours = fit("filter-error", model, [maneuver], process=("gust_rad",), start=first)
        except IdentificationError:
            failed += 1
            continue
        for k, result in enumerate((ours, start)):
            miss = (result.estimate[:9] - TRUTH)[picked]
            errors[k].append(miss / np.abs(TRUTH[picked]))
            covered[k].append(np.abs(miss) <= result.half_width()[:9][picked])
    return GustCase(
        intensity_mps,
        pilot,
        SHOWN,
        failed,
        np.sqrt(np.mean(np.square(errors[0]), axis=0)),
        np.sqrt(np.mean(np.square(errors[1]), axis=0)),
        np.mean(errors[0], axis=0),
        float(np.mean(covered[0])),
        float(np.mean(covered[1])),
    )


def main(arguments: list[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=20)
    options = parser.parse_args(arguments)
    for intensity in (0.5, 1.0):
        for pilot in (False, True):
            case = run_case(intensity, options.flights, pilot=pilot)
            cells = "  ".join(
                f"{name} {100.0 * a:5.2f} against {100.0 * b:5.2f} (mean {100.0 * m:+.2f})"
                for name, a, b, m in zip(
                    case.names, case.filter_rms, case.output_rms, case.filter_mean, strict=True
                )
            )
            sys.stdout.write(
                f"{intensity} m/s {'pilot' if pilot else 'open loop':9s} failed {case.failed}"
                f"  rms error %: {cells}  coverage {100.0 * case.filter_covered:.1f} %"
                f" against {100.0 * case.output_covered:.1f} %\n"
            )
            sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
