"""The programs behind the studies of virtual flights count and compare as they say."""

from typing import Any

import numpy as np
import pytest
from host.readers.even_grid import even_columns
from host.sysid.models import Maneuver, free_model
from host.thesis.original_program import free_run
from host.twin.virtual import VirtualFlight, virtual_flight
from studies.coefficients import CoefficientTally, true_delays, truths
from studies.flights import PRINCIPAL
from studies.thesis_flights import CASES, lines, nrmse, re_enact

from tests.host.sysid.at_hand import identify_coefficients


@pytest.fixture(scope="module")
def flight() -> VirtualFlight:
    return virtual_flight("demo", 41, chain="none")


def test_a_flight_is_counted_with_modes_and_delays(flight: VirtualFlight) -> None:
    columns, _ = even_columns(flight.table)
    tally = CoefficientTally()
    tally.add(identify_coefficients(columns, "ultrastick25e"), flight)
    assert set(tally.coefficients.error) == set(PRINCIPAL)
    text = "\n".join(tally.lines())
    for words in ("of 16 medians", "frequency short_period", "damping dutch_roll", "delay_imu_s"):
        assert words in text
    assert abs(tally.frequency["dutch_roll"][0][0]) < 0.05


def test_truth_is_that_of_the_axis(flight: VirtualFlight) -> None:
    expected = truths(list(flight.maneuvers))
    flown: list[dict[str, Any]] = list(flight.maneuvers)
    mean = np.mean([m["derivatives"]["Cm_q"] for m in flown if m["axes"] == ["elevator"]])
    assert expected["Cm_q"] == pytest.approx(float(mean))


def test_delays_left_over_are_the_drawn_ones(flight: VirtualFlight) -> None:
    rest = true_delays(flight)
    assert rest["delay_imu_s"] == pytest.approx(flight.record.draws.scalar("imu_delay_s"))
    shares = flight.record.draws.vector("vane_delay_share")
    assert np.sign(rest["delay_beta_s"]) == np.sign(shares[2:].mean())


def test_the_programs_figure_hides_the_number_of_rows() -> None:
    case = CASES[2]
    figures = re_enact(case, 3)
    assert figures.per_state_percent == pytest.approx(figures.program_percent * case.rows / 4)
    assert figures.program_percent < 5.0  # looks like the thesis's 1.47 %
    assert figures.nrmse > 0.10
    assert "thesis 1.47 %" in lines(case, [figures], [(0.1, 0.02)])[1]


def test_free_run_follows_a_linear_system() -> None:
    A, B = np.array([[-1.0, 2.0], [-3.0, -2.0]]), np.array([[0.0], [1.0]])
    model = free_model("two", ("q_radps", "alpha_rad"), ("elevator_rad",))
    u = np.sin(np.arange(200) * 0.05)[:, None]
    start = np.array([[0.3, -0.1]]).repeat(200, axis=0)
    beta = np.concatenate([A.ravel(), B.ravel()])
    run = free_run(model, Maneuver(0.01, u, start), beta)
    assert run is not None
    x = np.array([0.3, -0.1])
    for k in range(199):
        for _ in range(100):
            x = x + 1e-4 * (A @ x + B @ u[k])
    assert run[199] == pytest.approx(x, abs=2e-3)
    assert nrmse(run, run) == 0.0
    assert free_run(model, Maneuver(0.01, u, start), 1e6 * np.abs(beta)) is None
