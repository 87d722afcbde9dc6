"""Servos of commanded inputs: the delay found moves with the commands, derivatives do not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.arrays import Array
from host.errors import IdentificationError
from host.instrument.deviations import unknown_sensors
from host.instrument.servo_prior import ServoPrior, servo_prior
from host.physical.recording import Recording
from host.sysid.estimators import fit
from host.sysid.estimators.servo_delay_profile import CoarseDelays, DelayProfile
from host.sysid.estimators.servo_parameters import (
    ServoEstimate,
    _rival,
    considered_servo,
    estimate_servo,
)
from host.sysid.models import FitResult, LinearModel, Maneuver, Trim, template
from host.sysid.numerics import OutputProblem
from host.sysid.reconstruction import behind_servos

import host
from tests.host.sysid.held import assert_held

THOR = Path(__file__).resolve().parents[4] / "tests/data/thor75"
TRUE = {"Z_alpha": -5.0, "Z_de": -0.5, "Z_q": 0.1, "M_alpha": -80.0, "M_q": -8.0, "M_de": -90.0}
DT_S = 0.02
T = np.arange(0.0, 20.0, DT_S)
LATE = (0.05, 8.0, 5.2)


def _command() -> Array:
    """A doublet and a 3-2-1-1 of 3 degrees."""
    u = np.zeros(len(T))
    for first, last, sign in ((1, 1.5, 1), (1.5, 2, -1), (8, 9.2, 1), (9.2, 10, -1), (10, 10.4, 1)):
        u[(first <= T) & (last > T)] = np.radians(3.0) * sign
    return u


def _found(
    shift_s: float,
    prior: ServoPrior,
    noise_radps: float = 0.003,
    *,
    gust_radps: float = 0.0,
    seed: int = 7,
) -> tuple[ServoEstimate, FitResult]:
    """Return servos and fit of a flight whose commands are `shift_s` earlier than they were.

    `gust_radps` is the deviation of slow noise on the outputs, of 0.5 s.
    """
    model = template("short-period", Trim(17.0), accelerometers=False)
    model = replace(model, delays=())
    still = Maneuver(DT_S, np.zeros((len(T), 1)), np.zeros((len(T), len(model.outputs))))
    command = _command()
    surface = behind_servos({"u": command}, T, LATE)["u"]
    flown = replace(still, inputs=surface[:, None])
    problem = OutputProblem(model, [flown])
    outputs = problem.outputs(np.array([TRUE.get(n, 0.0) for n in problem.names]))
    assert outputs is not None
    rng = np.random.default_rng(seed)
    noise = rng.normal(0.0, noise_radps, (len(T), len(model.outputs)))
    keep = np.exp(-DT_S / 0.5)
    slow = np.zeros_like(noise)
    for k in range(1, len(T)):
        slow[k] = keep * slow[k - 1] + rng.normal(0.0, np.sqrt(1.0 - keep**2), slow.shape[1])
    y = outputs[0].T + noise + gust_radps * slow
    early = np.interp(T + shift_s, T, command)

    def behind(servo: tuple[float, float, float]) -> list[Maneuver]:
        u = behind_servos({"u": early}, T, servo)["u"]
        return [Maneuver(DT_S, u[:, None], y)]

    def white(m: LinearModel, data: object, _: FitResult | None) -> FitResult:
        return fit("output-error-white", m, data, multiple_starts=False)  # type: ignore[arg-type]

    servo = estimate_servo(
        model, behind, ["elevator_rad"], prior, white, CoarseDelays(model, behind, prior, white)
    )
    return servo, servo.added_to(white(model, behind(servo.setting), None))


WIDE = ServoPrior((0.0, 8.0, 5.2), (0.05, 2.3, 1.3))


def test_the_delay_moves_with_the_commands_and_pitch_damping_stays() -> None:
    """60 ms earlier commands are 60 ms more delay."""
    found = [_found(shift, WIDE) for shift in (0.0, 0.06)]
    first, fitted = found[0]
    half = fitted.half_width()
    assert abs(first.setting[0] - LATE[0]) < first.numbers[0].half_width
    assert first.numbers[0].data_informed
    assert not first.numbers[1].data_informed
    servo, other = found[1]
    assert servo.setting[0] - first.setting[0] == pytest.approx(0.06, abs=0.004)
    assert abs(other.value("M_q") - fitted.value("M_q")) < 0.5 * half[fitted.index("M_q")]
    assert_held(fitted, TRUE, ("M_alpha", "M_q", "M_de"), times=1.5)


def test_a_prior_that_knows_the_servo_is_held_to() -> None:
    """A delay known to 3 ms is not looked for at 50."""
    servo, _ = _found(0.0, ServoPrior((0.05, 8.0, 5.2), (0.003, 0.4, 0.5)))
    assert abs(servo.setting[0] - 0.05) < 0.006


def test_in_calm_air_the_delay_is_told_to_a_millisecond() -> None:
    """Noise of 0.02 mrad/s: a parabola over 12 ms is not that of the likelihood."""
    servo, _ = _found(0.0, ServoPrior((0.047, 8.0, 5.2), (0.0125, 0.4, 0.5)), 2e-5)
    assert servo.setting[0] == pytest.approx(LATE[0], abs=1e-3)


def test_slow_gusts_do_not_hide_the_delay() -> None:
    """A gust has a memory, the edges of the inputs have none: 6 flights, their root mean square."""
    prior = ServoPrior((0.045, 8.0, 5.2), (0.0125, 0.4, 0.5))
    found = [_found(0.0, prior, gust_radps=0.03, seed=seed)[0].numbers[0] for seed in range(6)]
    off_s = np.array([delay.value - LATE[0] for delay in found])
    assert np.sqrt(np.mean(off_s**2)) < 2.5e-3
    assert sum(abs(o) < d.half_width for o, d in zip(off_s, found, strict=True)) >= 5


def test_a_servo_that_is_not_estimated_is_carried() -> None:
    """Where the fit fails beside it, one deviation of each number shifts the parameters."""
    model = replace(template("short-period", Trim(17.0), accelerometers=False), delays=())
    seen: list[float] = []

    def behind(servo: tuple[float, float, float]) -> list[Maneuver]:
        u = behind_servos({"u": _command()}, T, servo)["u"]
        return [Maneuver(DT_S, u[:, None], np.random.default_rng(3).normal(0, 1, (len(T), 2)))]

    def fails(_: LinearModel, data: object, near: FitResult | None) -> FitResult:
        seen.append(1.0)
        raise IdentificationError("no")

    with pytest.raises(IdentificationError, match="no delay at which"):
        estimate_servo(
            model, behind, ["elevator_rad"], WIDE, fails, CoarseDelays(model, behind, WIDE, fails)
        )

    def white(m: LinearModel, data: object, _: FitResult | None) -> FitResult:
        return fit("output-error-white", m, data, multiple_starts=False)  # type: ignore[arg-type]

    considered = considered_servo(model, behind, ["elevator_rad"], WIDE, white)
    assert seen
    assert considered.setting == WIDE.mean
    assert np.all(np.diag(considered.covariance) > 0.0)


def test_the_servos_of_others_are_known_less() -> None:
    """The prior of a table of others is wide, an autopilot's waits for the next pulse, ours is of a
    servo on a bench."""
    own = servo_prior(unknown_sensors(Recording(commanded=("elevator",))))
    other = servo_prior(unknown_sensors(Recording(commanded=("elevator",), maker="foreign")))
    assert own.sd[0] < 0.005
    assert other.sd[0] == pytest.approx(0.05, rel=0.05)  # with the delay of the IMU
    flown = servo_prior(unknown_sensors(Recording(commanded=("elevator",), maker="autopilot")))
    assert flown.sd[0] == pytest.approx(0.0133, rel=0.05)


def test_the_commands_of_a_real_flight_have_their_lag() -> None:
    """Thor's commands, 40 ms earlier, are 40 ms later at the surface; M_q stays within half its
    interval."""
    table = pd.read_csv(THOR / "flight75_240_270.csv")
    earlier = table.copy()
    t = table["time"].to_numpy()
    earlier["de"] = np.interp(t + 0.04, t, table["de"])
    answers = [
        host.identify(
            flight, mapping=THOR / "map.toml", aircraft="ultrastick25e", models="short-period",
            from_s=240.0, to_s=255.0, methods="output-error-white",
        ).linear[0]
        for flight in (table, earlier)
    ]  # fmt: skip
    servos = [a.servo for a in answers]
    assert servos[0] is not None and servos[1] is not None
    assert servos[0].numbers[0].data_informed
    assert servos[1].setting[0] - servos[0].setting[0] == pytest.approx(0.04, abs=0.005)
    k = answers[0].result.index("M_q")
    moved = answers[1].result.estimate[k] - answers[0].result.estimate[k]
    assert abs(moved) < 0.5 * answers[0].result.half_width()[k]


def test_a_better_delay_far_away_is_named() -> None:
    """Fits that are best at -0.08 s, hidden from a search from 0 by a hill between them."""
    costs = {-0.08: 90.0, -0.04: 130.0, 0.0: 100.0, 0.04: 120.0}

    def found(delay_s: float) -> float:
        return float(np.interp(delay_s, list(costs), list(costs.values())))

    profile = DelayProfile(template("roll", Trim(17.0)), lambda _: [], WIDE, lambda *_: None)  # type: ignore[arg-type]
    for asked in costs:
        profile.costs[asked] = found(asked)
        profile.fits[asked] = None  # type: ignore[assignment]
    assert profile.hollows == [-0.08, 0.0]
    assert _rival(profile, 0.0, profile.hollows) == -0.08
    assert _rival(profile, -0.08, profile.hollows) is None
    assert _rival(profile, 0.0, [0.0]) is None


def test_a_delay_that_cannot_be_is_not_known() -> None:
    """Neither one that the data leave as it was, nor one ahead of its command, nor one of two."""
    servo, _ = _found(0.0, WIDE)
    delay = servo.numbers[0]
    assert servo.unknown_delay == ""

    def with_delay(**change: object) -> ServoEstimate:
        return replace(servo, numbers=(replace(delay, **change), *servo.numbers[1:]))  # type: ignore[arg-type]

    assert with_delay(data_informed=False).unknown_delay == "the data do not tell it"
    ahead = with_delay(value=-0.04, half_width=0.01)
    assert ahead.unknown_delay == "no surface is ahead of its command"
    assert with_delay(value=-0.04, half_width=0.05).unknown_delay == ""
    assert replace(servo, rival_s=0.16).unknown_delay == "160 ms fit better still"
    known = with_delay(data_informed=False, prior_half_width=0.006)
    assert known.unknown_delay == ""
