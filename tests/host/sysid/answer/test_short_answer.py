"""What is printed at first: the verdict, the modes, one table of a screen."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.sysid.answer import short_answer
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


def test_the_short_answer_is_a_screen(found: host.Identification) -> None:
    text = found.to_text(full=False)
    assert text == str(found)
    head, table = text.split("estimate, 95 % half-width")
    assert "trust" in head
    assert "short period:" in head
    assert "M_alpha" in table
    for left_out in ("NRMSE", "constants of each maneuver", "initial."):
        assert left_out not in text
        assert left_out in found.to_text() or left_out == "constants of each maneuver"
    assert table.rstrip().endswith(short_answer.REST)


def test_the_table_never_leaves_the_screen(
    found: host.Identification, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = short_answer.short_table(found.linear * 20, None, found.verdicts * 20)
    assert len(rows) == short_answer.MOST_LINES
    assert "more: --full" in rows[-1]


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


def test_of_two_methods_each_has_its_modes(found: host.Identification) -> None:
    alone = short_answer.mode_summary(found.linear, None)
    assert not any(" by " in line for line in alone)
    both = short_answer.mode_summary(found.linear * 2, None)
    heads = [line for line in both if line.startswith("modes, ")]
    assert len(heads) == 2 * len(found.linear) and all(" by " in line for line in heads)
