"""`host simulate --to`: the same flight as other autopilots had logged it, and our own log."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from host.cli import main
from host.errors import UsageError
from host.export.toml import dumps
from host.readers.autopilot_flight import read_autopilot
from host.twin.outcome.autopilot_logs import NAMES

from tests.host.readers.autopilot_flights import CARD, flown, write


def test_simulate_writes_every_format_beside_its_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card = tmp_path / "card.toml"
    short = {**CARD, "segment": CARD["segment"][:2]}  # type: ignore[index]
    card.write_text(dumps(short))
    assert tomllib.loads(card.read_text())["aircraft"] == "ultrastick25e"
    folder = tmp_path / "flight"
    asked = [word for kind in NAMES for word in ("--to", kind)]
    command = ["simulate", str(card), "-o", str(folder), "--firmware", "none", "--no-picture"]
    assert main([*command, *asked, "--outputs", "vtail"]) == 0
    out = capsys.readouterr().out
    for ending in NAMES.values():
        assert f"flight{ending}" in out
        found = read_autopilot(folder / f"flight{ending}")
        assert found.shares == ("elevator", "aileron", "rudder")
        assert "V-tail" in " ".join(found.channels.notes)


def test_the_same_flight_is_the_same_bytes(tmp_path: Path) -> None:
    for kind in NAMES:
        (tmp_path / "again").mkdir(exist_ok=True)
        first, second = write(kind, tmp_path), write(kind, tmp_path / "again")
        assert first.read_bytes() == second.read_bytes()


def test_an_airframe_that_is_none(tmp_path: Path) -> None:
    flown()
    with pytest.raises(UsageError, match="expected one of conventional, elevons, vtail"):
        write("ulog", tmp_path, "canard")
