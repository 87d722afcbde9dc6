"""The demo sees a swap, a sign, a shift of one sample on every channel."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from host.twin.recorder.sitl_library import TICKS_PER_S, Sitl
from numpy.typing import NDArray

from tests.sitl import demo
from tests.sitl import script as scripted
from tests.sitl.bench import Bench, flight
from tests.sitl.compare import NAMES, Frames, compare

CHANNELS = (*scripted.IMU, *scripted.ANALOG, *scripted.RC)
Damage = Callable[[NDArray[np.void], int], None]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Frames:
    bench = Bench()
    flight(34.0).give(bench.sitl)
    bench.power_on_and_record(18.0)
    bench.sitl.run_until(round(20.0 * TICKS_PER_S))
    bench.stop()
    log = bench.log(tmp_path_factory.mktemp("demo"))
    return {name: log.frames[name] for name in NAMES}


def swap(ident: NDArray[np.void], channel: int) -> None:
    # With the next channel of its own kind.
    group = next(g for g in (scripted.IMU, scripted.ANALOG, scripted.RC) if CHANNELS[channel] in g)
    one, other = CHANNELS[channel], group[(group.index(CHANNELS[channel]) + 1) % len(group)]
    ident[one], ident[other] = ident[other].copy(), ident[one].copy()


def sign(ident: NDArray[np.void], channel: int) -> None:
    name = CHANNELS[channel]
    top = 0 if name in scripted.IMU else (4092 if name in scripted.ANALOG else 6000)
    ident[name] = top - ident[name]


def shift(ident: NDArray[np.void], channel: int) -> None:
    ident[CHANNELS[channel]][1:] = ident[CHANNELS[channel]][:-1].copy()


def test_untouched_log_is_as_scripted(recorded: Frames) -> None:
    assert [d for d in compare(recorded, flight(34.0)) if not d.good] == []


@pytest.mark.parametrize("damage", [swap, sign, shift])
@pytest.mark.parametrize("channel", range(len(CHANNELS)), ids=CHANNELS)
def test_damage_is_seen(recorded: Frames, damage: Damage, channel: int) -> None:
    frames = {name: frame.copy() for name, frame in recorded.items()}
    damage(frames["ident"], channel)
    wrong = {d.channel for d in compare(frames, flight(34.0)) if not d.good}
    assert CHANNELS[channel] in wrong


def test_demo_ends_well_and_may_be_run_twice(tmp_path: Path) -> None:
    command = [sys.executable, str(Path(demo.__file__)), "-o", str(tmp_path)]
    for _ in range(2):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert "losses       none" in done.stdout
        assert "all 71 channels as scripted" in done.stdout


def test_demo_fails_with_6_when_a_channel_is_not_as_scripted(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    give = scripted.Script.give

    def crossed(plan: scripted.Script, sitl: Sitl) -> None:
        plan.analog[:, [0, 1]] = plan.analog[:, [1, 0]]
        give(plan, sitl)
        plan.analog[:, [0, 1]] = plan.analog[:, [1, 0]]

    monkeypatch.setattr(scripted.Script, "give", crossed)
    monkeypatch.setattr(sys, "argv", ["demo.py", "-o", str(tmp_path)])
    assert demo.main() == 6
    assert "not as scripted: alpha_a" in capsys.readouterr().err
