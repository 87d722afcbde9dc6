"""Single maneuvers of a fit of coefficients: predicted by the others, held to each other."""

from dataclasses import replace

import numpy as np
import pytest
from host.aircraft.mass_properties import airframe_data
from host.aircraft.powerplant import powerplant
from host.arrays import Array
from host.instrument.deviations import sensor_error_model
from host.sysid.coefficients import CoefficientFit, fit_coefficients
from host.sysid.coefficients.deletion_diagnostics import (
    FinalStep,
    cross_validation,
    maneuver_influence,
)
from host.sysid.coefficients.equation_blocks import (
    EquationSpectra,
    Unknowns,
    accumulate,
    equation_blocks,
)
from host.sysid.coefficients.normal_equations import Prior, solve_normal_equations
from host.sysid.coefficients.window_spectra import (
    EquationKey,
    Window,
    WindowTransform,
    window_transform,
)
from host.sysid.numerics.maneuver_agreement import scatter_test
from host.sysid.reconstruction import Spectrum

from tests.host.sysid.recorded import NAME, aloft, nominal_multisine

TERMS = ("alpha", "q")
TRUE = np.array([-1.6, 3.0])
NOISE = {"Cm": (np.array([0.1, 4.5]), np.array([0.5, 2.0]))}
SD = 0.3


def problem(
    seed: int, sizes: tuple[float, ...], bias: float = 0.4
) -> tuple[list[WindowTransform], FinalStep]:
    """One equation with two terms, one instrument error, a line of its own in every window."""
    rng = np.random.default_rng(seed)
    blocks, spectra, slopes = [], {}, {}
    for k, size in enumerate(sizes):
        at = np.arange(300)
        block = window_transform(at, 0.03, Window(0.0, 9.0, longitudinal=True), ("CL", "CD"))
        F = len(block.frequency_hz)
        terms = size * (rng.standard_normal((F, 2)) + 1j * rng.standard_normal((F, 2)))
        noise = 0.3 * (rng.standard_normal(F) + 1j * rng.standard_normal(F))
        error = rng.standard_normal(F) + 1j * rng.standard_normal(F)
        left = terms @ TRUE + block.trends[:, :2] @ np.array([3.0, -2.0]) + noise + bias * error
        spectra["Cm", k] = np.column_stack([left, terms])
        slopes["Cm", k] = -error[:, None]
        blocks.append(replace(block, equations=("Cm",)))
    return blocks, solved(blocks, spectra, slopes)


def solved(
    blocks: list[WindowTransform],
    spectra: dict[EquationKey, Spectrum],
    slopes: dict[EquationKey, Spectrum],
) -> FinalStep:
    unknowns = Unknowns({"Cm": np.arange(2)}, 2, 1)
    side = EquationSpectra(spectra, slopes)
    parts = equation_blocks(blocks, side, side, {"Cm": np.zeros(2)}, unknowns, NOISE)
    known = Prior(np.diag([0.0, 0.0, SD**-2]), np.zeros(3))
    position = {"Cm_alpha": 0, "Cm_q": 1}
    none = np.zeros(0, dtype=np.int64)
    step = solve_normal_equations(
        accumulate(parts, unknowns.count), known, position, none, np.zeros(0)
    )
    return FinalStep(parts, step, unknowns, NOISE, spectra)


def without_line(values: Array, trends: Spectrum) -> Array:
    line = np.concatenate([trends.real, trends.imag])
    answer: Array = values - line @ np.linalg.pinv(line, rcond=1e-9) @ values
    return answer


