"""A sensor whose error lasts from sample to sample is no sensor without noise."""

from dataclasses import replace

import numpy as np
import pytest
from host.instrument.deviations import sensor_error_model
from host.physical.recording import FOREIGN, OWN
from host.sysid.estimators.filter_error import fit_filter_error
from host.sysid.estimators.gust_model import gust_model
from host.sysid.estimators.innovation_search import noise_floor
from host.sysid.flight import flown_maneuvers, reconstruct_flight
from host.sysid.flight.reconstructed_flight import OWN_ATTITUDE_RAD
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.models import Maneuver, Trim, template
from host.sysid.reconstruction import Compatibility
from scipy import signal

DT_S, FINE = 0.02, 10
TRUTH = {"Z_alpha": -8.0, "M_alpha": -60.0, "M_q": -8.0, "M_de": -70.0, "Z_de": -0.5}
TRUTH |= {"D_V": -0.2, "D_alpha": -5.0, "Z_V": -0.07}
SLOW = gust_model(
    template("longitudinal", Trim(17.0, 0.05, 0.05), accelerometers=True, delays=()), 17.0
)
MODEL = SLOW.with_start([TRUTH.get(p.name, 0.0) for p in SLOW.parameters])
NOISE = {"airspeed_mps": 0.1, "alpha_rad": 2e-3, "q_radps": 2e-3, "theta_rad": 1e-4}


def flown(seed: int) -> Maneuver:
    """Return 3-2-1-1s in gusts; the attitude takes a part of lift's changes for gravity."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 10.0, DT_S)
    A, B, C, D = MODEL.matrices(np.array([p.start for p in MODEL.parameters]))
    steps = np.interp(t % 5.0, (0, 1, 1.75, 2.25, 2.5, 2.75), (0, 0, 1, -1, 1, -1), left=0, right=0)
    u = 0.05 * np.sign(np.round(steps, 1))[:, None] * ((t % 5.0 >= 1.0) & (t % 5.0 < 2.75))[:, None]
    fine = np.interp((np.arange(len(t) * FINE) + 0.5) / FINE, np.arange(len(t)), u[:, 0])
    Ad, Bd, *_ = signal.cont2discrete((A, B, C, D), DT_S / FINE)
    x, y = np.zeros(len(A)), np.empty((len(t), len(C)))
    gust = MODEL.states.index("gust_rad")
    for k, at in enumerate(fine):
        if k % FINE == 0:
            y[k // FINE] = C @ x + D @ u[k // FINE]
        x = Ad @ x + Bd[:, 0] * at
        x[gust] += 0.06 * np.sqrt(DT_S / FINE) * rng.standard_normal()
    force = y[:, MODEL.outputs.index("az_mps2")] / 9.81
    wrong = signal.lfilter([0.06 * DT_S], [1.0, DT_S / 1.5 - 1.0], force)
    y[:, MODEL.outputs.index("theta_rad")] += wrong
    sd = np.array([NOISE.get(name, 0.05) for name in MODEL.outputs])
    return Maneuver(DT_S, u, y + sd * rng.standard_normal(y.shape))


def test_an_attitude_that_is_wrong_for_seconds_tells_no_damping() -> None:
    """Taken for a sensor without noise, its error passes for motion."""
    least = np.array([OWN_ATTITUDE_RAD * (name == "theta_rad") for name in MODEL.outputs])
    rms = {}
    for floor in (None, least):
        errors = []
        for seed in range(4):
            maneuvers = [replace(flown(2 * seed + k), least_noise=floor) for k in (0, 1)]
            fit = fit_filter_error(
                MODEL, maneuvers, process=("gust_rad", "airspeed_mps"), compare_noise=False
            )
            errors.append(fit.value("M_q") / TRUTH["M_q"] - 1.0)
        rms[floor is None] = float(np.sqrt(np.mean(np.square(errors))))
    assert rms[False] < 0.03
    assert rms[True] > 2.0 * rms[False]


def test_the_search_starts_above_the_least_noise() -> None:
    maneuver = flown(1)
    least = np.zeros(len(MODEL.outputs))
    least[2] = 0.4
    usual = noise_floor([maneuver], np.zeros(1))
    found = noise_floor([maneuver, replace(maneuver, least_noise=least)], np.zeros(1))
    assert found[3] == pytest.approx(np.log(0.4))
    np.testing.assert_allclose(np.delete(found, 3), np.delete(usual, 3), rtol=1e-12)


@pytest.mark.parametrize(
    ("maker", "known", "least_rad"),
    [(OWN, True, OWN_ATTITUDE_RAD), (OWN, False, 0.0), (FOREIGN, True, 0.0)],
)
def test_only_our_own_attitude_is_known_to_be_so(maker: str, known: bool, least_rad: float) -> None:
    t = np.arange(0.0, 10.0, DT_S)
    columns = {"t_s": t} | dict.fromkeys((*MODEL.outputs, "elevator_rad"), 0.0 * t)
    window = DetectedManeuver("elevator_rad", "stretch", 1.0, 9.0, 9.0, 0.1, 1, given=True)
    instrument = sensor_error_model("ultrastick25e") if known else None
    flight = replace(
        reconstruct_flight(columns, [window], maker=maker),
        compatibility=Compatibility((), {}, (), gps=False, instrument=instrument),
    )
    [one] = flown_maneuvers([flight], [[window]])
    least = one.cut(MODEL).least_noise
    assert least is not None
    assert dict(zip(MODEL.outputs, least, strict=True)) == {
        name: least_rad * (name == "theta_rad") for name in MODEL.outputs
    }
