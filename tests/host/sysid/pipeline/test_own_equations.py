"""A user's own equations through the whole pipeline: fitted, said, saved, refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.errors import IdentificationError
from host.sysid.answer import OutputPaths
from host.sysid.models import Maneuver, read_model
from host.sysid.numerics import output_problem
from scipy import integrate

import host

pytestmark = pytest.mark.usefixtures("interpreted")

TEXT = """\
kind = "equations"
name = "pitch with a bend"
inputs = ["elevator_rad"]
[definitions]
lift = "Za*alpha_rad + gust_aa*alpha_rad*abs(alpha_rad) + Z0"
[rates]
alpha_rad = "q_radps + lift"
q_radps = "Ma*sin(alpha_rad) + Mq*q_radps + Mde*elevator_rad + M0"
[outputs]
alpha_rad = "alpha_rad"
q_radps = "q_radps + q_bias_radps"
[parameters]
Za = { start = -3.0, unit = "1/s" }
gust_aa = 0.0
Z0 = 0.0
Ma = -60.0
Mq = -4.0
Mde = -60.0
M0 = 0.0
q_bias_radps = { each_record = true, prior_sd = 0.05 }
"""
TRUTH = {"Za": -5.0, "gust_aa": 4.0, "Z0": 0.1, "Ma": -50.0, "Mq": -5.0, "Mde": -60.0, "M0": -0.5}
BIAS = (0.02, -0.03)
DT_S, SAMPLES = 0.04, 40


def flown(model: Path) -> list[pd.DataFrame]:
    """Return two records of 1.6 s with noise, each with its bias of the gyro."""
    rng = np.random.default_rng(3)
    t = np.arange(SAMPLES) * DT_S
    tables = []
    for number, bias in enumerate(BIAS):
        u = 0.08 * np.where((t > 0.5) & (t < 2.5), np.sign(np.sin((3.0 + number) * t)), 0.0)
        noise = rng.standard_normal((SAMPLES, 2)) * [0.002, 0.008]
        problem = output_problem(read_model(model), [Maneuver(DT_S, u[:, None], noise)])
        theta = np.array([*TRUTH.values(), 0.0, 0.0, bias])
        found = problem.outputs(theta)
        assert found is not None
        y = found[0].T + noise
        tables.append(
            pd.DataFrame({"t_s": t, "elevator_rad": u, "alpha_rad": y[:, 0], "q_radps": y[:, 1]})
        )
    return tables


def test_two_records_have_a_bias_each_and_one_answer(tmp_path: Path) -> None:
    """That longer ones hold the truth is frozen; `gust_aa` is none of the gust filter's."""
    model = tmp_path / "mine.toml"
    model.write_text(TEXT, encoding="utf-8")
    answer = host.identify(
        flown(model), models=model, methods="output-error-white", from_s=0.0, to_s=1.5
    )
    result = answer.linear[0].result
    half = result.half_width()
    assert set(TRUTH) <= set(result.names)
    for number, value in enumerate(BIAS, start=1):
        k = result.index(f"q_bias_radps@{number}")
        assert abs(result.estimate[k] - value) < 2.0 * half[k]
    assert half[result.index("Ma")] < 20.0  # the hold of 0.04 s is in it
    document = json.loads(answer.to_json())
    assert document["answers"][0]["parameters"]["Za"]["unit"] == "1/s"
    # The tangent: Za + 2 gust_aa |alpha|, and the modes that belong to it.
    assert np.array(document["answers"][0]["A"])[1, 1] == pytest.approx(result.value("Mq"))
    assert "short period" in answer.to_text()
    saved = tmp_path / "saved.toml"
    answer.save(OutputPaths(save_model=saved))
    starts = {p.name: p.start for p in read_model(saved).parameters}
    assert starts["Ma"] == pytest.approx(result.value("Ma"))


@pytest.mark.parametrize("method", ["equation-error", "filter-error-gust", "hopfield"])
def test_a_method_of_linear_models_is_refused(tmp_path: Path, method: str) -> None:
    model = tmp_path / "mine.toml"
    model.write_text(TEXT, encoding="utf-8")
    still = dict.fromkeys(("elevator_rad", "alpha_rad", "q_radps"), 0.0)
    table = pd.DataFrame({"t_s": np.arange(SAMPLES) * DT_S, "airspeed_mps": 17.0, **still})
    with pytest.raises(IdentificationError, match=r"pitch with a bend.* has equations"):
        host.identify(table, models=model, methods=method, from_s=0.0, to_s=1.5)


def swinging() -> tuple[str, pd.DataFrame]:
    """Return a pendulum of no input, and a record of it."""
    text = """\
kind = "equations"
[rates]
phi_rad = "p_radps"
p_radps = "-stiffness*sin(phi_rad) - damping*p_radps"
[outputs]
phi_rad = "phi_rad"
[parameters]
stiffness = 20.0
damping = 0.2
"""
    t = np.arange(150) * DT_S
    path = integrate.solve_ivp(
        lambda _, x: [x[1], -25.0 * np.sin(x[0]) - 0.4 * x[1]], (0.0, t[-1]), [0.8, 0.0],
        t_eval=t, rtol=1e-9, atol=1e-9,
    )  # fmt: skip
    noise = np.random.default_rng(2).standard_normal(150) * 0.003
    return text, pd.DataFrame({"t_s": t, "phi_rad": path.y[0] + noise})


def test_a_record_without_surfaces_is_fitted_whole(tmp_path: Path) -> None:
    """It was refused for want of a surface."""
    text, record = swinging()
    model = tmp_path / "pendulum.toml"
    model.write_text("inputs = []\n" + text, encoding="utf-8")
    how: dict[str, Any] = {"models": model, "methods": "output-error-white"}
    record = record.head(60)
    whole = host.identify(record, **how).linear[0].result
    given = host.identify(record, **how, from_s=0.0, to_s=6.0).linear[0].result
    np.testing.assert_array_equal(whole.estimate, given.estimate)
    # Run over such a record it said "no maneuver of elevator_rad, ...; found none".
    predicted = host.predict(model, record)
    (run,) = predicted.simulations[0].models
    assert len(run.maneuvers) == 1 and run.maneuvers[0].samples >= len(record) - 1


def test_measured_columns_alone_may_drive_equations(tmp_path: Path) -> None:
    """Nothing that a pilot moves could drive what a fit left: an index beyond an empty list."""
    text, record = swinging()
    model = tmp_path / "pendulum.toml"
    moved = text.replace('damping*p_radps"', 'damping*p_radps + push_radps2"')
    model.write_text('inputs = []\ncolumns = ["push_radps2"]\n' + moved, encoding="utf-8")
    pushed = record.assign(push_radps2=0.0).head(100)
    result = host.identify(pushed, models=model, methods="output-error").linear[0].result
    for name, value in (("stiffness", 25.0), ("damping", 0.4)):
        k = result.index(name)
        assert abs(result.estimate[k] - value) < 1.5 * result.half_width()[k] < 0.3 * value, name


def test_a_parameter_that_acts_on_nothing_is_named(tmp_path: Path) -> None:
    text, record = swinging()
    model = tmp_path / "pendulum.toml"
    stop = " - stop*max(0, phi_rad - 2)"
    model.write_text(
        text.replace('damping*p_radps"', f'damping*p_radps{stop}"') + "stop = 9\n",
        encoding="utf-8",
    )
    with pytest.raises(IdentificationError, match="stop acts on no output in these maneuvers"):
        host.identify(record, models=model, methods="output-error-white", from_s=0.0, to_s=6.0)
