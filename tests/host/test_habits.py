"""What a person is used to from a shell: completion, colours, the newest flight, a doctor."""

import io
import json
import os
import subprocess
import time
from pathlib import Path

import pytest
from host.cli import main, verbs
from host.colours import coloured, painted
from host.progress import stage, watched
from host.terminal import bar
from host.twin.outcome.compare import Deviation
from host.twin.outcome.outcome_summary import deviation_lines

from tests.host.test_original_rows import APPENDIX
from tests.protocol.flights import simple_log


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_bash_completes_verbs_options_names_and_files(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", "bash"]) == 0
    Path("host.bash").write_text(capsys.readouterr().out)
    Path("kadet.toml").write_text("")
    asked = {
        ("de",): {"decode"},
        ("simulate", "de"): {"demo"},
        ("decode", "--cal"): {"--calibration"},
        ("identify", "x.bin", "--method", "hop"): {
            "hopfield", "hopfield-line-search", "hopfield-whitened"
        },
        ("identify", "--aircraft", "kad"): {"kadetlt40", "kadet.toml"},
        ("decode", "kad"): {"kadet.toml"},
        ("completion", "z"): {"zsh"},
    }  # fmt: skip
    script = ["source host.bash"]
    for words in asked:
        line = " ".join(f"'{word}'" for word in ("host", *words))
        script.append(f"COMP_WORDS=({line}); COMP_CWORD={len(words)}; COMPREPLY=(); _shtab_host")
        script.append('echo "${COMPREPLY[@]}"')
    done = subprocess.run(
        ["bash", "-c", "\n".join(script)], capture_output=True, text=True, check=True
    )
    assert [set(line.split()) for line in done.stdout.splitlines()] == list(asked.values())


@pytest.mark.parametrize("shell", ["zsh", "fish", "tcsh", "powershell"])
def test_other_shells_get_a_script_with_every_verb(
    shell: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["completion", shell]) == 0
    said = capsys.readouterr().out
    assert all(verb in said for verb in verbs())
    assert "ultrastick25e" in said or shell == "tcsh"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("export x --to tlogg", "argument --to: no 'tlogg' (did you mean tlog?); there are tlog,"),
        ("card wite", "argument do: no 'wite' (did you mean write?)"),
        ("decode --session one", "argument --flight/--session: invalid int value: 'one'"),
        ("convert", "the following arguments are required: source, --aircraft"),
    ],
)
def test_a_wrong_argument_is_one_line_with_the_near_word(
    words: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """argparse puts the whole usage before it, and names no near word."""
    assert main(words.split()) == 2
    err = capsys.readouterr().err
    assert said in err and err.count("\n") == 1
    assert err.endswith("--help says more\n")


def test_simulate_says_degrees_where_its_files_hold_radians() -> None:
    head, row, last = deviation_lines(
        [Deviation("alpha_rad", 0.01, 0.002, 0.03, 0.015), Deviation("qbar_pa", 2.0, 1.0, 1.0, 1.0)]
    )
    assert "mean and spread" in head
    assert row.split() == ["alpha_deg", "+0.5730", "0.1146", "1.7189", "0.8594"]
    assert last.split()[:2] == ["qbar_pa", "+2.0000"] and "BEYOND" in last


def test_colours_are_for_terminals_that_want_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("WT_SESSION", "1")
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert coloured(Terminal())
    assert not coloured(io.StringIO())
    monkeypatch.setenv("NO_COLOR", "1")
    assert not coloured(Terminal())
    monkeypatch.delenv("NO_COLOR")
    monkeypatch.setenv("TERM", "dumb")
    assert not coloured(Terminal())


def test_only_beginnings_of_lines_are_painted() -> None:
    assert painted("host: no\n") == "\033[33mhost: \033[0mno\n"
    assert painted("  not known: X") == "\033[31m  not known\033[0m: X"
    assert painted("losses       none") == "losses       none"
    assert painted("a host: b") == "a host: b"


def test_the_newest_flight_is_taken_and_named(capsys: pytest.CaptureFixture[str]) -> None:
    Path("flight").mkdir()
    Path("rows.txt").write_text(APPENDIX.format(0.0) * 40)
    for verb in ("info", "decode"):
        assert main([verb]) in (0, 3)
        assert "the newest flight here: rows.txt" in capsys.readouterr().err
    Path("flight/flight.bin").write_bytes(simple_log(2.0).data())
    place = str(Path("flight/flight.bin"))
    quick = ["identify", "--model", "short-period", "--method", "equation-error"]
    for words in (["info"], ["decode"], ["maneuvers"], quick):
        main(words)
        assert f"the newest flight here: {place}" in capsys.readouterr().err


def test_the_doctor_says_what_is_set_and_by_whom(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("HOST_TRACEBACK", "1")
    assert main(["doctor", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    settings = {one["name"]: one for one in found["settings"]}
    assert settings["HOST_TRACEBACK"]["origin"] == "environment"
    assert settings["default.toml"]["origin"] == "clone"
    assert {one["name"]: one["version"] for one in found["libraries"]}["numpy"]
    assert all(one["install"] for one in found["libraries"] if not one["version"])
    assert main(["doctor"]) == 0
    said = capsys.readouterr().out
    for word in (
        "Python",
        "[parquet]",
        "charts",
        "uPlot",
        "its licence",
        "compilers",
        "port",
        "setting",
        "HOST_SITL",
    ):
        assert word in said
    monkeypatch.setenv("HOST_SITL", os.devnull + "x")
    assert main(["doctor"]) == 0
    assert "no such file" in capsys.readouterr().out


def test_a_verb_that_takes_long_says_what_it_is_at(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []
    monkeypatch.setattr("sys.stderr", Terminal())
    monkeypatch.setattr(bar, "draw", shown.append)
    monkeypatch.setattr("host.progress._PATIENCE_S", 0.0)
    monkeypatch.setattr("host.progress._TICK_S", 0.01)
    with watched("identify", shown=True):
        stage("longitudinal by filter error")
        for _ in range(500):
            if any("longitudinal" in line for line in shown):  # it ticks before the first stage
                break
            time.sleep(0.01)
    assert shown[-1].startswith("identify  longitudinal by filter error  ")
    count = len(shown)
    monkeypatch.setattr("sys.stderr", io.StringIO())
    with watched("identify", shown=True):
        time.sleep(0.05)
    assert len(shown) == count
