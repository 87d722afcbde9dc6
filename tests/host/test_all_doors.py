"""Every file that some door takes at every other: an answer or one line, never our mistake."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.errors import ExitCode
from host.resources import resource
from scipy import io

from tests.host.live.radio import joined, sent
from tests.host.logs import ROOT, flight, written
from tests.host.readers.autopilot_flights import write
from tests.host.readers.hostile_ulog import hostile

DOORS: dict[str, tuple[str, ...]] = {
    "info": ("info", "FILE"),
    "decode": ("decode", "FILE"),
    "maneuvers": ("maneuvers", "FILE"),
    "identify": ("identify", "FILE", "--aircraft", "ultrastick25e"),
    "map": ("maneuvers", "table.csv", "--map", "FILE"),
    "calibration": ("decode", "flight.bin", "--calibration", "FILE"),
    "aircraft": ("maneuvers", "flight.bin", "--aircraft", "FILE"),
    "card": ("card", "check", "FILE"),
    "live": ("live", "FILE@max", "--no-page"),
    "plan": ("plan", "FILE"),
}
DOCUMENTED = {int(code) for code in ExitCode} - {int(ExitCode.INTERNAL), int(ExitCode.DEVICE)}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with one file of each kind."""
    folder = tmp_path_factory.mktemp("doors")
    (folder / "flight.bin").write_bytes(written(*flight(4.0)))
    (folder / "flight.radio").write_bytes(joined(sent(4.0)))
    for kind in ("ulog", "dataflash", "tlog"):
        (inside := folder / kind).mkdir()
        made = write(kind, inside)
        size = made.stat().st_size // 20
        (folder / f"px{made.suffix}").write_bytes(made.read_bytes()[:size])
        shutil.rmtree(inside)
    (folder / "bomb.ulg").write_bytes(hostile(20_000)["types of 1000 elements six deep"]())
    t_s = np.arange(200) * 0.02
    frame = pd.DataFrame({"t_s": t_s, "q_radps": np.sin(t_s), "elevator_rad": np.cos(t_s)})
    frame.to_csv(folder / "table.csv", index=False)
    frame.to_parquet(folder / "table.parquet")
    io.savemat(folder / "table.mat", {str(name): frame[name].to_numpy() for name in frame})
    (folder / "map.toml").write_text('[columns]\nt_s = "t_s"\nq_radps = "q_radps"\n')
    shutil.copy(resource("default.toml"), folder / "calibration.toml")
    shutil.copy(ROOT / "host/src/host/aircraft/airframes/ultrastick25e.toml", folder / "own.toml")
    (folder / "empty").write_bytes(b"")
    (folder / "noise").write_bytes(np.random.default_rng(46).bytes(5000))
    return folder


@pytest.mark.parametrize("door", DOORS)
def test_every_file_at_every_door(
    door: str,
    files: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    wrong = []
    for path in sorted(files.iterdir()):
        arguments = [word.replace("FILE", path.name) for word in DOORS[door]]
        code = main(arguments)
        said = capsys.readouterr().err
        if code not in DOCUMENTED or "internal error" in said or "Traceback" in said:
            wrong.append((path.name, code, said[-300:]))
    assert not wrong
