"""A user's linear model in four kinds of noise: is the default the best?

White noise, noise with a memory, gusts, and white noise with a moment that the model lacks. A
short period flies 3-2-1-1s behind a servo; every flight is fitted as `host identify --model
mine.toml` fits it, by the default and by each of the three methods that it chooses among. One row a
flight, method and derivative goes to a file that a later run continues.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from host.arrays import Array
from host.errors import IdentificationError
from host.instrument.instrument_errors import standard_errors
from host.sysid.linear import DEFAULT_METHOD
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.models import model_from
from host.sysid.pipeline import at_hand, identify_columns
from scipy import signal

from studies.inputs import multistep_3211
from studies.stored_rows import flown_rows, seeded_run

FIRST_SEED = 17100  # those below were looked at
NOISES = ("white", "coloured", "gust", "model error")
FIXED = ("output-error-white", "output-error", "filter-error-gust")
METHODS = (DEFAULT_METHOD, *FIXED)
COLUMNS = ("noise", "seed", "method", "came_to", "name", "true", "estimate", "half_width")
NO_ERRORS = standard_errors().scaled(0.01)  # of sensors, but noise
DT_S, FINE, DURATION_S = 0.01, 4, 12.0
AIRSPEED_MPS, SCALE_M, GUST_MPS = 17.0, 30.0, 0.5
SERVO_RADPS, UNIT_S = 50.0, 0.35
A = np.array([[-6.0, 1.0], [-80.0, -9.0]])
B = np.array([-0.9, -90.0])
TRUTH = {"Z_alpha": -6.0, "M_alpha": -80.0, "M_q": -9.0, "Z_de": -0.9, "M_de": -90.0}
NOISE_SD = np.array([0.006, 0.03])
POLE = 0.95  # of the noise with a memory
LACKING = 0.3  # of M_alpha, more at 0.1 rad of angle of attack
ROUNDS = 6  # until that moment is the one of the motion it makes
INTERVAL_PENALTY = 2.0 / 0.05  # Gneiting & Raftery, JASA 102 (2007): of a 95 % interval
MODEL = {
    "name": "mine",
    "states": ["alpha_rad", "q_radps"],
    "inputs": ["elevator_rad"],
    "outputs": ["alpha_rad", "q_radps"],
    "delays": [],
    "hold": "foh",
    "A": [["Z_alpha", 1.0], ["M_alpha", "M_q"]],
    "B": [["Z_de"], ["M_de"]],
    "parameters": {name: 0.8 * value for name, value in TRUTH.items()},
}


def flown(noise: str, seed: int) -> dict[str, Array]:
    """Return the columns of one flight."""
    rng = np.random.default_rng([seed, NOISES.index(noise)])
    samples = round(DURATION_S / DT_S)
    t = np.arange(samples * FINE) * DT_S / FINE
    one = multistep_3211(0.06, DT_S / FINE, DURATION_S / 3.0, UNIT_S)[:, 0]
    command = np.concatenate([one, -one, one])
    one_state = np.ones((1, 1))
    servo = (-SERVO_RADPS * one_state, SERVO_RADPS * one_state, one_state, 0.0 * one_state)
    _, elevator, _ = signal.lsim(servo, command, t)
    air = np.zeros(len(t))
    if noise == "gust":
        pole = np.exp(-AIRSPEED_MPS / SCALE_M * DT_S / FINE)
        white = rng.standard_normal(len(t) + 20_000) * np.sqrt(1.0 - pole**2)
        air = GUST_MPS / AIRSPEED_MPS * signal.lfilter([1.0], [1.0, -pole], white)[20_000:]
    moment: Array = np.zeros(len(t))
    system = (A, np.column_stack([B, A[:, 0], [0.0, 1.0]]), np.eye(2), np.zeros((2, 3)))
    for _ in range(ROUNDS if noise == "model error" else 1):
        _, x, _ = signal.lsim(system, np.column_stack([elevator, air, moment]), t)
        moment = LACKING * TRUTH["M_alpha"] * x[:, 0] ** 2 / 0.1
    x[:, 0] += air
    error = rng.standard_normal((samples + 200, 2))
    if noise == "coloured":
        error = signal.lfilter([np.sqrt(1.0 - POLE**2)], [1.0, -POLE], error, axis=0)
    y = x[::FINE] + NOISE_SD * error[200:]
    return {
        "t_s": t[::FINE],
        "airspeed_mps": np.full(samples, AIRSPEED_MPS),
        "elevator_rad": elevator[::FINE],
        "alpha_rad": y[:, 0],
        "q_radps": y[:, 1],
    }


def rows_of(noise: str, seed: int) -> list[dict[str, object]]:
    """Fly once and fit by every method; one that gives no answer leaves a row without numbers."""
    columns = flown(noise, seed)
    window = DetectedManeuver(
        "elevator_rad", "stretch", 0.0, DURATION_S, DURATION_S, 0.06, 4, given=True, lead_s=0.0
    )
    found: list[dict[str, object]] = []
    for method in METHODS:
        try:
            record = at_hand(columns, windows=[window], errors=NO_ERRORS)
            [answer] = identify_columns(record, models=model_from(MODEL), methods=method).linear
        except IdentificationError:
            found.append(dict.fromkeys(COLUMNS, "") | {"noise": noise, "seed": seed})
            continue
        half = answer.result.half_width()
        for name, true in TRUTH.items():
            k = answer.result.index(name)
            values = (
                noise, seed, method, answer.method, name, true,
                float(answer.result.estimate[k]), float(half[k]),
            )  # fmt: skip
            found.append(dict(zip(COLUMNS, values, strict=True)))
    return found


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return a line for each noise and method: error, interval, what holds, what was chosen."""
    lines = [
        "noise        method              median error %  half-width %  score over best  holds %"
        "  chosen"
    ]
    for noise in NOISES:
        found = {}
        for method in (*FIXED, DEFAULT_METHOD):
            own = [r for r in rows if (r["noise"], r["method"]) == (noise, method)]
            true, value, half = (
                np.array([float(r[k]) for r in own]) for k in ("true", "estimate", "half_width")
            )
            if own:
                off, size = np.abs(value - true), np.abs(true)
                error, width = (100.0 * float(np.median(x / size)) for x in (off, half))
                came = [r["came_to"] for r in own]
                score = 2.0 * half + INTERVAL_PENALTY * np.maximum(off - half, 0.0)
                mean = float(np.mean(score / size))
                found[method] = error, width, mean, 100.0 * float(np.mean(off <= half)), came
        best = min((found[m][2] for m in FIXED if m in found), default=np.nan)
        for method, (error, width, score_of, holds, came) in found.items():
            chosen = {m: came.count(m) // len(TRUTH) for m in FIXED if m in came}
            lines.append(
                f"{noise:12s} {method:18s}  {error:14.2f}  {width:12.2f}  {score_of / best:15.2f}"
                f"  {holds:7.1f}" + (f"  {chosen}" if method == DEFAULT_METHOD else "")
            )
    failed = sum(not r["method"] for r in rows)
    return [*lines, f"fits without an answer: {failed}"]


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    run = seeded_run(
        "users_models", __doc__, arguments, flights=40, first_seed=FIRST_SEED, each="of each noise"
    )
    keys = ((noise, seed) for seed in run.seeds for noise in NOISES)
    rows = flown_rows(run.rows, COLUMNS, keys, rows_of)
    return run.report(rows, table)


if __name__ == "__main__":
    sys.exit(main())
