"""What `host tune` takes from a log: parameters and release of the autopilot that is named."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import host.control
import pytest
from host.cli import main
from host.control import AUTOPILOTS, Tuning
from host.readers import autopilot_flight
from host.sysid import pipeline

LOG = SimpleNamespace(autopilot="ardupilot", firmware="ArduPlane V4.4.2 (0a1b2c3d)",
                      parameters={"RLL_RATE_P": 0.1})  # fmt: skip


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Return what tune is asked for; nothing is identified."""
    options: dict[str, Any] = {}

    def told(source: Any, **given: Any) -> Tuning:
        options.update(given)
        return Tuning(AUTOPILOTS[given["autopilot"]], "mine", (), ())

    monkeypatch.setattr(host.control, "tune", told)
    monkeypatch.setattr(pipeline, "identify", lambda *_, **__: None)
    monkeypatch.setattr(autopilot_flight, "is_autopilot_log", lambda _: True)
    monkeypatch.setattr(autopilot_flight, "read_autopilot", lambda _: SimpleNamespace(log=LOG))
    return options


def tune(*words: str) -> int:
    return main(["tune", "flight.bin", "--aircraft", "ultrastick25e", *words])


def test_a_logs_release_counts_and_the_one_that_is_named_before_it(asked: dict[str, Any]) -> None:
    assert tune() == 0
    assert (asked["release"], asked["parameters"]) == ("4.4", {"RLL_RATE_P": 0.1})
    assert tune("--release", "4.6") == 0
    assert (asked["release"], asked["parameters"]) == ("4.6", {"RLL_RATE_P": 0.1})


def test_a_file_of_parameters_leaves_the_logs_release(
    asked: dict[str, Any], tmp_path: Path
) -> None:
    own = tmp_path / "own.param"
    own.write_text("RLL_RATE_P,0.2\n", encoding="utf-8")
    assert tune("--parameters", str(own)) == 0
    assert (asked["release"], asked["parameters"]) == ("4.4", {"RLL_RATE_P": 0.2})


def test_a_log_of_another_autopilot_gives_neither(
    asked: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    assert tune("--for", "px4") == 0
    assert (asked["release"], asked["parameters"]) == ("", {})
    assert "is a log of ardupilot, gains are for px4" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--release", "4.0"], "before 4.1 another law flies"),
        (["--airspeed", "-3"], "airspeed -3 m/s, expected a positive number"),
        (["--for", "betaflight"], "autopilot 'betaflight', expected ardupilot, px4, inav, mega"),
    ],
)
def test_what_no_flight_answers_is_refused_before_it_is_identified(
    asked: dict[str, Any], capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    assert tune(*words) == 2
    assert not asked
    assert said in capsys.readouterr().err
