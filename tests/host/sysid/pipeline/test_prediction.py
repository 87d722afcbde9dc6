"""`host predict`: a saved model against other records, figures checked by hand."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.aircraft.file import FOLDER as AIRFRAMES
from host.cli import main
from host.errors import IdentificationError
from host.sysid import Maneuver
from host.sysid.models import model_from
from host.sysid.models.theil_inequality import theil_inequality
from host.sysid.validation import window_errors
from host.sysid.validation.free_simulation import free_runs, frozen_at
from host.twin.virtual import virtual_flight
from scipy.signal import lsim

import host

DT_S = 0.02
A = np.array([[-6.0, 1.0], [-80.0, -9.0]])
B = np.array([[-0.9], [-90.0]])
TRIM = np.array([0.06, 0.0])
MODEL: dict[str, Any] = {
    "name": "short-period",
    "states": ["alpha_rad", "q_radps"],
    "inputs": ["elevator_rad"],
    "outputs": ["alpha_rad", "q_radps"],
    "delays": [],
    "A": [["Z_alpha", 1.0], ["M_alpha", "M_q"]],
    "B": [["Z_de"], ["M_de"]],
    "parameters": {"Z_alpha": -6.0, "M_alpha": -80.0, "M_q": -9.0, "Z_de": -0.9, "M_de": -90.0},
}


def recorded(seed: int, shift: float = 1.0, noise: float = 3e-4) -> pd.DataFrame:
    """Two elevator doublets, trim before them; `shift` is a factor on M_alpha."""
    t = np.arange(0.0, 16.0, DT_S)
    de = sum(
        0.06 * (((t >= a) & (t < a + 0.3)).astype(float) - ((t >= a + 0.3) & (t < a + 0.6)))
        for a in (2.0, 9.0)
    )
    own = A * [[1.0, 1.0], [shift, 1.0]]
    _, _, x = lsim((own, B, np.eye(2), np.zeros((2, 1))), de, t)
    x = TRIM + x + noise * np.random.default_rng(seed).standard_normal(x.shape)
    columns = {"t_s": t, "airspeed_mps": 17.0 + 0.01 * np.sin(t), "elevator_rad": de - 0.04}
    return pd.DataFrame(columns | {"alpha_rad": x[:, 0], "q_radps": x[:, 1]})


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model saved by `host identify` from one record."""
    folder = tmp_path_factory.mktemp("saved")
    source, path = folder / "one.csv", folder / "model.toml"
    recorded(1).to_csv(source, index=False)
    words = ["identify", str(source), "--model", "short-period", "--no-delays"]
    assert main([*words, "--save-model", str(path)]) == 0
    return path


def figures(text: str) -> dict[str, Any]:
    [record] = json.loads(text)["records"]
    [model] = record["models"]
    return dict(model)


def test_a_good_model_predicts_what_it_has_not_seen(saved: Path) -> None:
    found = figures(host.predict(saved, recorded(2)).to_json())
    free = found["free_simulation"]["q_radps"]
    assert free["nrmse"] < 0.03
    assert free["theil_covariance"] > 0.9
    assert [w["length_s"] for w in found["windows"]] == [0.1, 0.5, 1.0, 2.0]
    assert all(w["over_persistence"]["q_radps"] < 0.1 for w in found["windows"][1:])


def test_a_verdict_in_words_names_what_is_not_predicted(saved: Path) -> None:
    good = host.predict(saved, recorded(2)).to_text().splitlines()[-1]
    assert good.startswith("  Verdict: predicted by the inputs alone") and "not" not in good
    lost = recorded(2)
    lost["q_radps"] = 0.1 * np.random.default_rng(3).standard_normal(len(lost))
    bad = host.predict(saved, lost).to_text().splitlines()[-1]
    assert bad.endswith("; q_radps not predicted.")


def test_derivatives_are_held(saved: Path) -> None:
    """A record of another aircraft is not fitted: the model is seen to be wrong."""
    right, wrong = (
        figures(host.predict(saved, recorded(2, shift)).to_json()) for shift in (1.0, 1.5)
    )
    for signal in ("alpha_rad", "q_radps"):
        good, bad = (f["free_simulation"][signal]["nrmse"] for f in (right, wrong))
        assert bad > 5.0 * good


