"""A refusal names what is missing by the log's own word, and what mends it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from host.cli import main
from host.readers.autopilot_flight import AutopilotFlight, log_choices, read_autopilot

from tests.host.readers import changed_logs as logs
from tests.host.readers.test_clocks import assert_same

pytestmark = pytest.mark.costs(30, "the first of them flies the virtual flight, which is kept")
GIVEN = ("1=aileron", "2=elevator", "4=rudder")


def refused(path: Path, capsys: pytest.CaptureFixture[str], code: int = 6) -> str:
    """Return the one line in which identification refuses a log."""
    assert main(["identify", str(path)]) == code
    out, err = capsys.readouterr()
    assert out == ""
    (line,) = err.strip().splitlines()
    return line


def given(path: Path, *outputs: str) -> AutopilotFlight:
    return read_autopilot(path, log_choices([], outputs or GIVEN))


def passed_through(kinds: logs.Kinds) -> None:
    logs.set_parameters(SERVO1_FUNCTION=1, SERVO2_FUNCTION=52, SERVO4_FUNCTION=143)(kinds)


def test_outputs_that_are_passed_through(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A plane in whose log only the pilot's sticks reach the servos had no surfaces."""
    monkeypatch.chdir(tmp_path)
    path = logs.ardupilot(tmp_path / "through.bin", passed_through)
    line = refused(path, capsys)
    assert "SERVO1_FUNCTION = 1 (RCPassThru), SERVO2_FUNCTION = 52 (RCIN2)" in line
    assert "SERVO4_FUNCTION = 143 (RCIN4)" in line
    assert "Mend it so: --output 1=aileron --output 2=elevator --output 4=rudder" in line
    control = read_autopilot(logs.ardupilot(tmp_path / "same.bin"))
    found = given(path)
    assert_same(found, control)
    assert not found.judgement.refusal
    turned = given(path, "1=aileron", "2=-elevator", "4=rudder").channels.signals["elevator"]
    np.testing.assert_array_equal(turned.values, -control.channels.signals["elevator"].values)
    assert main(["info", str(path)]) == 0
    told = capsys.readouterr().out
    assert "now: --output 1=aileron" in told
    words = [word for one in GIVEN for word in ("--output", one)]
    assert main(["decode", str(path), *words, "--output", "table.csv"]) in (0, 3)
    assert "elevator_share" in (tmp_path / "table.csv").read_text().splitlines()[0]
    assert main(["maneuvers", str(path), *words]) == 0
    assert "elevator" in capsys.readouterr().out


def test_outputs_of_an_old_release(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Before 3.9 an output was set up as the receiver's channel, and the first four by RCMAP."""

    def old(kinds: logs.Kinds) -> None:
        letters, fields = kinds["PARM"]
        names = [bytes(n).decode().strip("\0") for n in fields["Name"]]
        values = np.array(fields["Value"])
        for k, name in enumerate(names):
            if name.startswith("SERVO") and name.endswith("_REVERSED"):
                names[k] = name.replace("SERVO", "RC").replace("REVERSED", "REV")
                values[k] = 1.0 - 2.0 * values[k]
            elif name.startswith("SERVO") and name[5].isdigit():
                names[k] = name.replace("SERVO", "RC")
        keep = [k for k, name in enumerate(names) if not name.endswith("_FUNCTION")]
        kept = {key: v[keep] for key, v in fields.items() if key not in ("Name", "Value")}
        called = np.array([names[k].encode() for k in keep], dtype="S16")
        kept |= {"Name": called, "Value": values[keep]}
        kinds["PARM"] = letters, {key: kept[key] for key in fields}

    path = logs.ardupilot(tmp_path / "old.bin", old)
    assert "no SERVO2_FUNCTION (an old release: RC2_)" in refused(path, capsys)
    control = read_autopilot(logs.ardupilot(tmp_path / "same.bin"))
    for name in ("elevator", "aileron", "rudder"):
        own, other = (f.channels.signals[name].values for f in (given(path), control))
        np.testing.assert_allclose(own, other, err_msg=name)


def test_outputs_of_a_telemetry_log_without_parameters(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    every = [
        (stamp, frame)
        for stamp, message, frame in logs.decoded(logs.frames())
        if message.get_type() != "PARAM_VALUE"
    ]
    path = logs.telemetry(tmp_path / "none.tlog", every)
    line = refused(path, capsys)
    assert "no SERVOn_FUNCTION came over the radio" in line
    assert "--output 1=aileron" in line
    assert set(given(path).shares) == {"elevator", "aileron", "rudder"}


def test_outputs_of_px4_without_a_type(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def unset(topics: logs.Topics) -> None:
        topics.pop(("vehicle_torque_setpoint", 0), None)

    control = read_autopilot(logs.px4(tmp_path / "same.ulg", unset))
    types = {k: 0 for k in control.log.parameters if k.startswith("CA_SV_CS") and "TYPE" in k}
    path = logs.px4(tmp_path / "none.ulg", unset, types)
    line = refused(path, capsys)
    assert "no CA_SV_CSn_TYPE in the log is of a surface" in line
    assert "--output 2=elevator" in line
    known = {int(name[8]): int(control.log.parameters[name]) for name in types}
    words = {3: "elevator", 4: "rudder", 1: "flaperon-left", 2: "flaperon-right", 15: "aileron"}
    found = given(path, *(f"{k + 1}={words[v]}" for k, v in known.items() if v in words))
    for name in found.shares:
        own, other = (f.channels.signals[name].values for f in (found, control))
        np.testing.assert_allclose(own, other, err_msg=name)
    assert set(found.shares) == set(control.shares)


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("2=elevatr", "no surface 'elevatr'"),
        ("40=elevator", "has no pulses of it; it has 1, 2, 3, 4"),
        ("table.csv", "expected N=SURFACE, as 2=elevator"),
    ],
)
def test_an_output_that_nobody_has(
    word: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = logs.ardupilot(tmp_path / "same.bin")
    assert main(["identify", str(path), "--output", word]) == 2
    assert said in capsys.readouterr().err


def test_rates_and_outputs_that_are_not_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def without(kinds: logs.Kinds) -> None:
        for name in ("IMU", "RCOU"):
            kinds.pop(name)
        logs.set_parameters(LOG_BITMASK=1)(kinds)

    line = refused(logs.ardupilot(tmp_path / "none.bin", without), capsys)
    assert "there is no IMU in it (rates); there is no RCOU in it (surfaces)" in line
    assert "Mend it so: LOG_BITMASK = " in line
