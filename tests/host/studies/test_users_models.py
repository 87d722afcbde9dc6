"""The study of users' models goes on where it stopped, and counts what holds."""

from pathlib import Path

import pytest
from studies import users_models


def test_a_run_goes_on_and_compares_with_the_best(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    flown: list[tuple[str, int]] = []

    def rows(noise: str, seed: int) -> list[dict[str, object]]:
        flown.append((noise, seed))
        off = {"flight": 0.2, "output-error": 0.1}
        return [
            dict(zip(users_models.COLUMNS, (noise, seed, m, "output-error", "M_q", -10.0,
                                            -10.0 + off.get(m, 0.4), 0.3), strict=True))
            for m in users_models.METHODS
        ]  # fmt: skip

    monkeypatch.setattr(users_models, "rows_of", rows)
    arguments = ["--rows", str(tmp_path / "rows.csv"), "--first", "9"]
    for flights in ("1", "2"):
        assert users_models.main([*arguments, "--flights", flights]) == 0
    assert flown == [(n, seed) for seed in (9, 10) for n in users_models.NOISES]
    line = next(x for x in capsys.readouterr().out.splitlines()[-13:] if x.startswith("gust"))
    assert line.split()[2:] == ["4.00", "3.00", "7.67", "0.0"]
