"""Every input of the field through every verb: no traceback, the documented code, the cause said.

What is right for an input is that of its control, an unchanged log or table, but where its row says
otherwise.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from host.cli import main

from tests.campaign import every_nth
from tests.host.readers.field_inputs import INPUTS

pytestmark = pytest.mark.costs(30, "the first of them flies the virtual flight, which is kept")


@dataclass(frozen=True)
class Right:
    """What an input must come to.

    Parameters
    ----------
    control : str
        Whose answer it has.
    said : str
        What `maneuvers`, `info` or `identify` says of it.
    code : int
        In which `maneuvers`, `identify` and `report` end; `info` and `decode` are for tables 4.
    options : tuple of str
    within : float
        Share of the control's half-width that an estimate may be from the control's.
    """

    control: str
    said: str = ""
    code: int = 0
    options: tuple[str, ...] = ()
    within: float = 0.02


PX4, AP, TLOG, TABLE = "px4_same.ulg", "ap_same.bin", "tlog_same.tlog", "same.csv"
OUTPUTS = ("--output", "1=aileron", "--output", "2=elevator", "--output", "4=rudder")
RIGHT = {
    PX4: Right(PX4),
    "px4_synthetic_airspeed.ulg": Right(PX4, "airspeed is no pitot's from"),
    "px4_unix_time.ulg": Right(PX4),
    "px4_gps_before_only.ulg": Right(PX4, within=0.2),
    AP: Right(AP),
    "ap_two_boots.bin": Right(AP, "used, of 2 in this log"),
    "ap_passthrough.bin": Right(AP, "SERVO2_FUNCTION = 1 (RCPassThru)", 6),
    "ap_same_name.bin": Right(AP, "ATT is defined twice"),
    TLOG: Right(TLOG),
    "tlog_gimbal.tlog": Right(TLOG, "component 154 of the vehicle sends ATTITUDE too"),
    "tlog_two_flights.tlog": Right(TLOG, "used, of 2 in this log"),
    TABLE: Right(TABLE),
    "header_trailing.csv": Right(TABLE),
    "glued_rows.csv": Right(TABLE, "rows have another width", within=0.2),
    "micros_wrap.csv": Right(TABLE, "begins again once", options=("--map", "micros_wrap.toml")),
    "coarse_time.csv": Right(TABLE, "digits of 0.1 s", within=0.2),
}


@cache
def folder() -> TemporaryDirectory[str]:
    return TemporaryDirectory()


def written(name: str) -> Path:
    path = Path(folder().name) / name
    if not path.is_file():
        INPUTS[name](path)
    return path


@cache
def identified(name: str, options: tuple[str, ...]) -> dict[str, Any]:
    """Return the answer on the roll axis as JSON says it, or why there is none."""
    import contextlib
    import io

    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.chdir(folder().name):
        code = main(["identify", str(written(name)), "--model", "roll", "--json", *options])
    found: dict[str, Any] = json.loads(out.getvalue())
    assert found.get("exit_code", 0) == code
    return found


def test_every_input_has_its_row() -> None:
    assert set(RIGHT) | {"aileron_rudder_swapped.csv"} == set(INPUTS)


@pytest.mark.parametrize("name", sorted(RIGHT))
def test_an_input_of_the_field(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    right, path = RIGHT[name], str(written(name))
    monkeypatch.chdir(folder().name)
    table = path.endswith(".csv")
    for words in (["info", path], ["decode", path, "-o", "table.csv"]):
        assert main(words) == (4 if table else 0)
        said = "".join(capsys.readouterr())
        assert "internal error" not in said
        assert not table or f"a table, not a log; `host maneuvers {path}` reads it" in said
    assert main(["maneuvers", path, *right.options]) == right.code
    told = "".join(capsys.readouterr())
    assert right.said in told
    answer = identified(name, right.options)
    if right.code:
        assert right.said in answer["error"]
        assert answer["exit_code"] == right.code
        assert main(["report", path]) == right.code
        answer = identified(name, OUTPUTS)
    control = identified(right.control, ())
    for parameter in ("L_p", "L_da"):
        own, other = (one["answers"][0]["parameters"][parameter] for one in (answer, control))
        moved = abs(own["value"] - other["value"])
        assert moved <= right.within * other["half_width"], parameter
        assert own["half_width"] >= 0.98 * other["half_width"], parameter


@pytest.mark.parametrize("name", every_nth(["tlog_two_flights.tlog", AP, "micros_wrap.csv"], 3))
def test_a_report_of_an_input(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The others come to the same answer, on a page of the same making."""
    path, options = str(written(name)), RIGHT[name].options
    monkeypatch.chdir(folder().name)
    words = ["--model", "roll", "--method", "output-error", "-o", "report.html"]
    assert main(["report", path, *words, *options]) == 0
    assert Path("report.html").stat().st_size > 1e5


def test_two_surfaces_that_are_exchanged() -> None:
    """What the aileron does is refused, and usable where each column is its own."""
    answer = identified("aileron_rudder_swapped.csv", ())
    control = identified(TABLE, ())
    marks = [one["answers"][0]["marks"]["L_da"]["mark"] for one in (answer, control)]
    assert marks == ["do not use", "use with care"]
