"""The study of the demonstration's card goes on where it stopped, and counts what holds."""

from pathlib import Path

import pytest
from studies import demonstration


def test_a_run_goes_on_and_counts_what_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    flown: list[int] = []

    def rows(seed: int) -> list[dict[str, object]]:
        flown.append(seed)
        return [
            {"seed": seed, "name": name, "true": -2.0, "estimate": -2.0 + 0.01 * seed,
             "half_width": 0.105}
            for name in ("Cl_p", "CY_p")
        ]  # fmt: skip

    monkeypatch.setattr(demonstration, "rows_of", rows)
    arguments = ["--rows", str(tmp_path / "rows.csv"), "--first", "9"]
    for flights in ("1", "3"):
        assert demonstration.main([*arguments, "--flights", flights]) == 0
    assert flown == [9, 10, 11]
    printed = capsys.readouterr().out.splitlines()[-3:]
    assert printed[0].startswith("Cl_p") and printed[0].endswith("2 of 3")  # seed 11 is 0.11 off
    assert printed[1:] == [
        "principal derivatives: 2 of 3 hold (66.7 %)",
        "all others: 2 of 3 hold (66.7 %)",
    ]