def test_without_constants_nothing_is_fitted(saved: Path) -> None:
    """A step of the sensor's zero in mid-record is absorbed by a fit, not without one."""
    table = recorded(2, noise=0.0)
    table["q_radps"] += np.where(table["t_s"] > 2.0, 0.1, 0.0)
    fitted = figures(host.predict(saved, table, from_s=1.6, to_s=6.0).to_json())
    held = figures(host.predict(saved, table, from_s=1.6, to_s=6.0, constants=False).to_json())
    assert held["free_simulation"]["q_radps"]["theil_bias"] > 0.5
    assert fitted["free_simulation"]["q_radps"]["theil_bias"] < 0.05
    text = host.predict(saved, table, constants=False).to_text()
    assert "nothing fitted" in text


EQUATIONS = """\
kind = "equations"
inputs = ["elevator_rad"]
state_biases = ["alpha_rad", "q_radps"]
[rates]
alpha_rad = "-6*alpha_rad + q_radps - 0.9*elevator_rad"
q_radps = "-80*alpha_rad + Mq*q_radps - 90*elevator_rad"
[outputs]
alpha_rad = "alpha_rad"
q_radps = "q_radps + gyro_radps"
[parameters]
Mq = -9.0
gyro_radps = { each_record = true, prior_sd = 0.05 }
[[delays]]
name = "vane_s"
outputs = ["alpha_rad"]
"""


@pytest.mark.usefixtures("interpreted")
def test_equations_that_are_linear_predict_as_the_linear_model(tmp_path: Path) -> None:
    own, plain = tmp_path / "own.toml", tmp_path / "plain.toml"
    own.write_text(EQUATIONS, encoding="utf-8")
    text = "\n".join(f"{k} = {json.dumps(v)}" for k, v in MODEL.items() if k != "parameters")
    numbers = "\n".join(f"{k} = {v}" for k, v in MODEL["parameters"].items())
    plain.write_text(f'{text}\nhold = "foh"\n[parameters]\n{numbers}\n', encoding="utf-8")
    table = recorded(2)
    table["q_radps"] += 0.03  # a zero of the gyro is a constant of the record
    found, expected = (
        figures(host.predict(path, table, from_s=1.0, to_s=4.0).to_json()) for path in (own, plain)
    )
    for signal in ("alpha_rad", "q_radps"):
        one, two = (f["free_simulation"][signal] for f in (found, expected))
        assert one["nrmse"] == pytest.approx(two["nrmse"], rel=0.03), signal
        for a, b in zip(found["windows"], expected["windows"], strict=True):
            assert a["over_persistence"][signal] == pytest.approx(
                b["over_persistence"][signal], rel=0.05
            )


@pytest.mark.usefixtures("interpreted")
def test_equations_start_from_the_trim_where_nothing_is_fitted(tmp_path: Path) -> None:
    """From the mean of 0.3 s, not from one sample, which an outlier would make another flight."""
    path = tmp_path / "own.toml"
    path.write_text(EQUATIONS, encoding="utf-8")
    table = recorded(2, noise=0.0)
    table["alpha_rad"] -= TRIM[0]
    table["elevator_rad"] += 0.04
    right = host.predict(path, table, from_s=1.0, to_s=2.5, constants=False)
    table.loc[table["t_s"].between(0.99, 1.03), "alpha_rad"] = 0.3
    found = host.predict(path, table, from_s=1.0, to_s=2.5, constants=False)
    [one], [other] = (p.simulations[0].models[0].simulated for p in (right, found))
    assert 0.0 < np.max(np.abs(other - one)) < 0.5  # 2 from one sample
    assert "nothing fitted: from the mean of the 0.3 s" in found.to_text()


@pytest.mark.usefixtures("interpreted")
def test_the_delay_of_a_command_is_held_too(tmp_path: Path) -> None:
    """It was left out: q of the record that was fitted differed by 25 in place of 4 %."""
    late = recorded(2)
    late["elevator_rad"] = np.interp(late["t_s"] + 0.06, late["t_s"], late["elevator_rad"])
    fitted, left_out = tmp_path / "fitted.toml", tmp_path / "left_out.toml"
    servo = EQUATIONS + '[[delays]]\nname = "servo_s"\noutputs = ["elevator_rad"]\n'
    left_out.write_text(servo, encoding="utf-8")
    fitted.write_text(servo + "[fit]\nservo_s = [0.06, 0.001]\n", encoding="utf-8")
    nrmse = [
        figures(host.predict(path, late, from_s=1.0, to_s=4.0).to_json())["free_simulation"][
            "q_radps"
        ]["nrmse"]
        for path in (fitted, left_out)
    ]
    assert nrmse[0] < 0.1
    assert nrmse[1] > 3.0 * nrmse[0]


