"""Lateral maneuvers reach the gust filter: ours as means over 20 ms, others' as they are."""

import numpy as np
import pytest
from host.instrument.deviations import sensor_error_model
from host.physical.recording import AUTOPILOT, FOREIGN, OWN
from host.readers.column_sampling import sampled_name
from host.sysid.flight import FlownManeuver, ReconstructedFlight, with_filter_step
from host.sysid.linear.linear_model import template_and_method
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.models import Trim, template
from host.sysid.reconstruction import Compatibility

from tests.host.sysid.at_hand import identify
from tests.host.sysid.recorded import linear_flight

NAMES = (
    "airspeed_mps", "alpha_rad", "q_radps", "theta_rad", "ax_mps2", "az_mps2", "elevator_rad",
    "beta_rad", "p_radps", "r_radps", "phi_rad", "ay_mps2", "aileron_rad", "rudder_rad",
)  # fmt: skip
FOUND = DetectedManeuver("aileron_rad", "doublet", 2.0, 3.0, 6.0, 0.1, 3)


def _flown(
    dt_s: float, *, known: bool, maker: str = OWN, slow: tuple[str, ...] = ()
) -> FlownManeuver:
    """Return a maneuver of even columns; of the `slow` ones every fifth row was measured."""
    t = np.arange(0.0, 10.0, dt_s)
    columns = {"t_s": t} | {name: np.sin((k + 1.0) * t) for k, name in enumerate(NAMES)}
    columns |= {sampled_name(name): 1.0 * (np.arange(len(t)) % 5 == 0) for name in slow}
    instrument = sensor_error_model("ultrastick25e") if known else None
    agreement = Compatibility((), {}, (), gps=False, instrument=instrument)
    flight = ReconstructedFlight("", columns, columns, (FOUND,), agreement, not known, maker=maker)
    return FlownManeuver(FOUND, flight, "doublet")


def test_means_are_the_same_of_inputs_and_outputs() -> None:
    model, plain = template("lateral", Trim(18.0)), _flown(0.005, known=True)
    [mean] = with_filter_step([plain], model)
    fine, coarse = plain.cut(model), mean.cut(model)
    assert coarse.dt_s == pytest.approx(0.02)
    assert coarse.samples == fine.samples // 4
    for wide, narrow in ((fine.inputs, coarse.inputs), (fine.outputs, coarse.outputs)):
        for k in range(0, coarse.samples, 50):
            np.testing.assert_allclose(narrow[k], wide[4 * k : 4 * k + 4].mean(axis=0))
    t = mean.inside()["t_s"]
    np.testing.assert_allclose(np.diff(t), 0.02)
    assert len(t) == coarse.samples


def test_slow_columns_of_others_and_longitudinal_ones_stay_as_they_are() -> None:
    lateral = template("lateral", Trim(18.0))
    for plain, model in (
        (_flown(0.02, known=True), lateral),
        (_flown(0.04, known=True), lateral),
        (_flown(0.005, known=False), lateral),
        (_flown(0.005, known=True, maker=FOREIGN), lateral),
        (_flown(0.005, known=True), template("longitudinal", Trim(18.0))),
    ):
        [same] = with_filter_step([plain], model)
        np.testing.assert_array_equal(same.cut(model).outputs, plain.cut(model).outputs)


@pytest.mark.parametrize(
    ("maker", "dt_s", "slow", "method"),
    [
        (OWN, 0.01, "p_radps", "output-error-white"),
        (AUTOPILOT, 0.005, "p_radps", "output-error-white"),
        (OWN, 0.01, "beta_rad", "filter-error-gust"),
        (AUTOPILOT, 0.005, "phi_rad", "filter-error-gust"),
        (OWN, 0.02, "p_radps", "filter-error-gust"),
        (FOREIGN, 0.01, "p_radps", "filter-error-gust"),
    ],
)
def test_a_slow_gyro_of_ours_has_no_means_and_no_filter_at_a_shorter_step(
    maker: str, dt_s: float, slow: str, method: str
) -> None:
    flown = [_flown(dt_s, known=True, maker=maker, slow=(slow,))]
    _, chosen, remarks = template_and_method(flown, Trim(18.0), "lateral", "flight")
    assert chosen == method
    assert any("no means over 20 ms" in line for line in remarks) == (method != "filter-error-gust")


def test_a_slow_column_was_measured_in_the_means_that_hold_a_sample() -> None:
    model = template("lateral", Trim(18.0))
    [mean] = with_filter_step([_flown(0.01, known=True, slow=("beta_rad",))], model)
    seen = mean.cut(model).seen
    at = [model.outputs.index(name) for name in ("beta_rad", "p_radps")]
    assert seen[:, at].mean(axis=0) == pytest.approx([2 / 5, 1.0], abs=0.01)


@pytest.mark.parametrize(
    ("maker", "method"),
    [
        (OWN, "output-error-white"),
        (AUTOPILOT, "output-error-white"),
        (FOREIGN, "filter-error-gust"),
    ],
)
def test_without_an_aircraft_file_tables_of_others_are_fitted_with_rolling_gusts(
    maker: str, method: str
) -> None:
    """In gusts output error knows N_dr to 11 % and misses N_r on an independent simulator by 24."""
    flight = linear_flight("lateral", "none", "gust", 1200)
    [answer] = identify(flight.columns, names=("lateral",), windows=flight.windows, maker=maker)
    assert answer.method == method
    off = abs(answer.result.value("N_dr") - flight.truth["N_dr"])
    half = float(answer.result.half_width()[answer.result.index("N_dr")])
    assert off < half
    assert (half < 0.02 * abs(flight.truth["N_dr"])) == (maker == FOREIGN)
