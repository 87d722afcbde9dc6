"""Every answer is the frozen one, within a tolerance, and as many intervals hold the truth."""

import pytest

import host
from tests.answers.answer_record import Record
from tests.answers.case import Case
from tests.answers.cases import CASES
from tests.answers.comparison import STRICT, moved, same_text
from tests.answers.frozen_answer import fewer_hold, frozen
from tests.answers.stored_input import HERE, sums

MOST_BYTES = 10_000_000


@pytest.mark.costs(20, "an input is a whole record, as users have it")
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_answer_is_the_frozen_one(case: Case, request: pytest.FixtureRequest) -> None:
    tolerance = request.config.getoption("--tolerance")
    old, (new, answer) = frozen(case.name), case.identified_and_recorded()
    assert old is not None, f"freeze it: python -m tests.answers {case.name} --update"
    found = [*moved(old, new, tolerance), *fewer_hold(old, new, tolerance)]
    assert not found, "\n".join(found)
    if answer is not None:
        it_is_25_lines_of_80_columns(answer)


def it_is_25_lines_of_80_columns(found: host.Identification) -> None:
    """What is printed at first; each further finding or flight is one more line."""
    lines = found.to_text(full=False).split("\n")
    said = len({f.text for f in found.findings})
    assert len(lines) <= 25 + said + len(found.flights) - 1
    assert max(map(len, lines)) <= 80
    assert lines[0].startswith("Known from this flight")
    for head in ("Not known", "Fly next:", "Measure:"):
        assert sum(line.startswith(head) for line in lines) == 1, head
    shown = {line.split()[0] for line in lines}
    assert not found.findings or "Finding:" in shown
    assert not found.notes or "Note:" in shown


def test_stored_inputs_are_those_that_cases_read_and_few_bytes() -> None:
    named = {name for case in CASES for name in case.files}
    assert named == set(sums())
    stored = [path for path in HERE.rglob("*") if path.parent.name in ("inputs", "frozen")]
    assert sum(path.stat().st_size for path in stored) < MOST_BYTES
    assert {path.stem for path in stored if path.parent.name == "frozen"} == {c.name for c in CASES}


def test_numbers_in_texts_may_differ_by_their_last_digit_and_words_not_at_all() -> None:
    said = "Cn_r: they scatter 1.7 times what noise allows (3-2-1-1 on elevator)"
    assert same_text(said, said.replace("1.7", "1.8"))
    assert not same_text(said, said.replace("1.7", "1.9"))
    assert not same_text(said, said.replace("3-2-1-1", "3-2-1-2"))
    assert not same_text(said, said.replace("Cn_r", "Cn_p"))


def test_an_estimate_that_moves_by_a_billionth_of_its_width_is_seen() -> None:
    old = frozen("twin-log-calibrated")
    new = frozen("twin-log-calibrated")
    assert old is not None and new is not None
    estimates = new["answers"][0]["estimates"]
    estimates["M_alpha"][0] += 2e-9 * estimates["M_alpha"][1]
    [line] = moved(old, new, STRICT)
    assert "M_alpha" in line and "2e-09 half-widths" in line
    assert not moved(old, new, 1e-8)


def test_a_mark_may_change_only_where_its_width_is_at_a_limit() -> None:
    def marked(mark: str, half_width: float) -> Record:
        record = frozen("twin-log-calibrated")
        assert record is not None
        answer = record["answers"][0]
        answer["estimates"]["M_q"] = [-10.0, half_width]
        answer["marks"]["M_q"] = record["marks"]["longitudinal/M_q"] = mark
        return record

    assert not moved(marked("trust", 0.9995), marked("use with care", 1.0005), 1e-2)
    changed = moved(marked("trust", 0.9), marked("use with care", 0.9), 1e-2)
    assert len([line for line in changed if "M_q trust -> use with care" in line]) == 2
