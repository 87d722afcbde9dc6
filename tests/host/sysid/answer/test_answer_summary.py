"""What is printed at first: 25 lines of 80 columns, the same view in every form."""

import html
import json
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.sysid.answer import CAREFUL, MARKS
from host.sysid.answer.figure_kinds import Bar, Cloud, Trace, histories, interval_bars, pole_map
from host.sysid.answer.truth_comparison import true_poles
from matplotlib.colors import to_rgba

import host


@pytest.fixture(scope="module")
def found() -> host.Identification:
    t = np.arange(0.0, 30.0, 0.02)
    de = np.zeros(len(t))
    for begin in (2.0, 11.0, 20.0):
        de += 0.06 * ((t >= begin) & (t < begin + 0.4)) - 0.06 * (
            (t >= begin + 0.4) & (t < begin + 0.8)
        )
    A, B = np.array([[-6.0, 0.95], [-150.0, -10.0]]), np.array([[-0.6], [-150.0]])
    x = simulated(A, B, de[:, None], 0.02)
    x += 2e-3 * np.random.default_rng(1).standard_normal(x.shape)
    columns = {"t_s": t, "airspeed_mps": 17.0 + 0.01 * np.sin(t), "elevator_rad": de}
    table = pd.DataFrame(columns | {"alpha_rad": x[:, 0], "q_radps": x[:, 1]})
    return host.identify(table, models="short-period", methods="output-error-white", delays=False)


def simulated(A: Any, B: Any, u: Any, dt_s: float) -> Any:
    """Return the states from rest, small Euler steps under a held input."""
    x = np.zeros((len(u), len(A)))
    for k in range(len(u) - 1):
        now = x[k]
        for _ in range(50):
            now = now + dt_s / 50.0 * (A @ now + B @ u[k])
        x[k + 1] = now
    return x


def test_every_form_has_the_same_view(found: host.Identification) -> None:
    short = found.summary_lines()
    assert str(found) == found.to_text(full=False) == "\n".join(short)
    document = json.loads(found.to_json())
    (mode,) = document["summary"]["modes"]
    assert f"  {mode['text']}" in short
    assert document["answers"][0]["modes"][0]["known"] == mode["known"]
    assert found.modes.iloc[0]["known"] == mode["known"]
    assert f"Fly next: {'; '.join(document['summary']['fly'])}" in short
    page = html.unescape(found._repr_html_())
    assert all(line in page for line in short)
    names = {row["name"]: row["called"] for row in document["summary"]["estimates"]}
    assert names["M_alpha"] == "pitch stiffness"
    assert found.table.loc[("short-period", "M_alpha"), "called"] == "pitch stiffness"
    for left_out in ("NRMSE", "initial."):
        assert left_out not in str(found)
        assert left_out in found.to_text()


def marked(found: host.Identification, **marks: str) -> Any:
    """Return the summary of an answer whose derivatives have these marks."""
    (verdict,) = found.verdicts
    return replace(found.summary, verdicts=(replace(verdict, marks=verdict.marks | marks),))


def test_the_worst_of_what_moves_it_tells_how_a_motion_is_known(found: host.Identification) -> None:
    assert found.summary.axes == {"pitch": "good"}
    assert marked(found, M_q=CAREFUL).axes == {"pitch": "fair"}
    assert marked(found, M_q=CAREFUL, M_de=MARKS[-1]).axes == {"pitch": "not"}
    assert marked(found, Z_de=MARKS[-1]).axes == {"pitch": "good"}  # it moves little
    own = replace(found.linear[0], own_model=True)
    assert "; no roll, yaw" in replace(found, linear=(own,)).summary_lines()[0]


def summary_of(found: host.Identification, answer: Any) -> Any:
    return replace(found, linear=(answer,)).summary


