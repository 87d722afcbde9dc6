"""Thrust that was measured and stepped: a force beside the linear model."""

from functools import cache

import numpy as np
import pytest
from host.aircraft.mass_properties import AirframeData
from host.constants import GRAVITY_MPS2
from host.sysid.aerodynamics import with_thrust
from host.sysid.aerodynamics.thrust_terms import LEAST_SHARE, THRUST_AS_INPUT
from host.sysid.linear import Answer
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.models import Trim

from tests.host.sysid.at_hand import identify
from tests.host.sysid.held import assert_held

Columns = dict[str, np.ndarray]
MASS_KG, AREA_M2, CHORD_M, IYY_KGM2, ARM_M = 7500.0, 30.0, 2.4, 56e3, 0.5
FORCE_PER_V2 = 0.5 * 0.9 * AREA_M2
LIFT, DRAG, INDUCED = (0.12, 5.0, 7.0, 0.35), 0.03, 0.05  # alone, by alpha, q, elevator
MOMENT = (0.03, -0.9, -20.0, -1.4)
AIRSPEED_MPS, STEP_S, END_S, ELEVATOR_LAG_S, ENGINE_LAG_S = 106.0, 0.02, 64.0, 0.06, 0.3
NOISE = {
    "airspeed_mps": 0.2, "alpha_rad": 1e-3, "q_radps": 6e-4, "theta_rad": 6e-4,
    "ax_mps2": 0.03, "az_mps2": 0.03,
}  # fmt: skip
STILL = ("beta_rad", "p_radps", "r_radps", "phi_rad", "ay_mps2")
UNIT_S, INPUT_RAD = 0.7, 0.026
INPUTS = ((5.0, (1, 1, 1, -1, -1, 1, -1)), (35.0, (-1, -1, -1, 1, 1, -1, 1)))
STEPS = (
    (14.0, 0.25),
    (24.0, -0.2),
    (33.0, 0.0),
    (43.0, 0.3),
    (54.0, -0.2),
)  # s, share of the trim's
AIRCRAFT = AirframeData(
    "jet", MASS_KG, 3e4, IYY_KGM2, 8e4, 0.0, AREA_M2, 12.5, CHORD_M, elevator_arm_m=7.0
)
PRINCIPAL = ("D_V", "Z_alpha", "M_alpha", "M_q", "M_de")


def accelerations(
    V: float, alpha: float, q: float, de: float, thrust_n: float
) -> tuple[float, float, float]:
    """Return specific forces along x and z, and the angular acceleration."""
    by = (1.0, alpha, 0.5 * q * CHORD_M / V, de)
    force = FORCE_PER_V2 * V**2
    CL, Cm = (sum(a * b for a, b in zip(c, by, strict=True)) for c in (LIFT, MOMENT))
    CD = DRAG + INDUCED * CL**2
    sine, cosine = np.sin(alpha), np.cos(alpha)
    return (
        (thrust_n + force * (CL * sine - CD * cosine)) / MASS_KG,
        -force * (CD * sine + CL * cosine) / MASS_KG,
        (force * CHORD_M * Cm + ARM_M * thrust_n) / IYY_KGM2,
    )


def trimmed() -> np.ndarray:
    """Return angle of attack, elevator and thrust over mass in level flight."""

    def left(x: np.ndarray) -> np.ndarray:
        ax, az, pitching = accelerations(AIRSPEED_MPS, x[0], 0.0, x[1], x[2] * MASS_KG)
        level = GRAVITY_MPS2 * np.array([np.sin(x[0]), -np.cos(x[0])])
        return np.array([ax - level[0], az - level[1], pitching])

    x = np.array([0.05, 0.0, 1.0])
    for _ in range(20):
        slopes = np.column_stack([(left(x + d) - left(x - d)) / 2e-5 for d in 1e-5 * np.eye(3)])
        x = x - np.linalg.solve(slopes, left(x))
    return x


def true_derivatives(trim: Trim) -> dict[str, float]:
    """Return the derivatives about what was flown, by differences; thrust stays."""
    V, alpha = trim.airspeed_mps, trim.alpha_rad
    _, de, thrust = trimmed()
    thrust *= MASS_KG

    def path(at: np.ndarray) -> np.ndarray:
        ax, az, pitching = accelerations(at[0], at[1], at[2], at[3], thrust)
        sine, cosine = np.sin(at[1]), np.cos(at[1])
        return np.array([ax * cosine + az * sine, (az * cosine - ax * sine) / V, pitching])

    about = np.array([V, alpha, 0.0, de])
    by = [(path(about + d) - path(about - d)) / 2e-5 for d in 1e-5 * np.eye(4)]
    return {"D_V": by[0][0], "Z_alpha": by[1][1], "M_alpha": by[1][2], "M_q": by[2][2]} | {
        "M_de": by[3][2]
    }


