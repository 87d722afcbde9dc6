"""What a user points at by mistake: every verb says in one line what it found, and never hangs."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from host.cli import main
from host.errors import UsageError
from host.files.user_text import MOST_VALUES

import host
from tests.host.logs import flight, written

# Every argument that names a file to read; {} is the file.
READ_BY = {
    "decode": ["decode", "{}"],
    "decode --calibration": ["decode", "flight.bin", "--calibration", "{}"],
    "info": ["info", "{}"],
    "maneuvers": ["maneuvers", "{}"],
    "maneuvers --map": ["maneuvers", "flight.csv", "--map", "{}"],
    "maneuvers --calibration": ["maneuvers", "flight.bin", "--calibration", "{}"],
    "identify": ["identify", "{}"],
    "identify --map": ["identify", "flight.csv", "--map", "{}"],
    "identify --calibration": ["identify", "flight.bin", "--calibration", "{}"],
    "identify --model": ["identify", "flight.bin", "--model", "{}"],
    "identify --aircraft": ["identify", "flight.bin", "--aircraft", "{}"],
    "identify --truth": ["identify", "flight.bin", "--truth", "{}"],
    "identify --prior": ["identify", "flight.bin", "--aircraft", "ultrastick25e", "--prior", "{}"],
    "convert": ["convert", "{}", "--aircraft", "ultrastick25e"],
    "convert --aircraft": ["convert", "prior.toml", "--aircraft", "{}"],
    "simulate": ["simulate", "{}"],
    "simulate --aircraft": ["simulate", "calm", "--aircraft", "{}"],
    "plan": ["plan", "{}"],
    "plan --aircraft": ["plan", "--aircraft", "{}"],
}
FOLDERS = {"decode", "info", "maneuvers", "identify"}  # a folder is a card with flights


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("flight.bin").write_bytes(written(*flight(3.0)))
    Path("flight.csv").write_text("t_s,q_radps\n" + "".join(f"{k / 50},0\n" for k in range(99)))
    Path("prior.toml").write_text("[coefficients]\nCm_q = -10.0\n")


@pytest.fixture
def device(request: pytest.FixtureRequest) -> Iterator[str]:
    """A pipe that nobody writes to, a device that never ends, one that ends at once."""
    kind = str(request.param)
    if kind == "pipe":
        os.mkfifo("pipe.toml")
        yield "pipe.toml"
    elif kind == "substituted":  # as the shell's <(command)
        out, into = os.pipe()
        yield f"/dev/fd/{out}"
        os.close(out)
        os.close(into)
    else:
        Path("device.toml").symlink_to(kind)
        yield "device.toml"


def ended(arguments: list[str], file: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """Run a verb on a file; return its exit code and the one line it said."""
    capsys.readouterr()
    code = main([file if word == "{}" else word for word in arguments])
    said = capsys.readouterr().err
    assert "internal error" not in said
    assert said.count("\n") == 1, said
    return code, said


@pytest.mark.parametrize("arguments", READ_BY.values(), ids=READ_BY)
@pytest.mark.parametrize("device", ["pipe", "substituted", "/dev/null", "/dev/zero"], indirect=True)
def test_pipes_and_devices_are_refused_unread(
    arguments: list[str], device: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, said = ended(arguments, device, capsys)
    assert code == 2
    assert device in said
    assert "a pipe or a device" in said


@pytest.mark.parametrize(("name", "arguments"), READ_BY.items(), ids=READ_BY)
def test_missing_empty_binary_and_folder(
    name: str, arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    Path("empty.toml").touch()
    Path("binary.toml").write_bytes(bytes(range(256)) * 9)
    Path("folder.toml").mkdir()
    for file in ("missing.toml", "empty.toml", "binary.toml", "folder.toml"):
        code, said = ended(arguments, file, capsys)
        assert code in (2, 4), (file, said)
        if not (file == "folder.toml" and name in FOLDERS):
            assert Path(file).stem in said, (file, said)


@pytest.mark.parametrize("name", sorted(READ_BY.keys() - FOLDERS))
def test_a_text_beyond_all_bounds(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = READ_BY[name]
    texts = {
        "deep lists": "x = " + "[" * 5000 + "]" * 5000,
        "deep tables": "[" + ".".join("a" * 3000) + "]\n",
        "inner tables": "x = " + "{a=" * 900 + "1" + "}" * 900,
        "digits": "format = 1" + "0" * 5000,
        "a large integer": "format = 1" + "0" * 400,
        "no number": "format = nan",
        "a long text": f'name = "{"x" * 30_000}"',
    }
    for what, text in texts.items():
        Path("beyond.toml").write_text(text)
        code, said = ended(arguments, "beyond.toml", capsys)
        assert code == 2, (what, said)
        assert "beyond" in said, (what, said)
    with Path("beyond.toml").open("wb") as file:
        file.truncate(3 << 30)
    code, said = ended(arguments, "beyond.toml", capsys)
    assert (code, "larger than" in said) == (2, True), said


def test_more_values_than_any_file_has(capsys: pytest.CaptureFixture[str]) -> None:
    """Counted where the texts above are, by the one reader of all verbs: half a second each."""
    Path("beyond.toml").write_text("x = [" + "1," * MOST_VALUES + "]")
    code, said = ended(READ_BY["plan"], "beyond.toml", capsys)
    assert code == 2
    assert "beyond" in said


def test_names_that_are_no_utf8_or_control_the_terminal(
    capsysbinary: pytest.CaptureFixture[bytes],
) -> None:
    data = Path("flight.bin").read_bytes()
    for name in (b"caf\xe9.bin", b"\x1b[2Jred.bin", b"two\nlines.bin", "a\u202eb.bin".encode()):
        path = Path(os.fsdecode(name))
        path.write_bytes(data)
        for verb in (["info"], ["decode"], ["info", "--json"]):
            assert main([verb[0], str(path), *verb[1:]]) == 0
            out, err = capsysbinary.readouterr()
            for stream in (out, err):
                text = stream.decode("utf-8")  # nothing else goes out
                assert "\x1b" not in text
                assert "\u202e" not in text
        assert main(["decode", f"{path}.missing"]) == 2
        assert capsysbinary.readouterr()[1].count(b"\n") == 1


def test_the_library_reads_no_pipe_either() -> None:
    os.mkfifo("pipe")
    for path in ("pipe", "/dev/zero", os.devnull):
        with pytest.raises(UsageError, match="a pipe or a device"):
            host.read_log(path)


@pytest.mark.parametrize(
    ("option", "value"),
    [("airspeed", "1e300"), ("airspeed", "nan"), ("density", "1e300"), ("density", "0"),
     ("alpha", "90"), ("alpha", "inf")],
)  # fmt: skip
def test_a_flight_condition_that_cannot_be(
    option: str, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["convert", "prior.toml", "--aircraft", "ultrastick25e", f"--{option}", value]
    assert main(given) == 2
    said = capsys.readouterr().err
    assert f"--{option} is {value.replace('e3', 'e+3')}" in said
    assert said.count("\n") == 1