def test_theil_is_what_its_definition_says() -> None:
    rng = np.random.default_rng(3)
    z, y = rng.standard_normal((200, 1)) + 2.0, 0.5 * rng.standard_normal((200, 1)) + 1.0
    [found] = theil_inequality(["x"], [z[:120], z[120:]], [y[:120], y[120:]])
    mse = np.mean((z - y) ** 2)
    assert found.coefficient == pytest.approx(
        np.sqrt(mse) / (np.sqrt(np.mean(z**2)) + np.sqrt(np.mean(y**2)))
    )
    assert found.bias == pytest.approx((z.mean() - y.mean()) ** 2 / mse)
    assert found.variance == pytest.approx((z.std() - y.std()) ** 2 / mse)
    assert found.bias + found.variance + found.covariance == pytest.approx(1.0)


def windows_by_scipy(u: np.ndarray, y: np.ndarray, steps: int) -> tuple[float, float]:
    """Return rms errors of q over all windows: the model by scipy, and held."""
    errors, held = [], []
    for k in range(0, len(y) - steps, max(1, steps // 4)):
        t = DT_S * np.arange(steps + 1)
        about = u[k : k + steps + 1] + 0.04
        _, _, x = lsim((A, B, np.eye(2), np.zeros((2, 1))), about, t, X0=y[k] - TRIM)
        errors.append((x[1:] + TRIM - y[k + 1 : k + steps + 1])[:, 1])
        held.append(y[k, 1] - y[k + 1 : k + steps + 1, 1])
    return tuple(float(np.sqrt(np.mean(np.square(e)))) for e in (errors, held))  # type: ignore


@pytest.mark.parametrize("length_s", [None, 0.1, 0.5])
def test_windows_are_those_of_scipy(length_s: float | None) -> None:
    table = recorded(4, shift=1.2)
    u, y = table[["elevator_rad"]].to_numpy(), table[["alpha_rad", "q_radps"]].to_numpy()
    own = model_from({**MODEL, "hold": "foh"})
    frozen = frozen_at(own, own.start)
    data = [Maneuver(DT_S, u, y)]
    run = free_runs(frozen, data, constants=False)[0]
    exact = type(run.biases)(-(A @ TRIM + B @ [-0.04]), np.zeros(2))
    found = window_errors(frozen, data, [{}], [exact], [run.states], length_s)
    assert found is not None
    steps = 1 if length_s is None else round(length_s / DT_S)
    model, held = windows_by_scipy(u[:, 0], y, steps)
    assert found.model[1] == pytest.approx(model, rel=1e-6)
    assert found.persistence[1] == pytest.approx(held, rel=1e-9)


def test_persistence_integrates_the_attitude() -> None:
    """A steady roll at 1 rad/s and 30 degrees of pitch: bank is predicted, at rest it is not."""
    t = DT_S * np.arange(100)
    phi = 0.2 + t
    model = model_from(
        {**MODEL, "states": ["p_radps", "phi_rad"], "outputs": ["p_radps", "phi_rad"],
         "A": [["L_p", 0], [1, 0]], "B": [["L_da"], [0]], "inputs": ["aileron_rad"],
         "parameters": {}}
    )  # fmt: skip
    frozen = frozen_at(model, model.start)
    data = [Maneuver(DT_S, np.zeros((100, 1)), np.column_stack([np.ones(100), phi]))]
    run = free_runs(frozen, data, constants=False)[0]
    flown = {"p_radps": np.ones(100), "phi_rad": phi}
    known = window_errors(frozen, data, [flown], [run.biases], [run.states], 0.5)
    unknown = window_errors(frozen, data, [{}], [run.biases], [run.states], 0.5)
    assert known is not None
    assert unknown is not None
    assert known.persistence[1] == pytest.approx(0.0, abs=1e-9)
    assert unknown.persistence[1] > 0.1


def test_simulate_of_an_identification_says_the_same(saved: Path) -> None:
    identified = host.identify(recorded(1), models="short-period", delays=False)
    [model] = identified.simulate(recorded(2)).models
    found = figures(host.predict(saved, recorded(2)).to_json())
    for fit, step in zip(model.fits, model.windows[1].relative, strict=True):
        assert found["free_simulation"][fit.name]["nrmse"] == pytest.approx(fit.nrmse, rel=1e-6)
        assert found["windows"][1]["over_persistence"][fit.name] == pytest.approx(step, rel=1e-6)


def test_the_verb_prints_free_and_one_step_apart(
    saved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other, pictures = tmp_path / "other.csv", tmp_path / "pictures"
    recorded(2).to_csv(other, index=False)
    capsys.readouterr()
    assert main(["predict", str(saved), str(other), str(other), "--plots", str(pictures)]) == 0
    out = capsys.readouterr().out
    first = out.split("\n\n")[0]
    free, step, window = (
        first.index(x) for x in ("free simulation:", "one step (", "windows from")
    )
    assert free < step < window
    assert sorted(p.name for p in pictures.iterdir()) == [
        "short-period_simulated_1.svg", "short-period_simulated_2.svg",
    ]  # fmt: skip
    assert "elevator" in (pictures / "short-period_simulated_1.svg").read_text()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ('kind = "linear"\n', "of kind 'linear', expected a linear model, equations or"),
        ("nothing", "not TOML|cannot be read|expected"),
    ],
)
def test_what_is_no_model_is_refused(tmp_path: Path, content: str, words: str) -> None:
    path = tmp_path / "m.toml"
    path.write_text(content)
    with pytest.raises(IdentificationError, match=words) as caught:
        host.predict(path, recorded(2))
    assert "\n" not in str(caught.value)


def test_a_record_without_what_the_model_needs_says_which(saved: Path) -> None:
    with pytest.raises(IdentificationError, match="needs q_radps"):
        host.predict(saved, recorded(2).drop(columns=["q_radps"]))


def test_an_aircraft_file_predicts_both_axes() -> None:
    """The aircraft that flew: short period and dutch roll come out of its file."""
    flight = virtual_flight("calm", 3, chain="none")
    found = host.predict(AIRFRAMES / "ultrastick25e.toml", flight.table, aircraft="ultrastick25e")
    [simulation] = found.simulations
    along, across = simulation.models
    assert (along.label, across.label) == ("longitudinal", "lateral")
    nrmse = {f.name: f.nrmse for m in (along, across) for f in m.fits}
    assert nrmse["q_radps"] < 0.15
    assert nrmse["p_radps"] < 0.15
    assert nrmse["r_radps"] < 0.25
    assert along.windows[1].relative[along.model.outputs.index("q_radps")] < 0.2


def test_a_slow_column_is_predicted_too(saved: Path) -> None:
    """Every fifth value of alpha repeated: it is compared where it was measured."""
    table = recorded(2)
    held = table["alpha_rad"].to_numpy()[np.arange(len(table)) // 5 * 5]
    found = figures(host.predict(saved, table.assign(alpha_rad=held)).to_json())
    assert found["free_simulation"]["alpha_rad"]["nrmse"] < 0.1
    assert found["windows"][1]["over_persistence"]["q_radps"] < 0.2


def test_derivatives_that_nobody_estimated_are_said(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    text = 'states = ["q_radps"]\ninputs = ["elevator_rad"]\noutputs = ["q_radps"]\n'
    path.write_text(text + 'A = [["M_q"]]\nB = [["M_de"]]\n[parameters]\nM_q = -9.0\n')
    found = host.predict(path, recorded(2))
    assert "held at zero, for mine.toml gives no start of them: M_de" in found.to_text()
    path.write_text(path.read_text() + "M_de = 0.0\n")
    assert "gives no start" not in host.predict(path, recorded(2)).to_text()


def test_files_in_the_wrong_order_or_empty_are_one_line(
    saved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record, empty = saved.with_name("one.csv"), tmp_path / "empty.toml"
    empty.write_text("")
    capsys.readouterr()
    for words, said in (
        ([record, saved], "the saved model is named first, behind it the records"),
        ([empty, record], "nothing in it, expected states"),
    ):
        assert main(["predict", *map(str, words)]) == 2
        err = capsys.readouterr().err
        assert said in err
        assert err.count("\n") == 1


def test_a_record_without_the_maneuver_names_those_it_has(saved: Path) -> None:
    other = recorded(2).rename(columns={"elevator_rad": "aileron_rad"})
    other["elevator_rad"] = 0.0
    with pytest.raises(IdentificationError, match="elevator_rad; found only aileron_rad"):
        host.predict(saved, other)


def test_list_shows_the_models_that_have_a_name(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A log called list was looked for."""
    monkeypatch.chdir(tmp_path)
    assert main(["predict", "list"]) == 0
    assert "thesis-eq5-11" in capsys.readouterr().out
