"""A user's model: the noise of the data chooses the default, a method that is named is obeyed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.flight.flown_maneuver import FlownManeuver
from host.sysid.flight.reconstructed_flight import ReconstructedFlight
from host.sysid.linear.linear_model import with_starts_of
from host.sysid.linear.users_model import fit_by_evidence, fit_users_model
from host.sysid.maneuvers.maneuver_detection import DetectedManeuver
from host.sysid.models import LinearModel, Maneuver, model_from
from scipy import signal

from tests.host.sysid.held import assert_held

DT_S, SAMPLES, FINE, AIRSPEED_MPS = 0.02, 500, 5, 17.0
A = np.array([[-6.0, 1.0], [-80.0, -9.0]])
B = np.array([-0.9, -90.0])
TRUTH = {"Z_alpha": -6.0, "M_alpha": -80.0, "M_q": -9.0, "Z_de": -0.9, "M_de": -90.0}
NOISE = np.array([0.003, 0.01])


def short_period(**changed: object) -> LinearModel:
    own = {
        "name": "mine",
        "states": ["alpha_rad", "q_radps"],
        "inputs": ["elevator_rad"],
        "outputs": ["alpha_rad", "q_radps"],
        "delays": [],
        "hold": "foh",
        "A": [["Z_alpha", 1.0], ["M_alpha", "M_q"]],
        "B": [["Z_de"], ["M_de"]],
        "parameters": {k: 0.9 * v for k, v in TRUTH.items()},
    }
    return model_from({**own, **changed})


def flown(kind: str, seed: int = 4) -> Maneuver:
    """Return three doublets with white or coloured noise, or in a gust that the vane feels too."""
    rng = np.random.default_rng(seed)
    t = np.arange(SAMPLES) * DT_S
    u = sum(
        0.06 * np.interp(t - a, [0, 0.05, 0.3, 0.4, 0.6, 0.65], [0, 1, 1, -1, -1, 0])
        for a in (1.0, 4.0, 7.0)
    )
    step = DT_S / FINE
    gust = np.zeros(SAMPLES * FINE)
    if kind == "gust":
        rate = AIRSPEED_MPS / 30.0 * step
        drive = rng.standard_normal(len(gust)) * np.sqrt(2.0 * rate) / AIRSPEED_MPS
        gust = 0.5 * signal.lfilter([1.0], [1.0, rate - 1.0], drive)
    t_fine = np.arange(len(gust)) * step
    driven = np.column_stack([np.interp(t_fine, t, u), gust])
    system = (A, np.column_stack([B, A[:, 0]]), np.eye(2), np.zeros((2, 2)))
    _, _, states = signal.lsim(system, driven, t_fine)
    e = rng.standard_normal((SAMPLES, 2))
    if kind == "coloured":
        e = signal.lfilter([np.sqrt(1.0 - 0.9**2)], [1.0, -0.9], e, axis=0)
    y: Array = states[::FINE] + NOISE * e
    y[:, 0] += gust[::FINE]
    return Maneuver(DT_S, u[:, None], y)


@pytest.mark.parametrize(
    ("kind", "method", "words"),
    [
        ("white", "output-error-white", "white, for residuals are not coloured"),
        ("coloured", "output-error-white", "noise model: white (what was not fitted"),
        ("gust", "filter-error-gust", "noise model: gusts (what was not fitted"),
    ],
)
def test_the_noise_of_the_data_chooses_the_method_and_it_is_said(
    kind: str, method: str, words: str
) -> None:
    found = fit_by_evidence(short_period(), [flown(kind)], AIRSPEED_MPS)
    assert found.method == method
    assert words in found.remarks[0]
    assert_held(found.result, TRUTH, times=1.8)


def test_without_airspeed_the_states_themselves_are_driven() -> None:
    found = fit_by_evidence(short_period(), [flown("gust")], None)
    assert found.method == "filter-error"


def test_a_filter_takes_out_the_delays_that_output_error_finds() -> None:
    """The vane 40 ms late: a filter has no delays, and does not ask the user to shift data."""
    late = flown("white")
    y = late.outputs.copy()
    y[:, 0] = np.interp(late.time_s - 0.04, late.time_s, y[:, 0])
    delays = [{"name": "vane_s", "outputs": ["alpha_rad"], "prior_sd_s": 0.02, "limit_s": 0.08}]
    data = [Maneuver(DT_S, late.inputs, y)]
    found = fit_users_model("filter-error", short_period(delays=delays), data, None, {})
    value, half = found.delays["vane_s"]
    assert abs(value - 0.04) < 1.5 * half < 0.02
    plain = fit_users_model("filter-error", short_period(), [flown("white")], None, {})
    k = found.result.index("M_alpha")
    assert abs(found.result.estimate[k] + 80.0) < found.result.half_width()[k]
    assert found.result.covariance[k, k] > 1.05 * plain.result.covariance[k, k]


def with_slow(slow: list[bool]) -> list[Maneuver]:
    """Return two maneuvers in gusts, of two sample periods; slow outputs are every other row's."""
    whole = flown("gust")
    coarse = Maneuver(2.0 * DT_S, whole.inputs[::2], whole.outputs[::2])
    return [
        replace(m, sampled=~np.outer(np.arange(m.samples) % 2 == 1, slow)) for m in (whole, coarse)
    ]


