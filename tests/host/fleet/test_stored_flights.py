"""Twenty short flights of four aircraft through the verb, with two workers, one from S3.

`tests/data/fleet/short_flights.zip`: `host simulate tests/data/fleet/short.toml` with seeds 9100 to
9119, one Ultra Stick 25e and one instrument flown as four aircraft.
"""

import contextlib
import io
import json
import os
import re
import statistics
import time
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from host.cli import main
from host.fleet.runs import fleet_answer
from host.fleet.sources.object_store import arrow_s3

from tests.host.logs import ROOT

STORED = ROOT / "tests" / "data" / "fleet" / "short_flights.zip"
PAGE = ROOT / "host" / "FLEET.md"


@dataclass(frozen=True)
class Twice:
    """What the same command said twice, and where it keeps its rows."""

    first: dict[str, Any]
    again: dict[str, Any]
    again_said: str
    out: Path


def said(words: list[str]) -> tuple[str, str]:
    """Run the verb; return what it printed and what it said."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        assert main(words) == 0
    return out.getvalue(), err.getvalue()


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory, store: str) -> Twice:
    folder = tmp_path_factory.mktemp("stored")
    with zipfile.ZipFile(STORED) as packed:
        packed.extractall(folder / "logs")
    last = sorted((folder / "logs" / "N3").iterdir())[-1]
    with arrow_s3().open_output_stream(f"{store}/N3/{last.name}".removeprefix("s3://")) as far:
        far.write(last.read_bytes())
    last.unlink()
    words = ["fleet", str(folder / "logs"), f"{store}/N3", "--aircraft", "ultrastick25e"]
    words += ["-o", str(folder / "out"), "--workers", "2", "--json"]
    began, before = time.monotonic(), os.times()
    first, _ = said(words)
    used = sum(os.times()[:4]) - sum(before[:4])
    print(f"20 flights, two workers: {time.monotonic() - began:.1f} s, {used:.1f} s of processor")
    with pytest.MonkeyPatch.context() as patched:  # the pictures are the same ones
        patched.setattr(fleet_answer, "fleet_page", lambda *given: "")
        again, told = said(words)
    return Twice(json.loads(first), json.loads(again), told, folder / "out")


@pytest.mark.costs(30, "twenty flights by two processes, once for all below")
def test_a_fleet_of_stored_flights_is_what_was_flown(fleet: Twice) -> None:
    (found,) = fleet.first["types"]
    assert found["aircraft"] == ["N0", "N1", "N2", "N3"]
    assert found["flights"] == 20
    # As the truth of the first flight's maneuver has them.
    for name, truth in (("CL_alpha", 3.930), ("Cm_alpha", -1.729), ("Cm_de", -1.274)):
        mean = found["derivatives"][name]["mean"]
        assert mean["lower"] < truth < mean["upper"], (name, mean)
    rows = pd.read_parquet(fleet.out / "flights")
    assert len(rows) == 20
    assert set(rows["aircraft"]) == {"N0", "N1", "N2", "N3"}
    assert sum(source.startswith("s3://") for source in rows["source"]) == 1


def test_a_second_run_does_nothing_and_says_the_same(fleet: Twice) -> None:
    assert "20 of them known, 0 to do" in fleet.again_said
    assert fleet.again == fleet.first


def test_every_flight_has_zeros_of_vanes_and_a_response_of_its_elevator(fleet: Twice) -> None:
    rows = pd.read_parquet(fleet.out / "flights")
    zeros = []
    for row in rows.to_dict("records"):
        value = dict(zip(row["watched"], row["watched_values"], strict=True))
        # 25 deg by 400 us, 8 Hz: 1.09 mrad/us, 20 ms.
        assert value["elevator_slope"] == pytest.approx(1.09e-3, rel=0.1)
        assert 0.005 < value["elevator_lag_s"] < 0.04
        zeros.append(value["alpha_zero_rad"])
    # One instrument, no zero of its own; of 12 s in gusts the mean lift line is known to 0.015 rad.
    assert abs(statistics.mean(zeros)) < 0.02
    assert statistics.stdev(zeros) < 0.025


def test_the_page_s_examples_read_what_is_kept(fleet: Twice) -> None:
    import duckdb

    page = PAGE.read_text().replace("trainer/flights", str(fleet.out / "flights"))
    (python,) = re.findall(r"```python\n(.*?)```", page, re.S)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(python, str(PAGE), "exec"), {})
    assert "Cm_q" in printed.getvalue()
    (sql,) = re.findall(r"```sql\n(.*?)```", page, re.S)
    relation = duckdb.sql(sql)
    assert relation is not None
    found = relation.fetchall()
    mean = fleet.first["types"][0]["derivatives"]["Cm_q"]["mean"]["value"]
    assert sorted((name, count) for name, count, _ in found) == [(f"N{k}", 5) for k in range(4)]
    assert all(estimate == pytest.approx(mean, rel=0.3) for _, _, estimate in found)
