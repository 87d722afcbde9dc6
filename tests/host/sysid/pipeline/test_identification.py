"""`host.identify` in a notebook: what it takes, what it gives, one flight or several."""

import json
import pickle
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.errors import HostError
from host.export.pictures import Pictures
from host.sysid.answer import MARKS, OutputPaths, read_truth, true_coefficients
from host.sysid.answer.answer_figures import draw_coefficients
from host.sysid.coefficients import standard_model
from host.sysid.linear import LinearEstimator
from host.sysid.maneuvers import maneuver_detection, maneuver_selection
from host.sysid.models import Trim, template
from host.sysid.pipeline import Identification, ReadingOptions, prepare, read_flight
from matplotlib.figure import Figure

import host
from tests.host.short_period_table import short_period_table

NAME = "ultrastick25e"
MODELS = ("longitudinal", "lateral", "coefficients")


def loose(table: object) -> Any:
    """Return a table whose cells are of any type, as a notebook takes them."""
    return table


@pytest.fixture(scope="module")
def flights(simulated: Callable[[str, int], Path]) -> tuple[Path, Path]:
    """Two flights of one card without a recorder, with what is true of each beside it."""
    return simulated("demo", 3), simulated("demo", 4)


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A table of four columns, for what is asked of any flight."""
    return short_period_table(tmp_path_factory.mktemp("small"))


@pytest.fixture(scope="module")
def one(flights: tuple[Path, Path]) -> Identification:
    return host.identify(flights[0] / "flight.csv", aircraft=NAME, models=MODELS)


@pytest.fixture(scope="module")
def both(flights: tuple[Path, Path]) -> Identification:
    sources = [folder / "flight.csv" for folder in flights]
    truths = [folder / "flight.truth.toml" for folder in flights]
    return host.identify(sources, aircraft=NAME, models=MODELS, truth=truths)


def test_it_says_what_the_verb_says(
    one: Identification,
    flights: tuple[Path, Path],
    small: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    quick = host.identify(small, aircraft=NAME, models="short-period", methods="equation-error")
    found = ["--model", "short-period", "--method", "equation-error", "--json"]
    assert main(["identify", str(small), "--aircraft", NAME, *found]) == 0
    assert capsys.readouterr().out.rstrip("\n") == quick.to_json()
    options = ["identify", str(flights[0] / "flight.csv"), "--aircraft", NAME]
    # What it prints of all models is asked, not a second time what it finds.
    monkeypatch.setattr("host.sysid.pipeline.stages.identify", lambda *_, **__: one)
    for more, said in (("--full", one.to_text()), ("--json", one.to_json()), (None, str(one))):
        assert main([*options, *([more] if more else [])]) == 0
        assert capsys.readouterr().out.rstrip("\n") == said


def test_the_table_has_every_estimate_with_its_unit(one: Identification) -> None:
    table = loose(one.table)
    assert list(table.columns[:3]) == ["value", "half_width", "unit"]
    assert set(table.index.get_level_values("model")) == set(MODELS)
    units = {"Z_alpha": "1/s", "M_alpha": "1/s2", "D_alpha": "m/s2", "M_V": "1/(m s)", "Z_q": "1"}
    for name, unit in units.items():
        assert table.loc[("longitudinal", name), "unit"] == unit
    assert table.loc[("coefficients", "Cm_q"), "unit"] == "1"
    assert table.loc[("coefficients", "delay_imu_s"), "unit"] == "s"
    document = {a["template"]: a for a in json.loads(one.to_json())["answers"]}
    for model, key in (("longitudinal", "parameters"), ("coefficients", "coefficients")):
        for name, said in document[model][key].items():
            if (model, name) in table.index:
                row = table.loc[(model, name)]
                assert (row["value"], row["half_width"]) == (said["value"], said["half_width"])
    assert set(table["verdict"]) <= {*MARKS, ""}
    judged = table.loc["coefficients"]
    assert (judged.loc[judged["verdict"] == "trust", "relative_half_width"] <= 0.1).all()
    assert judged.loc["Cn_p", "widened_by"] == "IMU tilt and vane zero about y"
    assert table.loc[("longitudinal", "Cm_de"), "widened_by"] == "Iyy"
    assert table.loc[("longitudinal", "Cm_q"), "widened_by"] == "Iyy"
    assert not table["widened_by"].str.contains("_").any()
    kinds = {"M_q": "derivative", "Cm_q": "coefficient"}
    assert {name: table.loc[("longitudinal", name), "kind"] for name in kinds} == kinds
    assert table.loc[("coefficients", "delay_imu_s"), "kind"] == "delay"


def test_the_page_has_derivatives_and_coefficients_apart(one: Identification) -> None:
    page = one._repr_html_()
    first, second = page.index("<p>derivatives</p>"), page.index("<p>coefficients</p>")
    assert first < page.index("<th>M_q</th>") < second < page.index("<th>Cm_q</th>")
    heads = [part.partition("</thead>")[0].count("<th>") for part in page.split("<thead>")[1:]]
    assert len(heads) >= 3
    assert max(heads) <= 9


def test_modes_are_a_table_too(one: Identification) -> None:
    modes = loose(one.modes)
    assert list(modes.loc["longitudinal"].index) == ["short period", "phugoid"]
    row = modes.loc[("coefficients", "short period")]
    size = float(np.hypot(row["real_1ps"], row["imaginary_radps"]))
    assert row["frequency_radps"] == pytest.approx(size)
    assert 0.0 < row["frequency_half_width_radps"] < 0.1 * size


def test_the_verdict_is_lines_and_the_answer_reads_itself(one: Identification) -> None:
    assert any(line.startswith("longitudinal: 2 maneuvers fitted, 1 kept") for line in one.verdict)
    assert all("\n" not in line for line in one.verdict)
    assert repr(one).startswith("<Identification of ")
    assert "Cm_alpha pitch stiffness" in str(one)


def test_a_table_at_hand_gives_the_same_numbers(
    one: Identification, flights: tuple[Path, Path], small: Path
) -> None:
    table = pd.read_csv(flights[0] / "flight.csv")
    found = host.identify(table, aircraft=NAME, models="longitudinal")
    assert found.flights[0].source == "table"
    ours, theirs = loose(found.table).loc["longitudinal"], loose(one.table).loc["longitudinal"]
    np.testing.assert_allclose(ours["value"], theirs["value"], rtol=1e-9)
    np.testing.assert_allclose(ours["half_width"], theirs["half_width"], rtol=1e-9)
    with_index = host.identify(
        pd.read_csv(small).set_index("t_s"), models="short-period", methods="equation-error"
    )
    assert "M_alpha" in loose(with_index.table).loc["short-period"].index


def test_a_model_at_hand_is_as_good_as_its_name(
    one: Identification, flights: tuple[Path, Path]
) -> None:
    source = flights[0] / "flight.csv"
    made = template("short-period", Trim(17.0, 0.1, 0.1))
    own, terms = replace(made, name="mine"), replace(standard_model(), name="ours")
    found = host.identify(source, aircraft=NAME, models=[own, terms], methods="output-error-white")
    assert set(found.table.index.get_level_values("model")) == {"mine", "coefficients"}
    assert "by the terms of 'ours'" in found.to_text()
    ours, theirs = loose(found.table).loc["coefficients"], loose(one.table).loc["coefficients"]
    np.testing.assert_allclose(ours["value"], theirs["value"], rtol=1e-9)


def test_several_flights_are_fitted_together(one: Identification, both: Identification) -> None:
    alone, joint = one.linear[0], both.linear[0]
    assert len(joint.used) + len(joint.held_out) == 6
    assert {m.name[-len("of flight 2") :] for m in joint.maneuvers} == {
        "of flight 1", "of flight 2",
    }  # fmt: skip
    assert not any("flight" in m.name for m in alone.maneuvers)
    document = json.loads(both.to_json())
    assert len(document["source"]) == len(document["data_compatibility"]) == 2
    direct = both.coefficients
    assert direct is not None
    assert one.coefficients is not None
    assert len(direct.windows) == 2 * len(one.coefficients.windows)
    narrow, wide = loose(both.table).loc["coefficients"], loose(one.table).loc["coefficients"]
    assert narrow.loc["CL_q", "half_width"] < 0.95 * wide.loc["CL_q", "half_width"]  # gusts
    assert narrow.loc["Cn_p", "half_width"] > 0.85 * wide.loc["Cn_p", "half_width"]  # the IMU


def test_several_flights_hold_the_truth(both: Identification, flights: tuple[Path, Path]) -> None:
    held = [c["inside"] for c in json.loads(both.to_json())["truth"]["coefficients"].values()]
    assert len(held) == 32
    assert sum(held) >= 29
    [truth, other] = [read_truth(folder / "flight.truth.toml") for folder in flights]
    merged = true_coefficients({"maneuver": truth["maneuver"] + other["maneuver"]}, "lateral")
    assert both.truth is not None
    assert true_coefficients(both.truth, "lateral") == merged


def test_the_order_of_the_flights_changes_nothing(
    both: Identification, flights: tuple[Path, Path]
) -> None:
    """The held-out maneuver once was that of the last flight: estimates moved by 0.35 widths."""
    sources = [folder / "flight.csv" for folder in reversed(flights)]
    models = ("lateral", "coefficients")
    turned = host.identify(sources, aircraft=NAME, models=models)
    assert turned.linear[0].held_out == both.linear[1].held_out
    before, after = loose(both.table).loc[list(models)], loose(turned.table).loc[list(models)]
    shift = (after["value"] - before["value"]).abs() / before["half_width"].clip(lower=1e-12)
    assert shift.max() < 1e-9
    np.testing.assert_allclose(after["half_width"], before["half_width"], rtol=1e-9)


def test_messages_name_arguments_and_the_verb_their_options(
    small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for options, words in (
        ({"models": "coefficients"}, ("argument models", "argument aircraft")),
        ({"from_s": 1.0, "maneuvers": 1}, ("argument maneuvers", "argument from_s")),
        ({"from_s": 5.0, "to_s": 5.001}, ("argument from_s 5", "argument to_s 5.001")),
    ):
        with pytest.raises(host.IdentificationError) as caught:
            host.identify(small, **options)
        assert all(word in str(caught.value) for word in words), str(caught.value)
        assert "--" not in str(caught.value)
    assert main(["identify", str(small), "--model", "coefficients"]) == 2
    said = capsys.readouterr().err
    assert "--model" in said
    assert "--aircraft" in said
    assert "argument" not in said


def test_the_verb_takes_several_flights(
    both: Identification, small: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other.csv"
    pd.read_csv(small).iloc[50:].to_csv(other, index=False)
    sources = [str(small), str(other)]
    quick = ["--model", "short-period", "--method", "equation-error", "--json"]
    assert main(["identify", *sources, *quick]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["source"] == sources
    assert {m[-len("of flight 2") :] for m in answer["answers"][0]["maneuvers"]} == {
        "of flight 1", "of flight 2",
    }  # fmt: skip
    assert both.coefficients is not None
    assert both.coefficients.maneuvers[0].endswith("of flight 1")
    drawn = draw_coefficients(
        both.coefficients, both.verdicts[-1], [f.recorded for f in both.flights]
    )
    axes = drawn["coefficients_input"].axes[0]
    moved = [float(np.max(np.asarray(line.get_ydata()))) for line in axes.get_lines()]
    count = len(both.coefficients.used)
    assert min(moved[:count]) > 0.5  # deg s: each of them is an input, not a stretch without


def test_maneuvers_are_found_once_a_flight(
    flights: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = []

    def counted(columns: Mapping[str, Any]) -> list[maneuver_detection.DetectedManeuver]:
        calls.append(1)
        return maneuver_detection.detect_maneuvers(columns)

    monkeypatch.setattr(maneuver_selection, "detect_maneuvers", counted)
    source = flights[0] / "flight.csv"
    methods = ("equation-error", "equation-error-robust")
    host.identify(source, aircraft=NAME, models=MODELS, methods=methods)
    assert len(calls) == 1


def test_a_stage_adds_and_changes_nothing_before_it(flights: tuple[Path, Path]) -> None:
    from host.sysid.pipeline import aircraft_data

    known = aircraft_data(NAME)
    flight = prepare(read_flight(flights[0] / "flight.csv", ReadingOptions(), known)).flight
    estimator = LinearEstimator("lateral", airframe=known.airframe, powerplant=known.powerplant)
    estimate = estimator.estimate([flight])
    fit = estimate.fit
    before = fit.estimate.copy(), fit.covariance.copy(), estimate.estimate.copy()
    intervals = estimator.intervals(estimate)
    validation = estimator.validation(estimate, intervals)
    answer = estimator.answer(estimate, intervals, validation)
    for ours, kept in zip((fit.estimate, fit.covariance, estimate.estimate), before, strict=True):
        np.testing.assert_array_equal(ours, kept)
    aircraft = [not name.startswith("gust_") for name in fit.names]  # what gusts do is no answer
    np.testing.assert_array_equal(answer.result.estimate, estimate.estimate[aircraft])
    assert estimate.departure is not None
    np.testing.assert_array_equal(
        (fit.estimate + estimate.departure.step)[aircraft], answer.result.estimate
    )
    # Systematic errors add to the covariance, each by what its one deviation does.
    shifts = np.stack([m.estimate - estimate.estimate for m in intervals.shifts])
    total = intervals.statistical.covariance + shifts.T @ shifts
    np.testing.assert_allclose(
        answer.result.covariance, total[np.ix_(aircraft, aircraft)], rtol=1e-12
    )


def test_another_flight_is_simulated_and_a_wrong_model_is_worse(
    one: Identification, flights: tuple[Path, Path]
) -> None:
    other = flights[1] / "flight.csv"
    found = one.simulate(other)
    assert loose(found.table).loc[("longitudinal", "q_radps"), "nrmse"] < 0.2
    assert loose(found.table).loc[("coefficients_lateral", "p_radps"), "nrmse"] < 0.25
    right = loose(found.histories).query("model == 'longitudinal' and signal == 'q_radps'")
    measured = right["measured"] - right.groupby("maneuver")["measured"].transform("mean")
    assert float(np.std(right["measured"] - right["simulated"]) / np.std(measured)) < 0.3
    answer = one.linear[0]
    wrong = answer.result.estimate.copy()
    wrong[answer.result.index("M_alpha")] *= 0.6
    spoilt = replace(answer, result=replace(answer.result, estimate=wrong))
    worse = replace(one, linear=(spoilt,), coefficients=None).simulate(other)
    name = ("longitudinal", "q_radps")
    assert loose(worse.table).loc[name, "nrmse"] > 2.0 * loose(found.table).loc[name, "nrmse"]


def test_what_was_true_is_simulated(one: Identification, flights: tuple[Path, Path]) -> None:
    """Sensors without errors: what is left is gust and model."""
    truth = pd.read_csv(flights[1] / "flight.true.csv")
    found = replace(one, aircraft=None).simulate(truth)
    for signal in ("q_radps", "alpha_rad"):
        assert loose(found.table).loc[("coefficients_longitudinal", signal), "nrmse"] < 0.25
    for signal in ("p_radps", "r_radps"):
        assert loose(found.table).loc[("coefficients_lateral", signal), "nrmse"] < 0.25


def test_pictures_are_shown_and_saved(one: Identification, tmp_path: Path) -> None:
    pictures = one.plot()
    assert isinstance(pictures, Pictures)
    assert "longitudinal_fit" in pictures
    assert "coefficients_intervals" in pictures
    assert {"longitudinal_bode", "lateral_bode"} <= set(pictures)
    assert len(pictures) == 14
    two = Pictures({name: pictures[name] for name in ("lateral_fit", "coefficients_intervals")})
    page = two._repr_html_()
    assert page.count("<img ") == page.count("data:image/svg+xml;base64,") == len(two)
    written = Pictures({"lateral_poles": pictures["lateral_poles"]}).save(tmp_path)
    assert [p.name for p in written] == ["lateral_poles.svg"]
    assert written[0].read_text().rstrip().endswith("</svg>")


def test_a_hostile_name_is_text_on_the_page(small: Path, tmp_path: Path) -> None:
    hostile = tmp_path / '<img src=x onerror="alert(1)">&\x1b[2J\u202e.csv'
    hostile.write_bytes(small.read_bytes())
    found = host.identify(hostile, models="short-period", methods="equation-error")
    simulated = found.simulate(hostile)
    noted = replace(found, notes=("<script>alert(2)</script>",))
    for page in (noted._repr_html_(), simulated._repr_html_()):
        assert "<img" not in page
        assert "\x1b" not in page
        assert "\u202e" not in page
        assert "&lt;img src=x onerror=&quot;alert(1)&quot;&gt;&amp;\\x1b[2J\\u202e.csv" in page
    assert "&lt;script&gt;alert(2)&lt;/script&gt;" in noted._repr_html_()
    assert "<script" not in noted._repr_html_()


def test_a_hostile_model_writes_into_its_folder_only(small: Path, tmp_path: Path) -> None:
    made = template("short-period", Trim(17.0, 0.1, 0.1))
    names = ("../../evil", "/evil", "Mine", "mine", "mine", "mine", "a\\b")
    models = [replace(made, name=name) for name in names]
    table = pd.read_csv(small)
    table["az_mps2"] = -9.8 - 17.0 * (6.0 * table["alpha_rad"] + 0.9 * table["elevator_rad"])
    found = host.identify(table, models=models, methods="equation-error")
    folder, saved = tmp_path / "a" / "b" / "c", tmp_path / "d" / "model.toml"
    # Names are what is asked here: empty figures are written in a tenth of the time.
    written = Pictures({name: Figure() for name in found.plot()}).save(folder)
    assert found.table.index.get_level_values("model").nunique() == len(names)
    assert {p.resolve().parent for p in written} == {folder}
    assert len({p.name.lower() for p in written}) == len(written) == 5 * len(names)
    written = found.save(OutputPaths(save_model=saved))
    assert {p.resolve().parent for p in written} == {saved.parent}
    assert len({p.name.lower() for p in written}) == len(names)


@pytest.mark.parametrize(
    ("source", "options", "said"),
    [
        ("nothing.bin", {}, "nothing.bin: no such file or folder"),
        ([], {}, "no flight given"),
        (3, {}, "flight 1 is of type int, expected a path"),
        (["x.csv", {"t_s": []}], {}, "flight 2 is of type dict"),
        ("x.csv", {"models": [3]}, "a model is of type int, expected a name"),
        ("x.csv", {"methods": 3}, "unknown method 3"),
        (pd.DataFrame({"q_radps": np.zeros(9)}), {}, "table: no column t_s"),
        (pd.DataFrame({"t_s": np.arange(99.0) / 50.0}), {}, "no column of a surface"),
        ("x.csv", {"models": "longitudnal"}, "did you mean longitudinal"),
        ("x.csv", {"models": "coefficents"}, "did you mean coefficients"),
        ("x.csv", {"models": ""}, "no model ''"),
        ("x.csv", {"methods": ["nothing"]}, "unknown method nothing"),
        ("x.csv", {"aircraft": "nobody"}, "no aircraft 'nobody'"),
        ("x.csv", {"truth": "no.toml", "calibration": "no.toml"}, "x.csv"),
        ("x.csv", {"calibration": 3}, "calibration is of type int, expected a path"),
        ("x.csv", {"mapping": {"t_s": "t"}}, "mapping is of type dict, expected a path"),
        ("x.csv", {"maneuvers": "1"}, "maneuvers is of type str, expected whole numbers"),
        ("x.csv", {"maneuvers": [1.0]}, "maneuvers is of type float, expected whole numbers"),
        ("x.csv", {"from_s": "3"}, "from_s is of type str, expected a number of seconds"),
        (
            pd.DataFrame(np.zeros((9, 2)), columns=["t_s", "t_s"]),
            {},
            "several columns 't_s'",
        ),
    ],
)
def test_an_error_is_one_line_of_our_own(
    source: Any, options: dict[str, Any], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(HostError) as caught:
        host.identify(source, **options)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_wrong_part_of_a_flight_is_said(
    one: Identification, flights: tuple[Path, Path], small: Path
) -> None:
    with pytest.raises(host.IdentificationError, match="no maneuver 99"):
        host.identify(small, maneuvers=[99])
    with pytest.raises(host.IdentificationError, match="give argument aircraft"):
        host.identify(small, models="coefficients")
    with pytest.raises(host.IdentificationError, match="no maneuver of elevator_rad"):
        replace(one, linear=one.linear[:1], coefficients=None).simulate(
            flights[1] / "flight.csv", maneuvers=5
        )
    with pytest.raises(host.IdentificationError, match="maneuvers is of type float"):
        one.simulate(flights[1] / "flight.csv", maneuvers=[5.0])  # type: ignore[list-item]
    with pytest.raises(host.IdentificationError, match="flights 1 and 2 are the same samples"):
        host.identify([small, pd.read_csv(small)])
    with pytest.raises(HostError, match=r"no\.toml: no such file"):
        host.identify(small, calibration="no.toml")
    truths = [folder / "flight.truth.toml" for folder in flights]
    with pytest.raises(host.IdentificationError, match="2 files of truth for 1 flights"):
        host.identify(small, truth=truths)


def test_several_may_be_named_in_any_collection(small: Path) -> None:
    found = host.identify(
        small, models=iter(["short-period"]), methods={"equation-error"}, maneuvers=range(1, 3)
    )
    assert [a.template for a in found.answers] == ["short-period"]
    assert found.methods == ("equation-error",)


def test_an_answer_is_kept_copied_and_compared(
    one: Identification, flights: tuple[Path, Path]
) -> None:
    """A notebook's kernel is restarted, its tables are written into."""
    kept = pickle.loads(pickle.dumps(one))
    assert kept.to_json() == one.to_json()
    other = flights[1] / "flight.csv"
    assert loose(kept.simulate(other).table).equals(loose(one.simulate(other).table))
    assert one in [kept, one]
    assert len({one, kept}) == 2
    page = one._repr_html_()
    for own in (one.table, one.modes):
        own.iloc[:, 0] = 0.0
    assert one._repr_html_() == page


def test_the_package_stays_cheap_to_import() -> None:
    heavy = "{'numpy', 'pandas', 'scipy', 'numba', 'matplotlib'}"
    code = f"import host, sys; assert not {heavy} & set(sys.modules), 'heavy'"
    subprocess.run([sys.executable, "-c", code], check=True)
    # Each takes half a second to a second of an answer that takes four.
    heavy = "{'scipy.signal', 'scipy.stats', 'pandas', 'numba', 'matplotlib'}"
    code = "import sys, host.verbs.identify, host.sysid.pipeline.stages\n"
    code += f"assert not {heavy} & set(sys.modules), {heavy} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
    for name in host.__all__:
        assert getattr(host, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'identity'"):
        host.identity  # noqa: B018
