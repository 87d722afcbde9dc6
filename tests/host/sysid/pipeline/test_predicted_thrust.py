"""`host predict` where thrust changed: what a saved model says of it, and records without."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.errors import IdentificationError
from host.sysid.models import model_from, read_model
from host.sysid.models.model_text import model_text
from host.sysid.models.thrust_column import ThrustColumn, read_thrust_column
from host.sysid.pipeline.prediction import THRUST_HELD
from scipy.signal import lsim

import host

DT_S, MASS_KG = 0.02, 4.0
A = np.array([[-0.8, -3.0], [-0.05, -6.0]])
B = np.array([[0.0, 1.0 / MASS_KG], [-0.9, -0.002]])
MODEL = {
    "name": "airspeed and alpha",
    "states": ["airspeed_mps", "alpha_rad"],
    "inputs": ["elevator_rad"],
    "outputs": ["airspeed_mps", "alpha_rad"],
    "delays": [],
    "A": A.tolist(),
    "B": [["D_de"], ["Z_de"]],
    "parameters": {"D_de": 0.0, "Z_de": -0.9},
    "state_biases": ["airspeed_mps", "alpha_rad"],
}
COLUMN = ThrustColumn(B[:, 1], np.zeros(2))


def saved(folder: Path, thrust: ThrustColumn | None) -> Path:
    path = folder / "model.toml"
    path.write_text(model_text(model_from(MODEL), thrust=thrust), encoding="utf-8")
    return path


def recorded(seed: int) -> pd.DataFrame:
    """Two doublets of the elevator while thrust steps by a third."""
    t = np.arange(0.0, 16.0, DT_S)
    de = sum(
        0.06 * (((t >= a) & (t < a + 0.3)).astype(float) - ((t >= a + 0.3) & (t < a + 0.6)))
        for a in (2.0, 9.0)
    )
    thrust = 6.0 + 2.0 * ((t > 3.0) & (t < 5.0)) - 2.0 * ((t > 10.0) & (t < 12.0))
    u = np.column_stack([de, thrust - 6.0])
    _, _, x = lsim((A, B, np.eye(2), np.zeros((2, 2))), u, t)
    x = [17.0, 0.06] + x + [0.02, 3e-4] * np.random.default_rng(seed).standard_normal(x.shape)
    columns = {"t_s": t, "elevator_rad": de - 0.04, "thrust_n": thrust}
    return pd.DataFrame(columns | {"airspeed_mps": x[:, 0], "alpha_rad": x[:, 1]})


@pytest.mark.parametrize("constants", [True, False])
def test_measured_thrust_drives_a_saved_model(tmp_path: Path, constants: bool) -> None:
    """Left out, airspeed of an airliner was off by 44 in place of 9 % of its change."""
    table, path = recorded(1), saved(tmp_path, COLUMN)

    def airspeed_nrmse(model: Path, over: pd.DataFrame) -> float:
        found = host.predict(model, over, constants=constants)
        [one] = found.simulations[0].models
        [fit] = [f for f in one.fits if f.name == "airspeed_mps"]
        return float(fit.nrmse)

    assert airspeed_nrmse(path, table) < 0.2  # noise alone makes 0.12
    power = table.drop(columns="thrust_n").assign(
        power_w=table["thrust_n"] * table["airspeed_mps"] / 0.66
    )
    assert airspeed_nrmse(path, power) < 0.3
    left_out = saved(tmp_path, None)
    assert airspeed_nrmse(left_out, table) > 0.6


def test_a_record_without_thrust_is_predicted_with_a_note(tmp_path: Path) -> None:
    table = recorded(2).drop(columns="thrust_n")
    found = host.predict(saved(tmp_path, COLUMN), table)
    assert THRUST_HELD in found.simulations[0].notes
    assert THRUST_HELD not in host.predict(saved(tmp_path, None), table).simulations[0].notes


def test_thrust_beside_a_model_is_written_and_read(tmp_path: Path) -> None:
    path = saved(tmp_path, COLUMN)
    model = read_model(path)
    assert model.inputs == ("elevator_rad",)
    found = read_thrust_column(path, model)
    assert found is not None
    np.testing.assert_allclose(found.rates_per_n, COLUMN.rates_per_n)
    np.testing.assert_allclose(found.outputs_per_n, COLUMN.outputs_per_n)
    assert read_thrust_column(saved(tmp_path, None), model) is None


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("thrust = 3", "rates_per_n and outputs_per_n, and nothing else"),
        ("[thrust]\nrates_per_n = [1.0]", "and nothing else"),
        ("[thrust]\nrates_per_n = [1.0]\noutputs_per_n = [0.0, 0.0]", "expected 2 numbers"),
        ("[thrust]\nrates_per_n = [1.0, 'x']\noutputs_per_n = [0.0, 0.0]", "rates_per_n"),
        ("[thrust]\nrates_per_n = [1.0, nan]\noutputs_per_n = [0.0, 0.0]", "rates_per_n"),
    ],
)
def test_a_wrong_table_is_named(tmp_path: Path, table: str, said: str) -> None:
    path = saved(tmp_path, None)
    text = path.read_text(encoding="utf-8")
    path.write_text(f"{table}\n{text}" if table[0] == "t" else f"{text}{table}\n", encoding="utf-8")
    with pytest.raises(IdentificationError, match=said):
        host.predict(path, recorded(1))
