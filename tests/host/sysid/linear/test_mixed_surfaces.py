"""Surfaces that move as one are refused, whatever the method."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.sysid.flight import read_columns
from scipy.signal import lsim

from tests.host.sysid.at_hand import identify
from tests.host.sysid.verdicts import verdict_lines


@pytest.mark.parametrize("method", ["flight", "output-error", "stepwise"])
def test_surfaces_that_the_transmitter_mixes_are_not_told_apart(
    method: str, tmp_path: Path
) -> None:
    rng, t = np.random.default_rng(1), np.arange(0.0, 12.0, 0.01)
    A = np.array([[-0.24, 0.09, -1, 0.57], [-85, -25, 5.4, 0], [33, -0.75, -1.44, 0], [0, 1, 0, 0]])
    B = np.array([[0, 0.12], [400, 8], [7, -28], [0, 0]])
    aileron = 0.07 * (((t > 2.0) & (t < 2.4)) * 1.0 - ((t > 2.4) & (t < 2.8)))
    surfaces = np.column_stack([aileron, 0.5 * aileron])
    states = lsim((A, B, np.eye(4), np.zeros((4, 2))), surfaces, t)[1]
    states += [0.002, 0.01, 0.01, 0.003] * rng.standard_normal(states.shape)
    names = ["beta_rad", "p_radps", "r_radps", "phi_rad", "aileron_rad", "rudder_rad"]
    table = pd.DataFrame(np.hstack([states, surfaces]), columns=names)
    table = table.assign(t_s=t, airspeed_mps=17.0 + 0.02 * rng.standard_normal(len(t)))
    table.to_csv(tmp_path / "mixed.csv", index=False)
    columns, _ = read_columns(tmp_path / "mixed.csv")
    [answer] = identify(columns, names=("lateral",), method=method)
    assert len(answer.used) == 1  # both surfaces moved in the same record
    refused = {r.name for r in answer.identifiability_flags}
    left_out = {n for n in ("L_da", "L_dr", "N_da", "N_dr") if answer.result.value(n) == 0.0}
    assert len(left_out) == (2 if method == "stepwise" else 0)
    assert left_out or {"L_da", "L_dr", "N_da", "N_dr"} <= refused
    mixed = "  aileron_rad and rudder_rad moved together: fly one at a time"
    assert any(line.startswith(mixed) for line in verdict_lines([answer], []))
    [trusted] = [line for line in verdict_lines([answer], []) if "good (" in line]
    assert "L_p" in trusted
    assert "_da" not in trusted
    assert "_dr" not in trusted
