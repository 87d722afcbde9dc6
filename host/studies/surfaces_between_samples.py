"""Tables of others: do intervals hold however surfaces moved between their samples?

A lateral aircraft in calm air, its surfaces behind servos of first order, held from sample to
sample, or on lines between samples, written at 100, 50 and 25 Hz. Identified as a table of others
without an aircraft file. One row a derivative goes to a file that a later run continues.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence

import numpy as np
from host.arrays import Array
from host.compiled import prefer_machine_code
from host.physical.recording import FOREIGN, Recording
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.models import Trim, template
from host.sysid.pipeline import at_hand, identify_columns
from scipy import linalg, signal

from studies.stored_rows import flown_rows, seeded_run
from studies.wrong_flights import (
    AIRSPEED_MPS,
    AMPLITUDE_RAD,
    MANEUVER_S,
    MANEUVERS,
    NOISE_SD,
    PRINCIPAL,
    TRUTH,
)

COLUMNS = ("seed", "motion", "rate_hz", "name", "true", "estimate", "half_width", "hold")
LATERAL = "lateral"
SERVO_RADPS = 12.0  # slow: what lines cut off is largest
MOTIONS = SERVO, HELD, LINES = "servo", "held", "lines"
RATES_HZ = (100, 50, 25)
FINE_HZ = 1000
UNIT_S, LEAD_S = 0.3, 1.0
TRIM = Trim(AIRSPEED_MPS, 0.06, 0.06)


def moved(motion: str, command: Array, per: int) -> Array:
    """Return a surface at every fine step.

    Parameters
    ----------
    motion : str
        One of `MOTIONS`.
    command : Array
    per : int
        Fine steps from sample to sample.
    """
    pole = np.exp(-SERVO_RADPS / FINE_HZ)
    if motion == HELD:
        return np.repeat(command[::per], per)
    behind = np.asarray(signal.lfilter([0.0, 1.0 - pole], [1.0, -pole], command))
    if motion != LINES:
        return behind
    t = np.arange(len(command))
    return np.asarray(np.interp(t, t[::per], behind[::per]))


def flown(
    motion: str, rate_hz: int, seed: int
) -> tuple[dict[str, Array], tuple[DetectedManeuver, ...]]:
    """Return the columns of a flight, each maneuver from rest, and its maneuvers."""
    rng = np.random.default_rng([seed, rate_hz, *motion.encode()])
    model, per = template(LATERAL, TRIM), FINE_HZ // rate_hz
    A, B, C, D = model.matrices(np.array([TRUTH[LATERAL][p.name] for p in model.parameters]))
    u, y, windows, begin = [], [], [], 0.0
    for axis, name in enumerate(model.inputs):
        for k in range(MANEUVERS):
            size = AMPLITUDE_RAD[name] * (1.0 - 2.0 * (k % 2))
            surface = moved(motion, _command(size, LEAD_S + rng.uniform(0.0, 1.0 / rate_hz)), per)
            x = _motion(A, B[:, axis], surface, held=motion == HELD)
            inputs = np.zeros((len(surface), len(model.inputs)))
            inputs[:, axis] = surface
            u.append(inputs[::per])
            y.append((x @ C.T + inputs @ D.T)[::per])
            last_s = begin + MANEUVER_S - 1.0 / rate_hz
            edges = begin + LEAD_S, begin + LEAD_S + 7 * UNIT_S, last_s
            windows.append(DetectedManeuver(name, "3-2-1-1", *edges, abs(size), 4))
            begin += MANEUVER_S
    inputs, outputs = np.vstack(u), np.vstack(y)
    sd = np.array([NOISE_SD[o] for o in model.outputs])
    outputs = outputs + rng.normal(size=outputs.shape) * sd
    still = np.zeros(len(inputs))
    columns: dict[str, Array] = {
        "t_s": np.arange(len(inputs)) / rate_hz,
        "airspeed_mps": still + AIRSPEED_MPS,
    }
    columns |= {"theta_rad": still + TRIM.theta_rad, "alpha_rad": still + TRIM.alpha_rad}
    columns |= dict(zip(model.outputs, outputs.T, strict=True))
    columns |= dict(zip(model.inputs, inputs.T, strict=True))
    return columns, tuple(windows)


def _motion(A: Array, B: Array, surface: Array, *, held: bool) -> Array:
    """Return the states at every fine step, from rest: the surface held there, or on lines."""
    states = len(A)
    block = np.zeros((states + 2, states + 2))
    block[:states, :states], block[:states, states] = A, B
    block[states, -1] = 1.0
    whole = linalg.expm(block / FINE_HZ)[:states]
    slope = np.append(np.diff(surface), 0.0) * FINE_HZ * (not held)
    x = np.zeros((len(surface), states))
    for i in range(len(surface) - 1):
        x[i + 1] = whole @ np.concatenate([x[i], [surface[i], slope[i]]])
    return x


def _command(size: float, at_s: float) -> Array:
    """Return a 3-2-1-1 at every fine step."""
    t, command = np.arange(round(MANEUVER_S * FINE_HZ)) / FINE_HZ, 0.0
    edges = at_s + UNIT_S * np.array([0, 3, 5, 6, 7])
    for sign, begin, end in zip((1, -1, 1, -1), edges[:-1], edges[1:], strict=True):
        command = command + sign * size * ((t >= begin) & (t < end))
    return np.asarray(command)


def rows_of(seed: int, motion: str, rate_hz: int) -> Iterator[dict[str, object]]:
    """Fly once, identify, and return a row of each principal derivative."""
    columns, windows = flown(motion, rate_hz, seed)
    record = at_hand(columns, windows=windows, recording=Recording(maker=FOREIGN))
    [answer] = identify_columns(record, models=LATERAL).linear
    half = answer.result.half_width()
    for name in PRINCIPAL[LATERAL]:
        k = answer.result.index(name)
        value = answer.result.estimate[k]
        row = (seed, motion, rate_hz, name, TRUTH[LATERAL][name], value, half[k], answer.model.hold)
        yield dict(zip(COLUMNS, row, strict=True))


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return a line for each motion and rate."""
    lines = [
        "motion             Hz  flights  hold   of  L_p: mean %  half-width %  L_da: mean %"
        "  half-width %  read held"
    ]
    for motion in MOTIONS:
        for rate_hz in RATES_HZ:
            some = [r for r in rows if (r["motion"], r["rate_hz"]) == (motion, str(rate_hz))]
            if not some:
                continue
            true, estimate, half = (np.array([float(r[k]) for r in some]) for k in COLUMNS[4:7])
            line = f"{motion:18s}{rate_hz:3d}{len({r['seed'] for r in some}):9d}"
            line += f"{np.sum(np.abs(estimate - true) <= half):6d}{len(some):5d}"
            for name in ("L_p", "L_da"):
                at = np.array([r["name"] == name for r in some])
                size = np.abs(true[at])
                # Error of the size: below zero is small.
                error = 100.0 * np.mean((np.abs(estimate[at]) - size) / size)
                line += f"{error:14.2f}{100.0 * np.median(half[at] / size):14.2f}"
            read_held = [r["hold"] for r in some if r["name"] == "L_p"].count("zoh")
            lines.append(f"{line}{read_held:11d}")
    return lines


def main(arguments: list[str] | None = None) -> int:
    """Identify what is not in the file yet, then print the table."""
    run = seeded_run("surfaces_between_samples", __doc__, arguments, flights=8, first_seed=22000)
    keys = ((s, m, r) for s in run.seeds for m in MOTIONS for r in RATES_HZ)
    return run.report(flown_rows(run.rows, COLUMNS, keys, rows_of), table)


if __name__ == "__main__":
    prefer_machine_code()
    sys.exit(main())