@cache
def flown(seed: int, *, stepping: bool = True) -> Columns:
    """Return two 3-2-1-1s of the elevator in calm air, thrust stepped beside them."""
    alpha, trim_de, trim_thrust = trimmed()
    trim_thrust *= MASS_KG
    x = np.array([AIRSPEED_MPS * np.cos(alpha), AIRSPEED_MPS * np.sin(alpha), 0.0, alpha, 0.0, 1.0])
    rows = []

    def rates(x: np.ndarray, wanted: tuple[float, float]) -> tuple[np.ndarray, tuple[float, ...]]:
        u, w, q, theta, de, share = x
        V, alpha = float(np.hypot(u, w)), float(np.arctan2(w, u))
        thrust = trim_thrust * share
        ax, az, pitching = accelerations(V, alpha, q, trim_de + de, thrust)
        along, down = -GRAVITY_MPS2 * np.sin(theta), GRAVITY_MPS2 * np.cos(theta)
        lags = (wanted[0] - de) / ELEVATOR_LAG_S, (wanted[1] - share) / ENGINE_LAG_S
        change = np.array([ax + along - q * w, az + down + q * u, pitching, q, *lags])
        return change, (V, alpha, q, theta, ax, az, trim_de + de, thrust)

    for t in np.arange(0.0, END_S, STEP_S):
        units = [(int((t - start) // UNIT_S), signs) for start, signs in INPUTS]
        stick = sum(INPUT_RAD * signs[k] for k, signs in units if 0 <= k < len(signs))
        lever = 1.0 + stepping * next((s for at, s in reversed(STEPS) if t >= at), 0.0)
        wanted = (float(stick), float(lever))
        a, now = rates(x, wanted)
        rows.append((t, *now))
        b = rates(x + 0.5 * STEP_S * a, wanted)[0]
        c = rates(x + 0.5 * STEP_S * b, wanted)[0]
        d = rates(x + STEP_S * c, wanted)[0]
        x = x + STEP_S / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    names = ("t_s", *NOISE, "elevator_rad", "thrust_n")
    true = dict(zip(names, np.array(rows).T, strict=True))
    rng = np.random.default_rng(seed)
    noisy = {n: true[n] + sd * rng.standard_normal(len(true[n])) for n, sd in NOISE.items()}
    return {**true, **noisy, **{n: np.zeros(len(true["t_s"])) for n in STILL}}


def answer(
    columns: Columns, method: str = "flight", airframe: AirframeData | None = None
) -> Answer:
    """Return the longitudinal answer from both inputs, each with its free response."""
    windows = [
        DetectedManeuver("elevator_rad", "3-2-1-1", s, s + 4.9, s + 25.0, INPUT_RAD, 7)
        for s, _ in INPUTS
    ]
    return identify(
        columns, names=["longitudinal"], windows=windows, method=method, airframe=airframe,
        with_delays=False,
    )[0]  # fmt: skip


@cache
def answer_to_flight(
    method: str, airframe: AirframeData | None = None, *, stepping: bool = True
) -> Answer:
    """Return the answer to a flight as measured; several tests look at it."""
    return answer(flown(1 if stepping else 2, stepping=stepping), method, airframe)


@pytest.mark.parametrize("airframe", [None, AIRCRAFT], ids=["bare", "file"])
@pytest.mark.parametrize("method", ["flight", "output-error-white"])
def test_derivatives_hold_while_measured_thrust_steps(
    method: str, airframe: AirframeData | None
) -> None:
    """M_alpha was -1.5 +- 7.5, truth -5.8; D_V was +0.01 +- 0.27, truth -0.016."""
    found = answer_to_flight(method, airframe)
    known = dict.fromkeys(PRINCIPAL, 0.06) | {"D_V": 0.25}
    assert_held(found.result, true_derivatives(found.trim), known=known)
    assert THRUST_AS_INPUT in found.result.warnings


def test_thrust_that_only_airspeed_moves_changes_nothing() -> None:
    """A propeller left alone pulls less when the aircraft is faster: that is in D_V as ever."""
    columns = flown(2, stepping=False)
    speed, thrust = columns["airspeed_mps"], columns["thrust_n"]
    falling = thrust * (1.0 - 2.0 * (speed / np.mean(speed) - 1.0))
    method = "output-error-white"
    found = [
        answer_to_flight(method, stepping=False),
        answer({**columns, "thrust_n": falling}, method),
    ]
    assert np.ptp(falling) > LEAST_SHARE * np.mean(thrust)
    for one in found:
        assert THRUST_AS_INPUT not in one.result.warnings
        assert np.array_equal(one.result.estimate, found[0].result.estimate)
        assert np.array_equal(one.result.covariance, found[0].result.covariance)


def test_measured_power_gives_thrust_and_is_as_good_in_what_it_is_not_in() -> None:
    """Its efficiency is assumed: a tenth wrong, the data say so."""
    columns = flown(1)
    power = columns["thrust_n"] * columns["airspeed_mps"] / 0.66
    bare = {n: v for n, v in columns.items() if n != "thrust_n"}
    found = answer({**bare, "power_w": power}, "output-error-white", AIRCRAFT)
    assert_held(found.result, true_derivatives(found.trim), PRINCIPAL, known={"D_V": 0.25})
    assert with_thrust(bare, None) is bare


@pytest.mark.parametrize("method", ["flight", "output-error-white"])
def test_what_thrust_does_is_known_per_newton(method: str) -> None:
    """It pulls over the mass and pitches over the inertia, of a bare table too."""
    found = answer_to_flight(method)
    assert found.thrust is not None
    pull, _, pitching, turning = found.thrust.rates_per_n
    along = np.cos(found.trim.alpha_rad) / MASS_KG
    assert pull == pytest.approx(along, rel=0.03)
    assert pitching == pytest.approx(ARM_M / IYY_KGM2, rel=0.03)
    assert turning == 0.0
    of = found.model.outputs.index("ax_mps2")
    assert found.thrust.outputs_per_n[of] == pytest.approx(1.0 / MASS_KG, rel=0.03)
    assert answer_to_flight("output-error-white", stepping=False).thrust is None
