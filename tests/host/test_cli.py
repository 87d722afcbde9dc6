"""The command line: exit codes, one clear line per error, results on stdout."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from host.cli import main, verbs
from host.progress import progress_bar

from tests.host.logs import flight, written
from tests.host.test_original_rows import APPENDIX
from tests.protocol.flights import simple_log
from tests.protocol.log_writer import BLOCK, LogWriter

GOOD = simple_log(3.0).data()
HURT = GOOD[: 30 * BLOCK] + bytes(BLOCK) + GOOD[31 * BLOCK :]
ENVIRONMENT = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def put(name: str, data: bytes) -> Path:
    path = Path(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return path


def test_decode_needs_no_options(capsys: pytest.CaptureFixture[str]) -> None:
    put("flight.bin", GOOD)
    assert main(["decode", "flight.bin"]) == 0
    out, err = capsys.readouterr()
    for word in ("duration", "100 Hz", "jitter", "clock", "sensors", "GPS", "losses", "default"):
        assert word in out
    assert "next         host " in out
    assert err == ""
    assert Path("flight.csv").read_text().startswith("t_s,airspeed_mps,alpha_rad")
    assert main(["decode", "flight.bin"]) == 0  # again, over its own output


def test_losses_are_named_in_text_json_and_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    put("hurt.bin", HURT)
    assert main(["decode", "hurt.bin"]) == 3
    text = capsys.readouterr().out
    assert f"byte {30 * BLOCK}, {BLOCK} bytes" in text
    assert "overwritten with zeros" in text
    assert main(["decode", "hurt.bin", "--json"]) == 3
    summary = json.loads(capsys.readouterr().out)
    (loss,) = summary["losses"]["ranges"]
    assert (loss["cause"], loss["offset"], loss["length"]) == ("zeroed", 30 * BLOCK, BLOCK)
    assert 3 <= loss["frames"] <= 6
    assert loss["seconds"] == pytest.approx(loss["frames"] / 100, abs=1e-4)
    assert summary["complete"] == "damaged"


@pytest.mark.parametrize(
    ("data", "said"), [(b"", "0 bytes"), (b"no log", "6 bytes"), (bytes(5000), "intact block")]
)
def test_other_files_end_in_4(data: bytes, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    put("other.bin", data)
    for verb in ("decode", "info"):
        assert main([verb, "other.bin"]) == 4
        err = capsys.readouterr().err
        assert said in err
        assert err.count("\n") == 1
        assert "Traceback" not in err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["decode", "nowhere.bin"], "nowhere.bin: no such file"),
        (["decode", "flight.bin", "--session", "9"], "no session 9"),
        (["decode", "flight.bin", "--file-id", "1"], "no block has file id 00000001"),
        (["decode", "flight.bin", "--calibration", "no.toml"], "no.toml"),
        (["decode", "flight.bin", "-o", "x.mat", "--to", "csv"], "x.mat ends in .mat"),
        (["decode", "flight.bin", "-o", "-", "--to", "mat"], "stdout"),
        (["decode", "flight.csv", "-o", "flight.csv"], "source itself"),
        (["decode", "flight.bin", "--row-rate", "10"], "original ASCII rows"),
        (["decode", os.devnull], "a pipe or a device"),
    ],
)
def test_wrong_arguments_end_in_2(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    put("flight.bin", GOOD)
    put("flight.csv", GOOD)
    assert main(arguments) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("verb", ["info", "decode", "maneuvers", "identify", "plot", "report"])
def test_a_missing_file_is_told_before_numpy_is_loaded(verb: str) -> None:
    text = (
        f"import sys; from host.cli import main; code = main([{verb!r}, 'nowhere.bin'])\n"
        "sys.exit(100 if 'numpy' in sys.modules else code)"
    )
    ended = subprocess.run([sys.executable, "-c", text], env=ENVIRONMENT, capture_output=True)
    assert ended.returncode == 2
    assert ended.stderr.decode().splitlines() == ["host: nowhere.bin: no such file or folder"]


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["decode", "nowhere.bin", "--json"], 2),
        (["decode", "other.bin", "--json"], 4),
        (["info", "other.bin", "--json"], 4),
        (["decode", "flight.bin", "--json", "-o", "flight.bin/x.csv"], 2),
        (["decode", "flight.bin", "--json"], 0),
        (["decode", "hurt.bin", "--json"], 3),
        (["decode", "hurt.bin", "--json", "--strict"], 6),
    ],
)
def test_json_is_there_at_every_exit_code(
    arguments: list[str], code: int, capsys: pytest.CaptureFixture[str]
) -> None:
    put("flight.bin", GOOD)
    put("hurt.bin", HURT)
    put("other.bin", b"no log")
    assert main(arguments) == code
    answer = json.loads(capsys.readouterr().out)
    assert answer.get("exit_code", code) == code
    assert ("error" in answer) == (code in (2, 4))


@pytest.mark.parametrize("kind", ["csv", "parquet", "mat", "npz"])
def test_a_full_disk_is_one_line(
    kind: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    put("flight.bin", GOOD)

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("host.decode.writing.open_writer", full)
    assert main(["decode", "flight.bin", "--to", kind]) == 2
    err = capsys.readouterr().err
    assert f"flight.{kind}: cannot be written: No space left" in err
    assert err.count("\n") == 1
    assert [path.name for path in Path().iterdir()] == ["flight.bin"]


def test_an_unfinished_table_takes_no_file_of_the_users() -> None:
    put("flight.bin", GOOD)
    put("flight.part.csv", b"mine")
    assert main(["decode", "flight.bin"]) == 0
    assert Path("flight.part.csv").read_bytes() == b"mine"
    assert sorted(path.suffix for path in Path().iterdir()) == [".bin", ".csv", ".csv"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["decode", "x", "y"], "unrecognized argument y"),
        (["decode", "x", "--nonsense"], "unrecognized argument --nonsense"),
        (["decode", "x", "--calibraton=y"], "(did you mean --calibration?)"),
        (["fly"], "no verb 'fly'"),
        (["decod", "x"], "(did you mean decode?)"),
        (["simulate", "dem"], "(did you mean demo?)"),
        (["plan", "--aircraft", "ultrastik"], "(did you mean ultrastick25e?)"),
        (["identify", "x", "--method", "hopfeld"], "(did you mean hopfield?)"),
        (["identify", "x", "--model", "lateal"], "(did you mean lateral?)"),
    ],
)
def test_a_name_that_nobody_has_is_one_line_and_the_near_one(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1
    assert main([]) == 2


def test_folder_lists_its_flights_and_takes_the_newest(
    capsys: pytest.CaptureFixture[str],
) -> None:
    put("card/FLT00001.BIN", GOOD)
    newer = LogWriter(session=7)
    put("card/FLT00002.BIN", written(*flight(1.0), writer=newer))
    put("card/picture.bin", b"not one of ours")
    assert main(["decode", "card", "-o", "out/"]) == 0
    out, err = capsys.readouterr()
    assert "FLT00001.BIN" in err
    assert "-> card" in err
    assert "FLT00002.BIN" in out
    assert Path("out/FLT00002.csv").exists()
    assert main(["info", "card"]) == 0
    assert capsys.readouterr().out.count(".BIN") == 2
    Path("empty").mkdir()
    assert main(["decode", "empty"]) == 4


def test_a_file_prepared_for_the_next_flight_is_not_the_newest(
    capsys: pytest.CaptureFixture[str],
) -> None:
    prepared = LogWriter(session=9)
    prepared.schema()
    first_block = prepared.data()[:BLOCK]
    put("card/FLT00002.BIN", first_block + GOOD[BLOCK:] + bytes(100 * BLOCK))
    assert main(["decode", "card"]) == 4
    assert "no flight recorded yet" in capsys.readouterr().err
    put("card/FLT00001.BIN", GOOD)
    assert main(["decode", "card"]) == 0
    out, err = capsys.readouterr()
    assert "FLT00001.BIN" in out
    assert "FLT00002.BIN  session 9" in err
    assert "prepared, nothing recorded" in err
    assert main(["info", "card", "--json"]) == 0
    assert [one["recorded"] for one in json.loads(capsys.readouterr().out)] == [True, False]


def test_a_folder_shows_a_flight_whose_first_blocks_are_gone(
    capsys: pytest.CaptureFixture[str],
) -> None:
    put("card/FLT00001.BIN", bytes(3 * BLOCK) + GOOD[3 * BLOCK :])
    assert main(["decode", "card"]) == 3
    assert "FLT00001.BIN" in capsys.readouterr().out


def test_without_a_source_the_working_folder_is_meant(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["decode"]) == main(["info"]) == 4
    assert "no flight log in this folder" in capsys.readouterr().err
    put("FLT00003.BIN", GOOD)
    assert main(["decode"]) == 0
    assert Path("FLT00003.csv").exists()


def test_strict_ends_in_6(capsys: pytest.CaptureFixture[str]) -> None:
    streams = flight(15.0)
    rows = streams[0].rows
    for name in ("alpha", "beta", "dp"):  # both sides alike, as on an aircraft
        rows[f"{name}_b"] = rows[f"{name}_a"]
    put("flight.bin", written(*streams))
    put("hurt.bin", HURT)
    assert main(["decode", "flight.bin", "--strict"]) == 0
    assert main(["decode", "hurt.bin", "--strict"]) == 6
    rows["beta_b"] = 2000
    put("stuck.bin", written(*streams))
    assert main(["decode", "stuck.bin", "--strict"]) == 6
    assert "beta_b did not move for 15" in capsys.readouterr().out


def test_stuck_saturated_and_absent_channels_are_named(
    capsys: pytest.CaptureFixture[str],
) -> None:
    streams = flight(20.0)
    rows = streams[0].rows
    rows["alpha_a"][300:] = 1234
    rows["dp_b"][:200] = 4092
    rows["valid"] &= ~np.uint16(1 << 9)
    rows["q"][100:120] = 32767
    rows["valid"][100:120] &= ~np.uint16(1 << 11)
    put("flight.bin", written(*streams))
    assert main(["decode", "flight.bin", "--json"]) == 0
    (session,) = json.loads(capsys.readouterr().out)["sessions"]
    assert session["stuck"] == {"alpha_a": pytest.approx(17.0, abs=0.1)}
    assert session["saturated"] == {"dp_b": pytest.approx(0.1), "q": pytest.approx(0.01)}
    assert session["absent"] == {"pot_rudder": 0.0}
    assert session["imu_saturated_share"] == pytest.approx(0.01)
    assert "pot_rudder" not in session["sensors"]
    assert {"imu", "gps", "alpha_a"} <= set(session["sensors"])


def test_vanes_that_disagree_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    streams = flight(15.0)
    streams[0].rows["alpha_b"] = streams[0].rows["alpha_a"] - 400  # 100 counts, 35 deg
    put("flight.bin", written(*streams))
    assert main(["decode", "flight.bin", "--json"]) == 0
    (session,) = json.loads(capsys.readouterr().out)["sessions"]
    pair = session["pairs"]["alpha"]
    assert pair["mean_difference"] == pytest.approx(100 * 2 * np.pi / 1024, rel=1e-6)
    assert pair["deviation"] == pytest.approx(0.0, abs=1e-6)
    assert {name for name, one in session["pairs"].items() if one["disagrees"]} == {"alpha"}
    assert main(["decode", "flight.bin", "--strict"]) == 6


def test_progress_is_drawn_on_a_terminal_only(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert progress_bar("reading", 10**9) is None
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    assert progress_bar("reading", 10**6) is None
    draw = progress_bar("reading", 10**9)
    assert draw is not None
    draw(5 * 10**8, 10**9)
    draw(10**9, 10**9)
    out, err = capsys.readouterr()
    assert " 50%" in err
    assert "100%" in err
    assert out == ""


def test_original_rows(capsys: pytest.CaptureFixture[str]) -> None:
    put("rows.txt", (APPENDIX.format(1.0) * 10).encode())
    assert main(["info", "rows.txt"]) == 0
    assert "23 readings" in capsys.readouterr().out
    assert main(["decode", "rows.txt"]) == 0
    assert "row numbers over a rate: unknown" in capsys.readouterr().out
    assert len(Path("rows.csv").read_text().splitlines()) == 11
    put("rows.txt", (APPENDIX.format(1.0) * 10 + "RLL:1.00,PCH:1.").encode())
    assert main(["decode", "rows.txt", "--frames"]) == 2
    capsys.readouterr()
    put("rows.txt", (APPENDIX.format(1.0) * 10 + APPENDIX.format(1.0)[:90]).encode())
    assert main(["decode", "rows.txt", "--json"]) == 3
    summary = json.loads(capsys.readouterr().out)
    assert summary["times"] == "unknown"
    assert summary["losses"]["ranges"][0]["cause"] == "damaged_row"


def test_table_on_stdout(capfd: pytest.CaptureFixture[str]) -> None:
    put("flight.bin", GOOD)
    assert main(["decode", "flight.bin", "-o", "-"]) == 0
    out, err = capfd.readouterr()
    assert len(out.splitlines()) == 301
    assert "duration" in err


def test_info_reads_the_head_only(capsys: pytest.CaptureFixture[str]) -> None:
    path = put("flight.bin", simple_log(60.0).data())
    with path.open("r+b") as file:
        file.truncate(10 * 1024**3)
    assert main(["info", "flight.bin", "--json"]) == 0
    head = json.loads(capsys.readouterr().out)
    assert head["identity"]["firmware"] == "synthetic"
    assert head["config"]["rate_hz"] == 100
    assert head["image"] == "600d1dea"
    assert head["size_bytes"] == 10 * 1024**3
    assert main(["info", "flight.bin"]) == 0
    assert "next         host decode flight.bin" in capsys.readouterr().out


def test_missing_extra_is_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    put("flight.bin", GOOD)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.delitem(sys.modules, "host.export.parquet", raising=False)
    assert main(["decode", "flight.bin", "--to", "parquet"]) == 2
    err = capsys.readouterr().err
    assert "pip install" in err
    assert err.count("\n") == 1


def test_internal_errors_are_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    put("flight.bin", GOOD)
    monkeypatch.setattr("host.decode.decoding.summarise", lambda log: 1 // 0)
    monkeypatch.delenv("HOST_TRACEBACK", raising=False)
    assert main(["decode", "flight.bin"]) == 1
    assert "internal error: ZeroDivisionError" in capsys.readouterr().err
    monkeypatch.setattr("host.decode.decoding.summarise", interrupted)
    assert main(["decode", "flight.bin"]) == 130
    assert capsys.readouterr().err.strip() == "host: interrupted"


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_interrupted_decode_leaves_no_half_table(
    kind: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    put("flight.bin", GOOD)
    monkeypatch.setattr("host.log.flight_log.SessionTable.pieces", half_a_table)
    assert main(["decode", "flight.bin", "--to", kind]) == 130
    assert [path.name for path in Path().iterdir()] == ["flight.bin"]


def half_a_table(table: object) -> Iterator[dict[str, np.ndarray]]:
    yield {"t_s": np.zeros(3)}
    raise KeyboardInterrupt


def interrupted(log: object) -> None:
    raise KeyboardInterrupt


def test_help_lists_what_is_there_and_imports_little() -> None:
    code = (
        "import sys; from host.cli import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: pass\n"
        "print(sorted({m.split('.')[0] for m in sys.modules} & "
        "{'numpy', 'pandas', 'scipy', 'pyarrow', 'construct', 'numba'}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=ENVIRONMENT
    )
    assert done.stdout.strip().endswith("[]")
    for name, text in verbs().items():
        assert name in done.stdout
        assert text in done.stdout
    assert "3 decoded with losses" in done.stdout


def test_python_m_host() -> None:
    put("flight.bin", GOOD)
    done = subprocess.run(
        [sys.executable, "-m", "host", "info", "flight.bin"],
        capture_output=True,
        text=True,
        check=False,
        env=ENVIRONMENT,
    )
    assert done.returncode == 0, done.stderr
    assert "file id" in done.stdout


@pytest.mark.parametrize("kind", ["KeyboardInterrupt", "ValueError"])
def test_an_interrupt_that_comes_as_another_error_is_one(kind: str) -> None:
    """Compiled extensions turn the exception of Ctrl-C into one of their own."""
    program = (
        "import sys, time, host.cli as cli\n"
        "def stuck(_):\n"
        "    print('ready', flush=True)\n"
        "    try:\n"
        "        time.sleep(600)\n"
        "    except KeyboardInterrupt:\n"
        f"        raise {kind}('matrix') from None\n"
        "cli._run = stuck\n"
        "sys.exit(cli.main(['identify']))\n"
    )
    child = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    assert child.stdout.readline() == "ready\n"
    time.sleep(0.05)
    child.send_signal(signal.SIGINT)
    _, said = child.communicate(timeout=600)
    assert (child.returncode, said.strip()) == (130, "host: interrupted")
