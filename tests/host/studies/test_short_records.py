"""Short records: what is flown, and what the table counts."""

from __future__ import annotations

import numpy as np
import pytest
from host.sysid.models import template
from scipy import linalg
from studies import short_records as study


def test_every_aircraft_is_stable_in_roll_and_yaw() -> None:
    for name, aircraft in study.fleet().items():
        model = template("lateral", aircraft.trim)
        A, *_ = model.matrices(np.array([aircraft.truth[p.name] for p in model.parameters]))
        fast = [root for root in linalg.eigvals(A) if abs(root) > 0.2]
        assert len(fast) == 3, name
        assert max(root.real for root in fast) < 0.0, name


def test_a_record_begins_with_its_doublet_and_ends_in_time() -> None:
    aircraft = study.fleet()["trainer"]
    columns, maneuver = study.record(aircraft, 0.0, "roll", 1.5, 3)
    assert columns["t_s"][-1] == pytest.approx(1.5 - study.DT_S)
    first = np.flatnonzero(columns["aileron_rad"])[0]
    assert columns["t_s"][first] == pytest.approx(maneuver.start_s + study.DT_S)
    assert np.all(columns["rudder_rad"] == 0.0)
    assert np.max(np.abs(columns["p_radps"])) > 0.3
    gusty, _ = study.record(aircraft, 1.0, "roll", 1.5, 3)
    assert np.std(gusty["beta_rad"] - columns["beta_rad"]) > 0.01


@pytest.mark.parametrize(("estimate", "half_width", "held"), [("-15", "1.2", 1), ("-15", "0.8", 0)])
def test_the_table_counts_what_is_relied_on(estimate: str, half_width: str, held: int) -> None:
    row = {
        "seed": "1", "aircraft": "trainer", "air": "calm", "model": "roll", "length_s": "1.5",
        "name": "L_p", "true": "-16", "estimate": estimate, "half_width": half_width,
        "mark": "trust",
    }  # fmt: skip
    refused = {**row, "name": "refused"}
    doubted = {**row, "mark": "do not rely on"}
    lines = study.table([row, doubted, refused])
    line = next(x for x in lines if x.startswith("trainer         calm              roll"))
    assert line.split()[3:6] == ["1", "of", "2"]
    assert line.split()[6:9] == [str(held), "of", "1"]
    assert line.split()[-1] == "1"
    assert lines[-1].startswith(f"of 1 relied on {held} hold")