def test_slow_columns_tell_delays_as_well_as_their_step_allows() -> None:
    """A gust passes for 2 % of the step at which the quickest sensor was measured."""
    delays = [{"name": "gyro_s", "outputs": ["q_radps"], "prior_sd_s": 0.01, "limit_s": 0.03}]
    model, half_s = short_period(delays=delays), {}
    for slow in ([True, False], [True, True]):
        found = fit_by_evidence(model, with_slow(slow), AIRSPEED_MPS)
        assert found.method == "filter-error-gust"
        assert_held(found.result, TRUTH, ("M_alpha", "M_q", "M_de"))
        value_s, half_s[slow[1]] = found.delays["gyro_s"]
        assert abs(value_s) < half_s[slow[1]]
    assert half_s[True] > 1.96 * 0.02 * 4.0 * DT_S  # rows of two samples of 40 ms
    assert half_s[False] < half_s[True]
    assert fit_by_evidence(short_period(), with_slow([True, True]), AIRSPEED_MPS).method == (
        "filter-error-gust"
    )


@pytest.mark.parametrize(
    ("changed", "airspeed_mps", "why"),
    [
        ({}, None, "airspeed_mps, which tells how fast gusts pass, is not in the data"),
        (
            {"states": ["w_mps", "q_radps"], "state_biases": [], "initial_states": []},
            AIRSPEED_MPS,
            "neither alpha_rad nor beta_rad is a measured state",
        ),
        (
            {"A": [["Z_alpha", 1.0], [-80.0, "M_q"]], "parameters": {}},
            AIRSPEED_MPS,
            "the entry of alpha_rad in the row of q_radps is a number",
        ),
        ({"noise": {"q_radps": 0.01}}, AIRSPEED_MPS, "a filter estimates the noise"),
    ],
)
def test_what_the_gust_filter_cannot_fit_it_refuses_in_a_line(
    changed: dict[str, object], airspeed_mps: float | None, why: str
) -> None:
    with pytest.raises(IdentificationError, match=why) as caught:
        fit_users_model(
            "filter-error-gust", short_period(**changed), [flown("white")], airspeed_mps, {}
        )
    assert "\n" not in str(caught.value)
    assert "filter-error and output-error are there" in str(caught.value)


def test_a_filter_that_turns_out_singular_leaves_the_other_noise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It was an internal error; the rest of the answer stands."""

    def singular(*_: object) -> None:
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr("host.sysid.numerics.filter_problem.FilterProblem.scoring", singular)
    found = fit_by_evidence(short_period(), [flown("coloured")], AIRSPEED_MPS)
    assert found.method == "output-error-white"
    assert "gust: filter-error-gust does not converge on mine" in found.remarks[0]


@pytest.mark.parametrize("given", [False, True])
def test_a_known_start_is_that_of_the_record_or_of_a_stretch_given(given: bool) -> None:
    """A doublet found inside a record begins wherever the aircraft is then."""
    data = flown("white")
    columns = {
        "t_s": np.arange(SAMPLES) * DT_S,
        "elevator_rad": data.inputs[:, 0],
        "alpha_rad": data.outputs[:, 0],
        "q_radps": data.outputs[:, 1],
    }
    window = DetectedManeuver(
        "elevator_rad", "doublet", 4.2, 4.7, 7.0, 0.06, 3, given=given, lead_s=0.0
    )
    flight = ReconstructedFlight("", columns, columns, (window,), None, delays_open=True)
    moving = replace(
        short_period(), initial_states=("q_radps",), known_starts=(("alpha_rad", 0.0),)
    )
    model, remarks = with_starts_of(moving, [FlownManeuver(window, flight, "a doublet")])
    assert (model is moving) == given
    assert bool(remarks) != given
    if not given:
        assert model.initial_states == ("alpha_rad", "q_radps")
        assert model.known_starts == ()
        cut = FlownManeuver(window, flight, "a doublet").cut(model)
        assert abs(data.outputs[210, 0]) > 5.0 * NOISE[0]  # alpha is not zero there
        known, freed = (
            fit_users_model("output-error-white", m, [cut], AIRSPEED_MPS, {})
            for m in (moving, model)
        )
        off = [abs(f.result.value("M_alpha") / TRUTH["M_alpha"] - 1.0) for f in (known, freed)]
        assert off[1] < 0.05 < off[0]
