"""What a terminal is given: cleaned text, whole lines, commands and hints that can be pasted."""

import io
import os
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path

import pytest
from host.cli import main
from host.extras import install_hint
from host.terminal import cleaned, cleaned_streams, command_line

from host import extras, progress
from tests.host.logs import ROOT, flight, written
from tests.host.test_original_rows import APPENDIX

CLEAN_LINE = re.compile(r"[^\x00-\x08\x0b-\x1f\x7f-\x9f]*")


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def run(
    *arguments: str, stdout: int = subprocess.PIPE, more: Mapping[str, str] | None = None
) -> tuple[int, str, str]:
    """Run the program as a user does."""
    done = subprocess.run(
        [sys.executable, "-m", "host", *arguments],
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
        env={**os.environ, **(more or {})},
    )
    return done.returncode, done.stdout or "", done.stderr


def test_control_codes_and_bytes_are_shown() -> None:
    text = "\x1b[2Jred\x07\x9b\r\x7f\udce9\u202e\ttab\nline µ"
    assert cleaned(text) == r"\x1b[2Jred\x07\x9b\x0d\x7f\xe9\u202e\x09tab" + "\nline µ"
    assert CLEAN_LINE.fullmatch(cleaned("".join(map(chr, range(256))).replace("\n", "")))


def test_a_stream_of_another_encoding_takes_every_text() -> None:
    raw = io.BytesIO()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding="ascii"))
        with cleaned_streams():
            print("2 µs, caf\udce9")
            sys.stdout.flush()
        assert raw.getvalue() == rb"2 \xb5s, caf\xe9" + b"\n"


class Pending(io.StringIO):
    """A stream that keeps what it is given until it is flushed."""

    encoding = "utf-8"

    def __init__(self, screen: io.StringIO) -> None:
        super().__init__()
        self._screen = screen

    def flush(self) -> None:
        self._screen.write(self.getvalue())
        self.seek(0)
        self.truncate()


def test_a_bar_leaves_before_a_line_and_streams_keep_their_order() -> None:
    class Tty(io.StringIO):
        def isatty(self) -> bool:
            return True

    screen = Tty()  # one terminal for both
    out = Pending(screen)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "stdout", out)
        patch.setattr(sys, "stderr", screen)
        with cleaned_streams():
            print("first")
            progress.draw_share("reading", 0.5)
            print("warning", file=sys.stderr)
            print("second")
            progress.draw_share("reading", 0.7)
            sys.stdout.flush()
    assert screen.getvalue() == (
        "first\n\r\033[Kreading  [################................]  50%\r\033[Kwarning\n"
        "second\n\r\033[Kreading  [######################..........]  70%\r\033[K"
    )