def test_leaving_one_out_is_fitting_the_others() -> None:
    blocks, last = problem(3, (1.0, 0.7, 1.3))
    found = cross_validation(last, blocks)
    assert found is not None
    assert found.windows == (0, 1, 2)
    top = bottom = 0.0
    for k, block in enumerate(blocks):
        rest = [j for j in range(3) if j != k]
        again = solved(
            [blocks[j] for j in rest],
            {("Cm", n): last.spectra["Cm", j] for n, j in enumerate(rest)},
            {("Cm", n): -error_of(last, blocks, j) for n, j in enumerate(rest)},
        )
        step = again.solution.step
        spectrum = last.spectra["Cm", k]
        missed = (
            spectrum[:, 0] - spectrum[:, 1:] @ step[:2] - error_of(last, blocks, k)[:, 0] * step[-1]
        )
        rest_of = [
            without_line(np.concatenate([values.real, values.imag]), block.trends[:, :2])
            for values in (missed, spectrum[:, 0])
        ]
        top, bottom = top + float(rest_of[0] @ rest_of[0]), bottom + float(rest_of[1] @ rest_of[1])
    assert found.left_out["Cm"] == pytest.approx(np.sqrt(top / bottom), rel=1e-6)
    assert found.left_out["Cm"] > found.fitted["Cm"]


def error_of(last: FinalStep, blocks: list[WindowTransform], k: int) -> Spectrum:
    """Return what one unit of the instrument's error adds to the left side of a window."""
    weight = np.sqrt(2.0 / np.interp(blocks[k].frequency_hz, *NOISE["Cm"]))
    real, imaginary = last.blocks[k].A[:, -1].reshape(2, -1) / weight
    return np.asarray(real + 1j * imaginary)[:, None]


def test_a_maneuver_that_alone_tells_a_term_stays() -> None:
    blocks, last = problem(3, (1.0, 0.1, 0.1))
    found = cross_validation(last, blocks)
    assert found is not None
    assert found.windows == (1, 2)
    blocks, last = problem(3, (1.0,))
    assert cross_validation(last, blocks) is None


def test_maneuvers_of_one_aircraft_agree_as_often_as_chance_says() -> None:
    p = []
    for seed in range(200):
        blocks, last = problem(seed, (1.0, 1.0, 0.8, 1.2), bias=0.0)
        shift, share, variance = maneuver_influence(last, blocks, np.eye(2, last.unknowns.count))
        # Spectra of this problem are five times its noise: 0.18 of 1 by variance.
        level = 2.0 * 0.3**2 / 2.0 * np.mean(2.0 / np.interp(blocks[0].frequency_hz, *NOISE["Cm"]))
        p += scatter_test(("Cm_alpha", "Cm_q"), shift, share, level * variance).p_value.tolist()
        np.testing.assert_allclose(shift.sum(axis=0), 0.0, atol=0.02)
    assert 0.40 < np.mean(np.array(p) < 0.5) < 0.60
    assert 0.05 < np.mean(np.array(p) < 0.1) < 0.17


def slipped(share: float) -> CoefficientFit:
    """A flight of orthogonal multisines; in its last third the elevator's pot reads too much."""
    columns, windows = aloft(nominal_multisine())
    last = [w for w in windows if w.longitudinal][-1]
    t, moved = columns["t_s"], columns["elevator_rad"].copy()
    inside = (t >= last.first_s) & (t <= last.last_s)
    mean = float(moved[inside].mean())
    moved[inside] = mean + (1.0 + share) * (moved[inside] - mean)
    kept = columns | {"elevator_rad": moved}
    return fit_coefficients(
        kept, windows, airframe_data(NAME), sensor_error_model(NAME), powerplant(NAME)
    )


def test_a_pot_that_slips_between_maneuvers_is_named_and_predicted_worse() -> None:
    fair, wrong = slipped(0.0), slipped(0.4)
    k = fair.maneuver_agreement.names.index("Cm_de")
    assert fair.maneuver_agreement.factor[k] == 1.0
    assert wrong.maneuver_agreement.factor[k] > 2.0
    half = [f.derivatives[k].half_width for f in (fair, wrong)]
    assert half[1] > 2.0 * half[0]
    assert fair.prediction is not None
    assert wrong.prediction is not None
    assert len(fair.prediction.windows) == 6
    assert fair.prediction.left_out["Cm"] < 1.1 * fair.prediction.fitted["Cm"]
    assert wrong.prediction.left_out["Cm"] > 1.25 * wrong.prediction.fitted["Cm"]
