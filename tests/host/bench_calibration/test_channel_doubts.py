"""Faults are named in one sentence, healthy instruments are not accused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from host.bench_calibration.bench_plan import subjects
from host.bench_calibration.calibrated_lines import calibrated_lines
from host.bench_calibration.hard_iron import hard_iron, rounded
from host.bench_calibration.held_position import Held
from host.bench_calibration.six_faces import crooked_deg, crooked_doubt, face_held
from host.bench_calibration.supply_reference import supply_reference
from host.bench_calibration.turned_gyro import Rest, Turn, gyro_lines
from host.constants import GRAVITY_MPS2
from host.errors import UsageError
from studies.bench_instruments import FAULTS, bench_channels
from studies.calibration_honesty import study


@pytest.fixture(scope="module")
def held() -> dict[str, list[Held]]:
    """Return one healthy instrument's readings by channel."""
    return {c.channel: list(c.held) for c in bench_channels(np.random.default_rng(77))}


def _doubt(subject: str, points: list[Held]) -> str:
    (found,) = calibrated_lines(subjects()[subject], points)
    return found.doubt or ""


def _changed(points: list[Held], channel: str, change: object) -> list[Held]:
    assert callable(change)
    return [
        replace(p, readings={**p.readings, channel: change(p, p.readings[channel])}) for p in points
    ]


def test_a_few_instruments_hold_and_every_fault_is_named() -> None:
    """The study's own loop; its figures are of 200 instruments."""
    tally = study(range(301, 309))
    inside, count = tally.covered(*tally.zero)
    assert inside / count > 0.90
    assert tally.accused == 0, tally.sentences
    assert [tally.named[f] for f in FAULTS] == [8] * len(FAULTS), tally.sentences


def test_hoses_on_the_wrong_ports(held: dict[str, list[Held]]) -> None:
    sick = _changed(held["dp_a"], "dp_a", lambda p, raw: 1024.0 - raw)
    assert _doubt("pitots", sick) == (
        "dp_a falls where it should rise: total and static hoses are swapped"
    )


def test_a_dead_channel(held: dict[str, list[Held]]) -> None:
    sick = _changed(held["beta_a"], "beta_a", lambda p, raw: 512.3)
    assert _doubt("vanes", sick).startswith("beta_a does not follow: 0.0 counts where 221")


def test_a_vane_that_slips_within_a_repeat(held: dict[str, list[Held]]) -> None:
    def slip(p: Held, raw: float) -> float:
        late = p.repeat == 2 and held["alpha_a"].index(p) % 17 > 11
        return raw + (25.0 if late or p.repeat == 3 else 0.0)

    points = held["alpha_a"]
    sick = [
        replace(p, readings={**p.readings, "alpha_a": slip(p, p.readings["alpha_a"])})
        for p in points
    ]
    assert _doubt("vanes", sick).startswith("alpha_a slipped")


def test_gear_play_and_a_wrong_part(held: dict[str, list[Held]]) -> None:
    points = held["elevator"]
    last = [points[0], *points[:-1]]
    loose = [
        replace(p, readings={"elevator": p.readings["elevator"]
                             + (30.0 if p.position > q.position else 0.0)})
        for p, q in zip(points, last, strict=True)
    ]  # fmt: skip
    assert "has play" in _doubt("servos", loose)
    wrong = _changed(held["alpha_b"], "alpha_b", lambda p, raw: 512.0 + 1.2 * (raw - 512.0))
    assert "has a slope of" in _doubt("vanes", wrong)


def test_a_zero_beyond_the_data_sheet(held: dict[str, list[Held]]) -> None:
    sick = _changed(held["dp_b"], "dp_b", lambda p, raw: raw + 90.0)
    assert "has its zero at" in _doubt("pitots", sick)


def test_a_crooked_imu_and_turned_axes() -> None:
    subject = subjects()["accelerometers"]
    lean = 3.0 / 180.0 * np.pi
    turn = np.array([[np.cos(lean), -np.sin(lean), 0], [np.sin(lean), np.cos(lean), 0], [0, 0, 1]])
    points = []
    for repeat in (1, 2):
        for axis, name in enumerate("xyz"):
            for sign in (1.0, -1.0):
                force = turn @ (sign * GRAVITY_MPS2 * np.eye(3)[axis])
                face = f"{'+' if sign > 0 else '-'}{name}"
                points.append(face_held(face, repeat, force, GRAVITY_MPS2))
    lines = calibrated_lines(subject, points)
    assert crooked_deg(points, lines) == pytest.approx(3.0, abs=0.01)
    assert (crooked_doubt(subject, 3.0) or "").startswith("the IMU sits crooked by 3.0 deg")
    assert crooked_doubt(subject, 0.5) is None
    swapped = [
        replace(p, readings={"ax": p.readings["ay"], "ay": p.readings["ax"],
                             "az": p.readings["az"]}) for p in points
    ]  # fmt: skip
    assert "ax and ay are swapped" in (calibrated_lines(subject, swapped)[0].doubt or "")


def test_gyros_that_are_swapped_or_turned_round() -> None:
    rests = [Rest(r, (0.0, 0.0, 0.0)) for r in (1, 2)]
    turns = []
    for repeat in (1, 2):
        for axis, seen in enumerate((1, 0, 2)):
            for sign in (1.0, -1.0):
                rates = [0.0, 0.0, 0.0]
                rates[seen] = sign * 3.0 * (-1.0 if axis == 2 else 1.0)
                turns.append(Turn(repeat, axis, sign * 60.0, 20.0, (rates[0], rates[1], rates[2])))
    p, q, r = gyro_lines(subjects()["gyros"], rests, turns)
    assert (p.doubt or "").startswith("gyros p and q are swapped")
    assert (q.doubt or "").startswith("gyros q and p are swapped")
    assert (r.doubt or "").startswith("gyro r turns the wrong way")


def test_hard_iron_of_a_field_seen_all_around() -> None:
    rng = np.random.default_rng(4)
    way = rng.standard_normal((1500, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    field = np.array([120.0, -75.0, 30.0]) + np.array([430.0, 445.0, 420.0]) * way
    field += 4.0 * rng.standard_normal(field.shape)
    found = hard_iron(subjects()["magnetometer"], field)
    assert found.doubt is None
    assert np.all(np.abs(found.centre - [120.0, -75.0, 30.0]) < 4.0 * found.centre_sigma + 0.5)
    assert rounded(found.centre)[0] in (119, 120, 121)
    soft = hard_iron(subjects()["magnetometer"], field * [1.0, 1.3, 1.0])
    assert (soft.doubt or "").startswith("soft iron")
    with pytest.raises(UsageError, match="not every attitude"):
        hard_iron(subjects()["magnetometer"], field[field[:, 2] > 60.0])


def test_a_reference_as_the_recorders_own_record_has_it() -> None:
    subject = subjects()["supply"]
    found = supply_reference(subject, [4.871, 4.870, 4.872], [5.02, 5.02, 5.02])
    assert round(found.reference_mv) == 1134  # as hw/calibration/reference_record.py rounds it
    assert found.doubt is None
    assert found.sigma_mv == pytest.approx(0.005 * 1134, rel=0.01)
    assert "disagree" in (supply_reference(subject, [4.87, 4.80], [5.02, 5.02]).doubt or "")
    assert "expected 1000" in (supply_reference(subject, [4.0], [5.02]).doubt or "")