@pytest.mark.parametrize(
    "name",
    ["plain.bin", "my flight.bin", "it's.bin", "$(id).bin", "a;b.bin", "-o.bin", "new\nline.bin"],
)
def test_the_next_command_can_be_pasted(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path(name).write_bytes(written(*flight(3.0)))
    Path("own one.toml").write_text((ROOT / "hw/calibration/default.toml").read_text())
    given = ["--calibration", "own one.toml"]
    assert main(["decode", f"./{name}", *given, "-o", "table.csv"]) == 0
    (line,) = [x for x in capsys.readouterr().out.splitlines() if x.startswith("next ")]
    words = subprocess.run(
        ["bash", "-c", f"printf '%s\\0' {line[13:]}"], capture_output=True, text=True, check=True
    ).stdout.split("\0")[:-1]
    assert words[:2] == ["host", "maneuvers"]
    assert Path(words[2]) == Path(name)
    assert not words[2].startswith("-")
    assert words[3:] == given
    assert main(["info", f"./{name}"]) == 0
    (line,) = [x for x in capsys.readouterr().out.splitlines() if x.startswith("next ")]
    assert line[13:].startswith("host decode ")


def test_the_next_command_of_original_rows_keeps_the_calibration(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("my rows.txt").write_text(APPENDIX.format(1.0) * 10)
    Path("own.toml").write_text((ROOT / "hw/calibration/default.toml").read_text())
    assert main(["decode", "my rows.txt", "--calibration", "own.toml"]) == 0
    (line,) = [x for x in capsys.readouterr().out.splitlines() if x.startswith("next ")]
    words = shlex.split(line[13:])
    assert words[:3] == ["host", "decode", "my rows.txt"]
    assert words[words.index("--calibration") + 1] == "own.toml"


def test_names_of_bytes_are_quoted_as_bytes() -> None:
    path = Path(os.fsdecode(b"caf\xe9 \x1b'x\\.bin"))
    printed = subprocess.run(
        ["bash", "-c", f"printf %s {command_line(path)}"], capture_output=True, check=True
    ).stdout
    assert printed == os.fsencode(path)


def test_hints_name_what_is_to_be_installed_and_nobody_elses_package(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    project = tomllib.loads((ROOT / "host/pyproject.toml").read_text())["project"]
    extras_of = project["optional-dependencies"]
    (everything,) = extras_of.pop("all")  # but a compiler of 400 MB
    assert everything == f"{project['name']}[{','.join(sorted(extras_of.keys() - {'simulate'}))}]"
    optional = [one for extra in extras_of.values() for one in extra]
    for one in optional:
        library = re.split(r"[^\w-]", one)[0]
        assert install_hint(library) == f'{shlex.quote(sys.executable)} -m pip install "{one}"'
    sources = [p for p in (ROOT / "host/src").rglob("*.py") if p.name != "extras.py"]
    for path in sources:
        assert "pip install" not in path.read_text(encoding="utf-8"), path
    monkeypatch.setattr("importlib.metadata.requires", lambda _: None)
    assert extras.install_hint("numba").endswith('-m pip install "numba"')


def test_a_folder_that_cannot_be_written_to_names_the_file_asked_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("flight.bin").write_bytes(written(*flight(3.0)))
    source = str(Path("flight.bin").absolute())
    # Folders of the kernel take no file, not even from root.
    monkeypatch.chdir("/sys")
    for arguments, name in (
        (["decode", source], "flight.csv"),
        (["decode", source, "--to", "mat"], "flight.mat"),
        (["decode", source, "--to", "npz"], "flight.npz"),
        (["decode", source, "--to", "parquet"], "flight.parquet"),
        (["decode", source, "-o", "out/x.csv"], "out/x.csv"),
        (["plan", "--save", "card.toml", "--flights", "0"], "card.toml"),
        (["simulate", "calm", "-o", "out", "--firmware", "none"], "out"),
    ):
        assert main(arguments) == 2
        said = capsys.readouterr().err
        assert said.startswith(f"host: {name}: "), said
        assert ".part" not in said
        assert re.search(r"denied|not permitted|[Rr]ead-only", said), said
        assert said.count("\n") == 1


def test_a_table_goes_to_no_pipe_or_device(capsys: pytest.CaptureFixture[str]) -> None:
    Path("flight.bin").write_bytes(written(*flight(3.0)))
    os.mkfifo("pipe")
    for place in ("pipe", os.devnull, "/dev/stdout"):
        assert main(["decode", "flight.bin", "-o", place]) == 2
        assert f"-o {place}: a pipe or a device" in capsys.readouterr().err
    assert sorted(p.name for p in Path().iterdir()) == ["flight.bin", "pipe"]


@pytest.mark.parametrize(
    "arguments",
    [["--help"], ["info", "flight.bin"], ["decode", "flight.bin"], ["decode", "flight.bin", "-o-"],
     ["simulate", "--faults"], ["identify", "--method", "list"]],
)  # fmt: skip
def test_a_reader_that_leaves_is_no_error(arguments: list[str]) -> None:
    Path("flight.bin").write_bytes(written(*flight(3.0)))
    out, into = os.pipe()
    os.close(out)
    assert run(*arguments, stdout=into)[0::2] == (0, "")
    os.close(into)


def test_closed_streams_an_old_locale_and_no_home() -> None:
    Path("flight.bin").write_bytes(written(*flight(3.0)))
    shell = f"{shlex.quote(sys.executable)} -m host info flight.bin"
    for closed, code in ((">&-", 0), ("2>&-", 0), ("<&-", 0), (">&- 2>&- <&-", 0)):
        done = subprocess.run(["bash", "-c", f"{shell} {closed}"], check=False)
        assert done.returncode == code, closed
    for more in (
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
        {"PYTHONIOENCODING": "ascii"},
        {"HOME": ""},
        {"NO_COLOR": "1", "TERM": "dumb"},
    ):
        code, out, err = run("decode", "flight.bin", more=more)
        assert (code, err) == (0, ""), more
        assert "\x1b" not in out


def test_full_standard_output_is_said() -> None:
    Path("flight.bin").write_bytes(written(*flight(3.0)))
    full = os.open("/dev/full", os.O_WRONLY)
    for arguments in (["info", "flight.bin"], ["decode", "flight.bin", "-o-"]):
        code, _, err = run(*arguments, stdout=full)
        assert code == 2
        assert "No space left" in err
        assert err.count("\n") == 1
    os.close(full)