def test_a_wide_interval_of_noise_asks_for_larger_and_more_inputs(
    found: host.Identification,
) -> None:
    (answer,) = found.linear
    at = answer.result.index("M_q")
    estimate = answer.result.estimate.copy()
    covariance = answer.result.covariance.copy()
    covariance[at, at] = (0.45 * estimate[at] / 1.96) ** 2
    wide = replace(
        answer,
        result=replace(
            answer.result, covariance=covariance, degrees_of_freedom=np.full(len(estimate), np.inf)
        ),
        causes={"M_q": "noise and gusts"},
    )
    (advised,) = replace(found, linear=(wide,)).summary.fly
    assert (advised.surface, advised.kind) == ("elevator", "3-2-1-1")
    assert advised.amplitude_deg == 5.0  # 1.5 times 3.4 deg
    # Three inputs left 1.5 times 30 %: information must grow 2.25 times, each gives 2.25 of one.
    assert advised.count == 2
    far = tuple(replace(m, amplitude=0.3) for m in found.flights[0].maneuvers)
    (safe,) = replace(summary_of(found, wide), flown=far).fly
    assert safe.amplitude_deg == 10.0
    of_vane = replace(wide, causes={"M_q": "zero of the alpha vane"})
    summary = replace(found, linear=(of_vane,)).summary
    assert advised not in summary.fly
    assert "zero of the alpha vane (host calibrate vanes)" in summary.measure


def test_what_is_said_twice_is_counted(found: host.Identification) -> None:
    said = replace(found, notes=("late", "held", "late")).summary_lines()
    assert [line for line in said if line.startswith("Note")] == [
        "Note: late (2 times)", "Note: held",
    ]  # fmt: skip


def test_a_mode_that_is_not_predicted_is_not_to_be_relied_on(found: host.Identification) -> None:
    (answer,) = found.linear
    bad = tuple(replace(f, nrmse=2.0, ljung_box_p=0.0) for f in answer.fits)
    lost = replace(found, linear=(replace(answer, validation=bad, predictions={}),))
    (mode,) = lost.summary.modes
    assert mode.word == "not"
    assert "is not predicted" in mode.reason
    assert found.summary.modes[0].word == "good"
    (poles,) = [figure for name, figure in lost.plot().items() if name.endswith("_poles")]
    assert any("short period: do not rely on" in axis.get_title() for axis in poles.axes)


def test_a_bar_shows_which_scale_it_has() -> None:
    bars = [Bar("own", 1.0, 0.1, 1.0, marked=False), Bar("row", 0.1, 0.1, 0.5, marked=False)]
    assert [bar.of_row for bar in bars] == [False, True]
    axis = interval_bars(bars, "two").axes[0]
    points = {line.get_marker() for line in axis.get_lines()}
    assert {"o", "s"} <= points
    drawn: list[Any] = list(axis.collections)
    styles = {str(c.get_linestyle()[0][1]) for c in drawn}
    assert len(styles) == 2  # a line and dashes
    assert "squares, dashed" in axis.get_xlabel()


def test_true_poles_stand_on_the_map() -> None:
    modes: Any = [SimpleNamespace(name="short period")]
    truth = {"maneuver": [{"axes": ["elevator"], "modes": {"short_period": [10.0, 0.6]}}]}
    poles = true_poles(modes, truth, ("longitudinal",))
    assert poles["short period"] == pytest.approx(-6.0 + 8.0j)
    assert true_poles(modes, None, ("longitudinal",)) == {}
    cloud = Cloud("short period", -5.0 + 8.0j, np.full(3, -5.0), np.full(3, 8.0),
                  poles["short period"])  # fmt: skip
    overview = pole_map([cloud], "map").axes[0]
    marks = [line for line in overview.get_lines() if line.get_marker() == "D"]
    places = {tuple(np.ravel(m.get_xydata())) for m in marks}
    assert places == {(-6.0, 8.0), (-6.0, -8.0)}
    assert "simulated aircraft" in overview.get_title()


def test_what_the_fit_did_not_see_is_shaded(found: host.Identification) -> None:
    t = np.arange(5.0)
    traces = [Trace(t, t, t), Trace(t + 6.0, t, t, held_out=True)]
    over, under = histories({"q_radps": traces}, "two").axes
    for axis in (over, under):
        shade: Any = axis.patches[0]
        assert shade.get_facecolor() == to_rgba("#fdf3dc")
        assert shade.get_x() == 6.0
    (answer,) = found.linear
    assert len(answer.held_out_runs) == len(answer.held_out)
