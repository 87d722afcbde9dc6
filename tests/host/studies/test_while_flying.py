"""The study of estimates while flying counts what holds, what agrees, and how wide it is."""

from __future__ import annotations

from pathlib import Path

import pytest
from studies import one_cycle, while_flying


def row(seed: int, kind: str, estimate: float, half: float, **other: object) -> dict[str, object]:
    """Return a row about a true Cm_alpha of -1.0."""
    common = {"air": "gusts", "loss": 0.0, "points": 1, "name": "Cm_alpha", "true": -1.0}
    return common | {
        "seed": seed, "kind": kind, "estimate": estimate, "half_width": half, "cpu_s": 0.3
    } | other  # fmt: skip


def test_a_run_goes_on_and_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    flown: list[tuple[str, int, bool]] = []

    def rows(air: str, seed: int, with_default: bool) -> list[dict[str, object]]:
        flown.append((air, seed, with_default))
        if air == "still":
            return [row(seed, "live", -1.08, 0.1, air="still", name="M_alpha")]
        return [
            row(seed, "live", -1.0 - 0.06 * (seed - 9), 0.1),  # of the third 0.12 off
            row(seed, "card", -0.95, 0.05, points=0),
        ]

    monkeypatch.setattr(while_flying, "rows_of", rows)
    arguments = ["--rows", str(tmp_path / "rows.csv"), "--first", "9"]
    for flights in ("1", "3"):
        assert while_flying.main([*arguments, "--flights", flights]) == 0
    assert [(air, seed) for air, seed, _ in flown] == [
        (air, seed) for seed in (9, 10, 11) for air in ("gusts", "still")
    ]
    said = capsys.readouterr().out.splitlines()
    said = said[len(said) // 2 :]
    whole = next(line for line in said if line.startswith("0.00"))
    assert "2 of     3" in whole  # hold the truth
    assert "card     2 of     3" in whole  # 0.17 apart, of 0.112
    assert any("M_alpha" in line and "8.0 %" in line for line in said)


def test_errors_after_cycles_are_medians() -> None:
    rows = [
        {"seed": seed, "rate_hz": rate, "cycles": cycles, "name": name, "true": "-10.0",
         "estimate": str(-10.0 - seed)}
        for seed in (1, 2, 9) for rate in ("20", "100") for cycles in ("1", "2", "4", "12")
        for name in ("M_alpha", "M_q")
    ]  # fmt: skip
    table = one_cycle.table(rows)  # type: ignore[arg-type]
    assert len(table) == 5
    assert all(line.split()[2:] == ["20"] * 4 for line in table[1:])
