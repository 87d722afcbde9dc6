"""`host preflight` as a pilot starts it: the sheet, the capture's events, the pre-arm check."""

import json
import tomllib
from pathlib import Path

import pytest
from host.cli import main
from host.log.capture_head import notes_path
from host.physical.calibration import load_calibration
from host.preflight.check_list import CheckListInputs, check_list, checked_aircraft
from host.preflight.preflight_sheet import read_sheet, sheet_lines, sheet_of

from tests.host.logs import ROOT
from tests.host.preflight.test_hold_check import card


def notes_of(folder: Path) -> list[dict[str, object]]:
    (capture,) = folder.glob("*.radio")
    return [json.loads(line) for line in notes_path(capture).read_text().splitlines()]


def test_a_healthy_walk_is_go_and_its_sheet_stands_beside_the_capture_and_in_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["preflight", "sim:walk@max", "--no-page", "--by", 'J. "D"']) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "GO"
    (sheet,) = tmp_path.glob("RADIO-*.preflight.toml")
    document = tomllib.loads(sheet.read_text())
    assert (document["go"], document["by"]) == (True, 'J. "D"')
    assert document["logger"] == {"board": "mega2560", "firmware": "1.0.0"}
    assert 0.8 * 25.0 < document["item"]["elevator"]["elevator_pot_up_deg"] < 1.25 * 25.0
    assert read_sheet(sheet).go
    assert sheet_lines(sheet.read_text())[0].startswith("GO: ultrastick25e")
    notes = notes_of(tmp_path)
    kinds = [note["kind"] for note in notes[1:]]
    assert kinds.count("preflight_begin") == kinds.count("preflight_sheet") == 1
    seen = [str(note["item"]) for note in notes if note.get("state") == "seen"]
    assert sorted(seen) == sorted(document["item"])
    (told,) = [note for note in notes if note.get("kind") == "preflight_sheet"]
    assert tomllib.loads(str(told["sheet"])) == document


def test_a_fault_is_no_go_with_exit_code_6_and_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    source = ["preflight", "sim:walk/surface_reversed@max", "--no-page"]
    assert main([*source, "--without", "relay=listen only"]) == 6
    said = capsys.readouterr()
    assert said.out.splitlines()[-1] == "NO-GO"
    (sheet,) = tmp_path.glob("RADIO-*.preflight.toml")
    assert any("against its stick" in why for why in read_sheet(sheet).reasons.values())
    assert "--  relay         left out: listen only" in sheet_lines(sheet.read_text())
    assert "relay" not in tomllib.loads(sheet.read_text())["item"]


def test_the_tilts_of_a_card_that_holds_are_walked_and_proven_by_the_recorder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    walked = ["preflight", "sim:walk@max", "--no-page", "--flight-card", "hold.card"]
    Path("hold.card").write_bytes(card())
    assert main(walked) == 0
    (sheet,) = tmp_path.glob("RADIO-*.preflight.toml")
    proven = tomllib.loads(sheet.read_text())["item"]["hold"]
    assert (proven["aileron_sense"], proven["elevator_sense"]) == (1.0, -1.0)
    assert 3.0 < proven["elevator_s"] - proven["aileron_s"] < 8.0
    assert [note for note in notes_of(tmp_path) if note.get("state") == "failed"] == []
    sheet.unlink()
    Path("hold.card").write_bytes(card(turned=[1]))
    assert main(walked) == 6
    assert capsys.readouterr().out.splitlines()[-1] == "NO-GO"
    (sheet,) = tmp_path.glob("RADIO-*.preflight.toml")
    assert list(read_sheet(sheet).reasons) == ["hold"]
    assert read_sheet(sheet).reasons["hold"].startswith("elevator: shown was that a longer pulse")


def test_a_measured_aircraft_is_walked_round(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was refused for its aerodynamics, of which no check asks anything."""
    monkeypatch.chdir(tmp_path)
    mine = (ROOT / "host/examples/mine.toml").read_text(encoding="utf-8")
    Path("mine.toml").write_text(mine, encoding="utf-8")
    walked = ["preflight", "sim:walk@max", "--no-page", "--aircraft", "mine.toml"]
    assert main(walked) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "GO"
    limits = "".join(f"{name}_limit_rad = 0.4\n" for name in ("elevator", "aileron", "rudder"))
    more = f'{mine}\n[surfaces]\n{limits}source = "protractor"\n'
    Path("mine.toml").write_text(more, encoding="utf-8")
    assert check_list(CheckListInputs(checked_aircraft("mine.toml"), load_calibration(None)))
    assert checked_aircraft("mine.toml").scalar("surfaces.rudder_limit_rad") == 0.4


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ((), 2, "which aircraft? --aircraft mine.toml"),
        (("sim:walk/surface_reversd",), 2, "did you mean surface_reversed?"),
        (("sim:walks", "--aircraft", "ultrastick25e"), 2, "practised with sim:walk"),
        (("sim:wlk",), 2, "practised with sim:walk"),
        (("sim:walk", "--without", "relais"), 2, "did you mean relay?"),
        (("missing.radio", "--aircraft", "ultrastick25e"), 2, "missing.radio"),
        (("sim:walk", "--aircraft", "nothing.toml"), 2, "nothing.toml"),
        (("/dev/none", "--aircraft", "ultrastick25e"), 5, "/dev/none"),
    ],
)
def test_what_is_wrong_is_one_line(
    words: tuple[str, ...], code: int, said: str, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main(["preflight", *words]) == code
    error = capsys.readouterr().err
    assert said in error
    assert len(error.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_the_list_is_printed_without_a_source(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["preflight", "--list", "--without", "vanes", "--json"]) == 0
    items = [one["item"] for one in json.loads(capsys.readouterr().out)]
    assert "rudder" in items
    assert not {"alpha_a", "beta_b"} & set(items)


def test_a_sheet_is_shown_by_host_live_and_only_a_sheet(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    main(["preflight", "sim:walk@max", "--no-page", "--sheet", "sheet.toml", "-o", "in.radio"])
    capsys.readouterr()
    live = ["live", "in.radio@max", "--no-page", "--json"]
    assert main([*live, "--preflight", "sheet.toml"]) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["go"] is True
    assert sheet_of(tmp_path / "in.radio") is None  # a replay writes nothing
    assert main([*live, "-o", "out.radio", "--preflight", "sheet.toml"]) == 0
    beside = sheet_of(tmp_path / "out.radio")
    assert beside is not None
    assert beside.read_text() == Path("sheet.toml").read_text()
    capsys.readouterr()
    assert main([*live, "--preflight", "in.radio.jsonl"]) == 2
    assert "in.radio.jsonl" in capsys.readouterr().err
