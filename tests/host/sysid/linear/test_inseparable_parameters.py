"""Two parameters that nothing tells apart leave the others as well known as they are without."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.sysid.models.uncertainty import covariance_root
from scipy import signal

import host

TEXT = """\
kind = "equations"
inputs = ["elevator_rad"]
[constants]
stall_rad = 0.5
[definitions]
lost = "SEPARATED/(1 + exp((stall_rad - alpha_rad)/0.02))"
[rates]
alpha_rad = "q_radps + Z_alpha*alpha_rad + Z_de*elevator_rad + lost"
q_radps = "M_alpha*alpha_rad + M_q*q_radps + M_de*elevator_rad"
[outputs]
alpha_rad = "alpha_rad"
q_radps = "q_radps"
[parameters]
Z_alpha = -2.0
Z_de = -0.1
M_alpha = -30.0
M_q = -2.0
M_de = -30.0
"""
NAMES = ["Z_alpha", "Z_de", "M_alpha", "M_q", "M_de"]
# Far below the stall both do the same: exp(-stall/0.02) is a factor of the loss.
WITH = TEXT.replace("stall_rad = 0.5\n", "").replace("SEPARATED", "loss") + (
    "loss = { start = 1e5, lower = 0.0 }\nstall_rad = { start = 0.45, lower = 0.2, upper = 0.9 }\n"
)
WITHOUT = TEXT.replace("SEPARATED", "0")


def _record() -> pd.DataFrame:
    rng, t = np.random.default_rng(1), 0.05 * np.arange(400)
    u = 0.03 * np.sign(np.sin(2.2 * t)) * (np.sin(0.5 * t) > 0.0)
    A, B = np.array([[-1.8, 1.0], [-36.0, -2.6]]), np.array([[-0.15], [-41.0]])
    _, y, _ = signal.lsim((A, B, np.eye(2), np.zeros((2, 1))), u, t)
    y = y + rng.standard_normal(y.shape) * [0.003, 0.005]
    return pd.DataFrame({"t_s": t, "alpha_rad": y[:, 0], "q_radps": y[:, 1], "elevator_rad": u})


@pytest.mark.costs(25, "compiles two models of a user")
@pytest.mark.parametrize("method", ["output-error", "output-error-white"])
def test_intervals_are_those_without_them(tmp_path: Path, method: str) -> None:
    """The noise beside them had 30 times its variance, and Cm_q 34 % in place of 1 %."""
    found = []
    for name, text in (("with.toml", WITH), ("without.toml", WITHOUT)):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        [answer] = host.identify(
            _record(), models=path, methods=method, from_s=0.0, to_s=19.9
        ).linear
        half = answer.result.half_width()
        found.append(np.array([half[answer.result.index(n)] for n in NAMES]))
    wide, narrow = found
    assert np.all(wide < 1.2 * narrow)


def test_a_root_is_exact_for_entries_of_any_size() -> None:
    rng = np.random.default_rng(2)
    part = rng.standard_normal((6, 6))
    size = np.array([1e11, 1e11, 1.0, 1e-3, 1e-6, 0.0])
    covariance = np.outer(size, size) * (part @ part.T)
    root = covariance_root(covariance)
    np.testing.assert_allclose(root @ root.T, covariance, rtol=1e-9)
