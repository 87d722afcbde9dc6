"""The study of replanned flights compares with the better standard card, the worst case named."""

from __future__ import annotations

from pathlib import Path

import pytest
from host.live.estimates.flight_estimate import FlightEstimate
from host.planning.next_point import KnownWidth
from host.planning.wanted_widths import WANTED_PERCENT
from studies import replanning


def test_a_run_goes_on_and_takes_the_better_card(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    flown: list[tuple[int, str]] = []

    def rows(seed: int, way: str) -> list[dict[str, object]]:
        flown.append((seed, way))
        seconds = {"replanned": 30.0 + 20.0 * (seed == 6), "3-2-1-1": 50.0, "designed": 70.0}
        return [{"seed": seed, "way": way, "points": 5, "seconds": seconds[way], "reached": 1,
                 "flown": ""}]  # fmt: skip

    monkeypatch.setattr(replanning, "rows_of", rows)
    arguments = ["--rows", str(tmp_path / "rows.csv"), "--first", "5"]
    for flights in ("1", "3"):
        assert replanning.main([*arguments, "--flights", flights]) == 0
    assert [seed for seed, _ in flown] == [5, 5, 5, 6, 6, 6, 7, 7, 7]
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith("replanned over 3-2-1-1, of each flight: median 0.60, 0.60 to 1.00")
    assert last.endswith("at most 0.8 in 2 of 3")


def test_all_wanted_half_widths_are_reached_or_none() -> None:
    known = {name: KnownWidth(wanted, 1.0) for name, wanted in WANTED_PERCENT.items()}
    assert replanning.reached(FlightEstimate(0.0, (), "", {}, known=known))
    wide = known | {"Cn_r": KnownWidth(20.1, 1.0)}
    assert not replanning.reached(FlightEstimate(0.0, (), "", {}, known=wide))
    del known["Cl_p"]
    assert not replanning.reached(FlightEstimate(0.0, (), "", {}, known=known))
