"""Records without noise: do intervals hold what the input did between its samples?

A short period, stable or not, sampled at 25 to 100 Hz. Its input was smooth, stepped at instants
of its own, or a servo behind such steps; or it was held from sample to sample. Identified by a
user's linear model or equations, lines drawn through the input or not, or by the default model.
One row an estimate goes to a file that a later run continues.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from host.arrays import Array
from host.compiled import prefer_machine_code
from host.errors import IdentificationError
from scipy import signal

import host
from studies.stored_rows import flown_rows, seeded_run

COLUMNS = ("seed", "input", "model", "name", "true", "estimate", "half_width")
NAMES = ("Z_alpha", "M_alpha", "M_q", "Z_de", "M_de")
AIRCRAFT = (
    (-1.5, 7.0, -2.5, -0.15, -14.0),  # unstable
    (-4.0, -40.0, -4.0, -0.2, -30.0),
    (-2.0, -6.0, -2.0, -0.1, -10.0),
)
RATES_HZ = (25, 50, 100)
INPUTS = ("smooth", "smooth, held", "steps", "steps, held", "servo")
MODELS = ("linear, lines", "linear, held", "equations, lines", "equations, held", "default")
FINE = 40  # steps of the truth from sample to sample
AMPLITUDE_RAD = 0.03
LINEAR = """\
name = "mine"
states = ["alpha_rad", "q_radps"]
inputs = ["elevator_rad"]
outputs = ["alpha_rad", "q_radps"]
delays = []
state_biases = []
A = [["Z_alpha", 1.0], ["M_alpha", "M_q"]]
B = [["Z_de"], ["M_de"]]
"""
EQUATIONS = """\
kind = "equations"
inputs = ["elevator_rad"]
[rates]
alpha_rad = "Z_alpha*alpha_rad + q_radps + Z_de*elevator_rad"
q_radps = "M_alpha*alpha_rad + M_q*q_radps + M_de*elevator_rad"
[outputs]
alpha_rad = "alpha_rad"
q_radps = "q_radps"
"""


def moved(kind: str, t: Array, dt_s: float, rng: np.random.Generator) -> Array:
    """Return the input at every fine step."""
    if kind.startswith("smooth"):
        quick, slow = rng.uniform(2.0, 6.0), rng.uniform(0.5, 2.0)
        begins = np.minimum(t / 0.3, 1.0) ** 2
        wave = np.sin(quick * t) * np.sin(slow * t + rng.uniform(0.0, 3.0))
        return np.asarray(AMPLITUDE_RAD * begins * wave)
    u, at_s, unit_s = np.zeros_like(t), 0.3 + rng.uniform(0.0, dt_s), rng.uniform(0.15, 0.35)
    for length, sign in ((3, 1), (2, -1), (1, 1), (1, -1)):
        u[(t >= at_s) & (t < at_s + length * unit_s)] = sign * AMPLITUDE_RAD
        at_s += length * unit_s
    if kind != "servo":
        return u
    share = np.exp(-dt_s / FINE * rng.uniform(20.0, 40.0))
    return np.asarray(signal.lfilter([0.0, 1.0 - share], [1.0, -share], u))


def flown(kind: str, true: Sequence[float], dt_s: float, rng: np.random.Generator) -> pd.DataFrame:
    """Return a record of three or four seconds."""
    step_s = dt_s / FINE
    t = step_s * np.arange(round((3.0 if true[1] > 0.0 else 4.0) / step_s))
    u = moved(kind, t, dt_s, rng)
    drive = np.repeat(u[::FINE], FINE) if kind.endswith("held") else u
    if kind in ("smooth", "servo"):
        drive = 0.5 * (u + np.append(u[1:], u[-1]))
    Z_alpha, M_alpha, M_q, Z_de, M_de = true
    A, B = np.array([[Z_alpha, 1.0], [M_alpha, M_q]]), np.array([[Z_de], [M_de]])
    F, G, *_ = signal.cont2discrete((A, B, np.eye(2), np.zeros((2, 1))), step_s)
    x = np.zeros((len(t), 2))
    for k in range(len(t) - 1):
        x[k + 1] = F @ x[k] + G[:, 0] * drive[k]
    columns = {"t_s": t, "elevator_rad": u, "alpha_rad": x[:, 0], "q_radps": x[:, 1]}
    return pd.DataFrame(columns)[::FINE]


def rows_of(seed: int) -> Iterator[dict[str, object]]:
    """Draw a record and a model, and identify."""
    rng = np.random.default_rng(seed)
    true = AIRCRAFT[rng.integers(len(AIRCRAFT))]
    dt_s = 1.0 / RATES_HZ[rng.integers(len(RATES_HZ))]
    kind, model = INPUTS[rng.integers(len(INPUTS))], MODELS[rng.integers(len(MODELS))]
    table = flown(kind, true, dt_s, rng)
    hold = "foh" if model.endswith("lines") else "zoh"
    start = "".join(f"{n} = {0.75 * v}\n" for n, v in zip(NAMES, true, strict=True))
    text = LINEAR if model.startswith("linear") else EQUATIONS
    with tempfile.TemporaryDirectory() as folder:
        own = Path(folder) / "model.toml"
        own.write_text(f'hold = "{hold}"\n{text}[parameters]\n{start}', encoding="utf-8")
        models = "short-period" if model == "default" else own
        end_s = float(table["t_s"].iloc[-1])
        try:
            result = host.identify(table, models=models, from_s=0.0, to_s=end_s).linear[0].result
        except IdentificationError as error:
            print(f"seed {seed}: {error}", file=sys.stderr)
            return
    half = result.half_width()
    for name, value in zip(NAMES, true, strict=True):
        row = (seed, kind, model, name, value, result.value(name), half[result.index(name)])
        yield dict(zip(COLUMNS, row, strict=True))


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return a line for each input, and for all: how many hold, and how wide intervals are."""
    lines = ["input           records  estimates  hold  half-width over value, median %    M's"]
    for kind in (*INPUTS, "all"):
        some = [r for r in rows if kind in (r["input"], "all")]
        if not some:
            continue
        true, estimate, half = (np.array([float(r[k]) for r in some]) for k in COLUMNS[4:])
        moments = np.array([r["name"].startswith("M_") for r in some])
        wide = 100.0 * half / np.abs(true)
        held = int(np.sum(np.abs(estimate - true) <= half))
        lines.append(
            f"{kind:14s}{len({r['seed'] for r in some}):9d}{len(some):11d}{held:6d}"
            f"{np.median(wide):33.2f}{np.median(wide[moments]):7.2f}"
        )
    return lines


def main(arguments: list[str] | None = None) -> int:
    """Identify what is not in the file yet, then print the table."""
    run = seeded_run(
        "clean_records", __doc__, arguments, flights=100, first_seed=19540, each="records"
    )
    keys = ((seed,) for seed in run.seeds)
    return run.report(flown_rows(run.rows, COLUMNS, keys, rows_of), table)


if __name__ == "__main__":
    prefer_machine_code()
    sys.exit(main())
