"""Aileron and rudder together: laws, margins of both and the joint bound against what is known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from host.constants import GRAVITY_MPS2
from host.control.actuator import Actuator
from host.control.autopilots import ardupilot_yaw, px4_yaw
from host.control.autopilots.known import AUTOPILOTS
from host.control.autopilots.structure import YawStructure
from host.control.joint_margin import joint_disk, structured_value
from host.control.lateral_pair import PairProblem, draw_pair
from host.control.margins import margins
from host.control.plant import sampled
from host.control.scenarios import Problem
from host.control.uncertain_axis import UncertainAxis
from host.control.verification import Required
from host.control.yaw_design import at_rest, design_yaw, search_yaw
from host.sysid.models import Trim

DERIVATIVES = {
    "Y_beta": -0.5, "L_beta": -30.0, "L_p": -15.0, "L_r": 3.0, "L_da": 200.0,
    "N_beta": 30.0, "N_p": -0.5, "N_r": -1.0, "N_da": -4.0, "N_dr": -25.0,
}  # fmt: skip
EXACT = Actuator("aileron", 0.4, 0.0, 8.0, 0.0, 4.0, 0.012, 0.0)


def pair(
    autopilot: str = "ardupilot", share: float = 0.0, changed: Mapping[str, float] | None = None
) -> PairProblem:
    """Return an aircraft whose derivatives are known to a share, with some of them changed."""
    values = {**DERIVATIVES, **(changed or {})}
    mean = np.array(list(values.values()))
    axis = UncertainAxis("roll", "lateral", Trim(15.0, 0.05, 0.05), tuple(values), mean,
                         np.diag((share * mean / 1.96) ** 2))  # fmt: skip
    structure = AUTOPILOTS[autopilot].structure("roll", {}, 15.0)
    roll = Problem(axis, EXACT, structure, (15.0,), 1.3)
    yaw: YawStructure = {"ardupilot": ardupilot_yaw, "px4": px4_yaw}[autopilot].structure({}, 15.0)
    gains = structure.completed({"P": 0.08, "D": 0.0, "TC": 0.5}, 0.12)
    return PairProblem(roll, gains, replace(EXACT, surface="rudder"), yaw)


def test_two_blocks_of_known_size() -> None:
    crossed = np.array([[0.0, 2.0], [4.5j, 0.0]])
    assert structured_value(crossed) == pytest.approx(3.0)  # the root of 2 x 4.5
    assert structured_value(np.diag([2.0, -5.0j])) == pytest.approx(5.0)


def test_the_structured_value_is_what_turning_one_block_finds() -> None:
    # The largest spectral radius of M diag(1, e^j) over all turns is the value itself.
    rng = np.random.default_rng(4)
    turns = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 2001))
    for _ in range(20):
        m = rng.standard_normal((2, 2)) + 1j * rng.standard_normal((2, 2))
        turned = m * np.stack([np.ones_like(turns), turns], axis=-1)[:, None, :]
        found = np.max(np.abs(np.linalg.eigvals(turned)))
        assert structured_value(m) == pytest.approx(found, rel=1e-5)


def test_loops_that_do_not_meet_have_the_lesser_disk() -> None:
    w = np.geomspace(0.1, 50.0, 400)
    s = 1j * w
    loops = np.array([3.0 / (s * (s + 1.0)), 8.0 / (s + 1.0) ** 3])
    both = np.zeros((1, len(w), 2, 2), dtype=complex)
    both[0, :, 0, 0], both[0, :, 1, 1] = loops
    assert joint_disk(both)[0] == pytest.approx(np.min(margins(loops, w).disk))


def test_a_turn_in_balance_leaves_arduplanes_damper_at_rest() -> None:
    law = ardupilot_yaw.structure({}, 15.0).loop({"DAMP": 0.5, "MIX": 0.0}, 20.0)
    bank = 0.3
    turn = GRAVITY_MPS2 / 20.0 * bank
    state, out = law.step(np.zeros(2), np.array(-bank), np.array(turn))
    assert float(out) == pytest.approx(0.0, abs=1e-12)
    _, out = law.step(state, np.array(-bank), np.array(turn + 0.1))
    # Against 0.1 rad/s to the right: left rudder, s^2 x 0.5 x 0.1 of 45 degrees.
    assert float(out) == pytest.approx(-((15.0 / 20.0) ** 2) * 0.5 * 0.1 / (math.pi / 4.0))


def test_px4s_rudder_follows_the_turn_by_feed_forward() -> None:
    law = px4_yaw.structure({}, 15.0).loop({"P": 0.4, "FF": 0.3, "MIX": 0.0}, 15.0)
    bank = 0.3
    turn = GRAVITY_MPS2 / 15.0 * bank
    _, out = law.step(np.zeros(3), np.array(-bank), np.array(turn))
    assert float(out) == pytest.approx(0.3 * turn)
    _, out = law.step(np.zeros(3), np.array(-bank), np.array(0.0))
    assert float(out) == pytest.approx((0.3 + 0.4) * turn)


def test_two_outputs_are_each_as_it_is_alone() -> None:
    rng = np.random.default_rng(3)
    a, b, c = rng.standard_normal((3, 3)) - 3.0 * np.eye(3), rng.standard_normal((3, 2)), np.eye(3)
    w = np.geomspace(0.1, 100.0, 30)
    for delay_s in (0.004, 0.027):
        both = sampled((a, b, c), delay_s, 0.02).transfer(w)
        for k in range(2):
            alone = sampled((a, b[:, [k]], c), delay_s, 0.02).transfer(w)
            np.testing.assert_allclose(both[..., [k]], alone, atol=1e-12)


@pytest.mark.parametrize("surface", ["aileron", "rudder"])
def test_a_surface_with_as_much_more_travel_as_its_margin_is_on_the_edge(surface: str) -> None:
    asked = pair()
    gains = {"DAMP": 1.0, "MIX": 0.3}
    aileron, rudder, _ = draw_pair(asked, seed=1, count=1).judged(gains)
    found = float((aileron if surface == "aileron" else rudder).gain_db[0])
    assert found < 20.0

    def stable(gain_db: float) -> bool:
        wider = replace(EXACT, travel_rad=0.4 * 10.0 ** (gain_db / 20.0))
        other = (
            replace(asked, roll=replace(asked.roll, actuator=wider))
            if surface == "aileron"
            else replace(asked, rudder=wider)
        )
        return draw_pair(other, seed=1, count=1).stable(gains)

    assert stable(found - 0.1)
    assert not stable(found + 0.1)


def test_the_mix_that_takes_back_the_ailerons_yaw_leaves_no_sideslip() -> None:
    # So fast that gravity turns nothing: only N_da yaws, and N_dr takes it back.
    still = {"L_beta": 0.0, "L_r": 0.0, "N_p": 0.0, "N_da": -10.0, "N_dr": -25.0}
    asked = pair(changed=still)
    fast = replace(asked.roll, axis=replace(asked.roll.axis, trim=Trim(1e5, 0.0, 0.0)),
                   airspeeds_mps=(1e5,))  # fmt: skip
    seen = draw_pair(replace(asked, roll=fast), seed=1, count=1)
    slips = [float(seen.sideslip({"DAMP": 0.0, "MIX": m})[0]) for m in (0.0, 0.4)]
    assert slips[1] < 1e-3 * slips[0]


@pytest.mark.costs(30, "a damper verified on 135 aircraft, of either autopilot")
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_damper_halves_what_gusts_yaw_and_keeps_its_margins(autopilot: str) -> None:
    asked = pair(autopilot, 0.1)
    found = design_yaw(asked)
    assert found.gains is not None
    assert found.margins.stable
    assert found.margins.worst[0] >= 6.0
    assert found.margins.worst[1] >= 45.0
    assert found.margins.yaw_radps < 0.7 * found.margins.before_yaw_radps
    assert found.margins.sideslip < found.margins.before_sideslip


def test_a_rudder_whose_sense_is_open_stays() -> None:
    asked = pair(share=0.05)
    axis = asked.roll.axis
    k = axis.names.index("N_dr")
    covariance = axis.covariance.copy()
    covariance[k, k] = 60.0**2
    vague = replace(asked, roll=replace(asked.roll, axis=replace(axis, covariance=covariance)))
    assert search_yaw(draw_pair(vague, seed=2, count=30), Required()) is None
    assert draw_pair(asked, seed=2, count=5).stable(at_rest(asked))
