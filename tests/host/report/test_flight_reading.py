"""What is shown of a log: test points of `host maneuvers`, events, losses as gaps, jumps."""

import json
from pathlib import Path

import numpy as np
import pytest
from host.cli import main
from host.report.flight_reading import FlightRequest, read_flight
from host.report.shown_flight import ShownFlight, with_gaps

from tests.host.report.flights import DOUBLETS_S, JUMP_S, LOST_S

THOR = Path(__file__).parents[2] / "data" / "thor75"


def test_test_points_are_those_of_host_maneuvers(
    flight: ShownFlight, log_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["maneuvers", str(log_file), "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["maneuvers"]
    assert len(listed) == len(flight.maneuvers) >= len(DOUBLETS_S)
    for told, (item, mark) in zip(listed, flight.maneuvers, strict=True):
        assert told["start_s"] == pytest.approx(item.start_s, abs=1e-9)
        assert told["grade"] == pytest.approx(mark.score, abs=1e-9)


def test_of_original_rows_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Their vanes drop out: a column that stands still is missing, as in `host maneuvers`."""
    asked = ("--firmware", "thesis", "--seed", "31005", "--no-picture", "-o", str(tmp_path))
    assert main(["simulate", "thesis_flight1", *asked]) == 0
    rows = tmp_path / "flight.thesis.txt"
    capsys.readouterr()
    assert main(["maneuvers", str(rows), "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["maneuvers"]
    found = read_flight(FlightRequest(rows))[0].maneuvers
    assert [one["start_s"] for one in listed] == pytest.approx([item.start_s for item, _ in found])


def test_a_table_with_a_map_is_shown_as_it_is_identified(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = [str(THOR / "flight75_240_270.csv"), "--map", str(THOR / "map.toml")]
    assert main(["maneuvers", *asked, "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["maneuvers"]
    assert main(["plot", *asked, "-o", str(tmp_path / "page.html")]) == 0
    found = read_flight(FlightRequest(Path(asked[0]), mapping=Path(asked[2])))[0]
    starts = [item.start_s for item, _ in found.maneuvers]
    assert [one["start_s"] for one in listed] == pytest.approx(starts)
    assert "p_radps" in found.columns
    assert main(["plot", asked[0]]) == 2  # nobody says what its columns are


def test_a_loss_is_a_gap_and_is_listed(flight: ShownFlight) -> None:
    t_s, q = flight.t_s, flight.columns["q_radps"]
    inside = (t_s > LOST_S[0] - 0.015) & (t_s < LOST_S[1])
    assert np.isnan(q[inside]).any()
    assert any(LOST_S[0] - 0.1 < one.t_s < LOST_S[1] for one in flight.losses)


def test_jump_without_stick_is_counted_there_and_in_the_decode_summary(
    flight: ShownFlight, log_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ((at_s, channel),) = [(one.t_s, one.channel) for one in flight.jumps]
    assert channel == "elevator" and at_s == pytest.approx(JUMP_S, abs=0.03)
    main(["decode", str(log_file), "-o", str(tmp_path / "out.csv")])
    assert "JUMPS      elevator servo: 1 pulses" in capsys.readouterr().out


def test_events_say_their_word_and_their_number(flight: ShownFlight) -> None:
    texts = [one.text for one in flight.events]
    assert "session start: button" in texts and "mark: 7" in texts


def test_rows_that_follow_each_other_get_no_gap() -> None:
    t_s = np.arange(100) / 100.0
    plain = with_gaps({"t_s": t_s, "a": t_s, "empty": np.full(100, np.nan)})
    assert len(plain["t_s"]) == 100 and "empty" not in plain
    cut = np.delete(t_s, slice(40, 50))
    holed = with_gaps({"t_s": cut, "a": cut})
    assert np.isnan(holed["a"]).sum() == 1 and (np.diff(holed["t_s"]) > 0).all()
