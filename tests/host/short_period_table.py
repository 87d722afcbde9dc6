"""A short period with two elevator doublets as a table, and `host identify` on it."""

from pathlib import Path

import numpy as np
import pandas as pd
from host.cli import main
from scipy.signal import lsim


def short_period_table(folder: Path) -> Path:
    """Write it as a CSV and return the file."""
    t = np.arange(0.0, 16.0, 0.02)
    de = sum(
        0.06 * (((t >= a) & (t < a + 0.3)).astype(float) - ((t >= a + 0.3) & (t < a + 0.6)))
        for a in (2.0, 9.0)
    )
    A, B = np.array([[-6.0, 1.0], [-80.0, -9.0]]), np.array([[-0.9], [-90.0]])
    _, _, x = lsim((A, B, np.eye(2), np.zeros((2, 1))), de, t)
    x += 3e-4 * np.random.default_rng(1).standard_normal(x.shape)
    path = folder / "t.csv"
    columns = {"t_s": t, "airspeed_mps": 17.0 + 0.01 * np.sin(t), "elevator_rad": de}
    pd.DataFrame(columns | {"alpha_rad": x[:, 0], "q_radps": x[:, 1]}).to_csv(path, index=False)
    return path


def identified(table: Path, method: str, *more: str) -> int:
    """Return the exit code of `host identify` of its short period by a method."""
    words = ["identify", str(table), "--model", "short-period", "--method", method, "--full", *more]
    return main(words)
