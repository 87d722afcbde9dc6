"""The thesis's models: as files that fit and predict take by name, their poles as said."""

import re

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.readers.derived_columns import derived_columns
from host.sysid.models import read_model
from host.sysid.models.named_models import model_path, shipped_files, shipped_lines
from host.sysid.pipeline.requested_models import requested_models
from host.thesis.thesis_methods import MODELS

PUBLISHED = [name for name in shipped_files() if re.search("eq5|table", name)]


def test_all_of_the_thesis_are_there() -> None:
    assert set(PUBLISHED) == {
        "thesis-eq5-5", "thesis-eq5-8", "thesis-eq5-11", "thesis-eq5-12", "thesis-table3-1"
    }  # fmt: skip
    assert len(shipped_files()) == 11


@pytest.mark.parametrize("name", shipped_files())
def test_every_one_is_read_by_its_name(name: str) -> None:
    ((_, model),) = requested_models(name).linear
    assert model is not None
    assert len(model.parameters) == 0 if name in PUBLISHED else len(model.parameters) >= 15
    assert any(line.startswith(name) for line in shipped_lines())


@pytest.mark.parametrize("name", PUBLISHED)
def test_poles_are_those_it_says(name: str) -> None:
    A = read_model(model_path(name)).matrices(np.zeros(0))[0]
    said = (MODELS / f"{name}.toml").read_text().split("# poles: ")[1].splitlines()[0]
    found = sorted(np.linalg.eigvals(A), key=lambda z: (-abs(z), -z.imag))
    expected: list[complex] = []
    for text in said.split(", "):
        real, _, imaginary = text.partition(" +- ")
        turn = float(imaginary.rstrip("j")) if imaginary else 0.0
        expected += [complex(float(real), turn), complex(float(real), -turn)][: 2 if turn else 1]
    np.testing.assert_allclose(found, expected, rtol=6e-4)


def test_the_unstable_one_is_unstable() -> None:
    A = read_model(model_path("thesis-eq5-5")).matrices(np.zeros(0))[0]
    assert np.linalg.eigvals(A).real.max() == pytest.approx(0.398, abs=0.001)


def test_the_rate_of_a_surface_is_its_slope() -> None:
    t = np.arange(0.0, 2.0, 0.05)
    columns = {"t_s": t, "elevator_rad": np.sin(3.0 * t)}
    found = derived_columns(columns, ("elevator_rate_radps", "rudder_rate_radps", "q_radps"))
    assert list(found) == ["elevator_rate_radps"]
    np.testing.assert_allclose(
        found["elevator_rate_radps"][1:-1], 3.0 * np.cos(3.0 * t[1:-1]), atol=0.02
    )


def test_a_model_with_the_rate_of_the_elevator_is_fitted(
    tmp_path: object, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 24.0, 0.05)
    de = np.zeros(len(t))
    for a in (3.0, 10.0, 17.0):
        de += 0.08 * (((t >= a) & (t < a + 0.5)).astype(float) - ((t >= a + 0.5) & (t < a + 1.0)))
    rate = np.gradient(de, 0.05)
    A = np.array([[-0.1, -3.0, 0.0, -9.8], [-0.05, -4.0, 0.95, 0.0], [0.0, -20.0, -5.0, 0.0],
                  [0.0, 0.0, 1.0, 0.0]])  # fmt: skip
    B = np.array([[0.0, 0.0], [-0.3, 0.0], [-25.0, -1.5], [0.0, 0.0]])
    x = np.zeros((len(t), 4))
    for k in range(len(t) - 1):
        now = x[k]
        for _ in range(20):
            now = now + 0.0025 * (A @ now + B @ np.array([de[k], rate[k]]))
        x[k + 1] = now
    x += 1e-4 * rng.standard_normal(x.shape)
    names = ("airspeed_mps", "alpha_rad", "q_radps", "theta_rad")
    table = pd.DataFrame({"t_s": t, "elevator_rad": de} | dict(zip(names, x.T, strict=True)))
    table["airspeed_mps"] += 15.0
    path = f"{tmp_path}/t.csv"
    table.to_csv(path, index=False)
    words = ["identify", path, "--model", "thesis-flight1", "--method", "equation-error"]
    assert main([*words, "--no-corrections"]) == 0
    said = capsys.readouterr().out
    assert "Q_dedot" in said
    assert main(["identify", "--model", "list"]) == 0
    assert "thesis-eq5-11" in capsys.readouterr().out
