"""A coefficient stands no better than its derivative, nor than its own interval allows."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import product

import pytest
from host.sysid.aerodynamics import Coefficient
from host.sysid.answer import CAREFUL, MARKS, TRUSTED, answer_document, json_text
from host.sysid.answer.converted_marks import converted_marks
from host.sysid.answer.marks import SMALL, UNSURE
from host.sysid.answer.summary_rows import summary_rows
from host.sysid.linear import Answer
from host.sysid.pipeline.estimate_table import estimate_table

from tests.host.sysid.at_hand import identify
from tests.host.sysid.recorded import linear_flight
from tests.host.sysid.verdicts import verdict_of

WIDTHS = (0.0, 0.05, 0.0999, 0.1001, 0.3, 0.31, 2.0)


@pytest.fixture(scope="module")
def answer() -> Answer:
    flight = linear_flight("short-period", "none", "white", 1)
    [found] = identify(
        flight.columns, names=("short-period",), method="output-error",
        windows=flight.windows, user_model=flight.model,
    )  # fmt: skip
    return found


def _with(answer: Answer, share: float, name: str = "Cm_q") -> Answer:
    return replace(answer, coefficients=(Coefficient(name, -10.0, 0.1, 10.0 * share),))


@pytest.mark.parametrize(("mark", "share"), [*product(MARKS, WIDTHS)])
def test_it_is_the_worse_of_both(answer: Answer, mark: str, share: float) -> None:
    (found,) = converted_marks(_with(answer, share), {"M_q": mark}).values()
    assert MARKS.index(found) >= MARKS.index(mark)
    if share > 0.1:
        assert found != TRUSTED
    if share > 0.3:
        assert found not in (TRUSTED, CAREFUL)
    if mark == SMALL:  # judged against its row
        assert found == SMALL
    if share <= 0.1:
        assert found == mark


def test_without_a_mark_of_the_derivative_there_is_none(answer: Answer) -> None:
    assert converted_marks(_with(answer, 0.01), {}) == {}


@pytest.mark.parametrize(("share", "mark"), [(0.05, TRUSTED), (0.15, CAREFUL), (0.4, UNSURE)])
def test_table_json_and_screen_say_it(answer: Answer, share: float, mark: str) -> None:
    """The derivative is under trust; mass and inertia widen its coefficient."""
    wide = _with(answer, share)
    verdict = verdict_of(wide)
    table = estimate_table([wide], None, [verdict])
    assert table.loc[(wide.template, "M_q"), "verdict"] == TRUSTED
    assert table.loc[(wide.template, "Cm_q"), "verdict"] == mark
    document = json.loads(json_text(answer_document(wide, [], verdict)))
    assert document["coefficients"]["Cm_q"]["mark"] == mark
    (row,) = [one for one in summary_rows([wide], None, [verdict]) if one.name == "Cm_q"]
    assert row.mark == mark
    assert row.word == {TRUSTED: "good", CAREFUL: "fair", UNSURE: "not"}[mark]
