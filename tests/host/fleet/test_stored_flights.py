"""Twenty short flights of four aircraft through the verb, with two workers.

`tests/data/fleet/short_flights.zip`: `host simulate tests/data/fleet/short.toml` with seeds 9100 to
9119, one Ultra Stick 25e and one instrument flown as four aircraft.
"""

import json
import os
import time
import zipfile
from pathlib import Path

import pandas as pd
import pytest
from host.cli import main

from tests.host.logs import ROOT

STORED = ROOT / "tests" / "data" / "fleet" / "short_flights.zip"


def test_a_fleet_of_stored_flights_is_what_was_flown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    with zipfile.ZipFile(STORED) as packed:
        packed.extractall(tmp_path / "logs")
    words = ["fleet", str(tmp_path / "logs"), "--aircraft", "ultrastick25e"]
    words += ["-o", str(tmp_path / "out"), "--workers", "2", "--json"]
    began, before = time.monotonic(), os.times()
    assert main(words) == 0
    after = os.times()
    used = sum(after[:4]) - sum(before[:4])
    first = capsys.readouterr()
    print(f"20 flights, two workers: {time.monotonic() - began:.1f} s, {used:.1f} s of processor")
    (found,) = json.loads(first.out)["types"]
    assert found["aircraft"] == ["N0", "N1", "N2", "N3"]
    assert found["flights"] == 20
    # As the truth of the first flight's maneuver has them.
    for name, truth in (("CL_alpha", 3.930), ("Cm_alpha", -1.729), ("Cm_de", -1.274)):
        mean = found["derivatives"][name]["mean"]
        assert mean["lower"] < truth < mean["upper"], (name, mean)
    rows = pd.read_parquet(tmp_path / "out" / "flights")
    assert len(rows) == 20
    assert set(rows["aircraft"]) == {"N0", "N1", "N2", "N3"}
    assert main(words) == 0
    again = capsys.readouterr()
    assert "20 of them known, 0 to do" in again.err
    assert again.out.splitlines()[-1] == first.out.strip()
