"""Normal equations summed over blocks: those of the whole matrix, in little memory."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from host.errors import IdentificationError
from host.sysid.coefficients.equation_blocks import (
    EquationBlock,
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
from host.sysid.reconstruction import Spectrum

POSITIONS = {"Cm": np.array([0, 1]), "w": np.zeros(0, dtype=np.int64)}
TERMS, ERRORS = 2, 4
NOISE = {"Cm": (np.array([0.1, 4.5]), np.array([0.5, 2.0]))}
POSITION = {"Cm_alpha": 0, "Cm_q": 1}


def random_blocks(
    windows: int, seed: int = 3
) -> tuple[list[WindowTransform], Unknowns, list[EquationBlock]]:
    """Two equations in every window, one of them without terms; numbers are noise."""
    random = np.random.default_rng(seed)

    def noise(*shape: int) -> Spectrum:
        return random.standard_normal(shape) + 1j * random.standard_normal(shape)

    window = Window(0.0, 8.0, longitudinal=True)
    blocks = [
        replace(
            window_transform(np.arange(260 + k % 20), 0.03, window, ("CL", "CD")),
            equations=("Cm", "w"),
        )
        for k in range(windows)
    ]
    sides = []
    for _ in range(2):
        spectra: dict[EquationKey, Spectrum] = {}
        slopes: dict[EquationKey, Spectrum] = {}
        for k, block in enumerate(blocks):
            F = len(block.frequency_hz)
            spectra["Cm", k], spectra["w", k] = noise(F, 1 + TERMS), noise(F, 1)
            slopes["Cm", k], slopes["w", k] = noise(F, ERRORS), noise(F, ERRORS)
        sides.append(EquationSpectra(spectra, slopes))
    # Instrumental variables are like slopes but not the same.
    noise_free = EquationSpectra(*({k: 0.5 * v + a[k] for k, v in b.items()}
                  for a, b in ((sides[0].spectra, sides[1].spectra),
                               (sides[0].slopes, sides[1].slopes))))  # fmt: skip
    unknowns = Unknowns(POSITIONS, TERMS, ERRORS)
    own = {"Cm": np.array([0.3, -0.2]), "w": np.zeros(0)}
    return blocks, unknowns, equation_blocks(blocks, sides[0], noise_free, own, unknowns, NOISE)


def test_trend_of_a_block_moves_nothing() -> None:
    _, unknowns, parts = random_blocks(3)
    bent = [
        replace(p, y=p.y + p.trend_basis @ np.full(p.trend_basis.shape[1], 50.0)) for p in parts
    ]
    before, after = (accumulate(x, unknowns.count).right_side for x in (parts, bent))
    np.testing.assert_allclose(after, before, atol=1e-9)


def test_memory_grows_with_the_flight_and_not_with_its_square() -> None:
    peaks = []
    for windows in (40, 160):
        tracemalloc.start()
        _, unknowns, parts = random_blocks(windows)
        accumulate(parts, unknowns.count)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    whole = (
        8
        * sum(len(p.y) for p in parts)
        * (unknowns.count + sum(p.trend_basis.shape[1] for p in parts))
    )
    assert peaks[1] < 5.0 * peaks[0]
    assert peaks[1] < 0.5 * whole


def test_a_term_that_never_moves_is_named() -> None:
    _, unknowns, parts = random_blocks(3)
    n = unknowns.count
    known = Prior(np.diag(np.r_[np.zeros(TERMS), np.ones(n - TERMS)]), np.zeros(n))
    none = np.zeros(0, dtype=np.int64)
    still = []
    for p in parts:
        A, Z = p.A.copy(), p.Z.copy()
        A[:, p.unknown_indices == POSITION["Cm_q"]] = 0.0
        Z[:, p.unknown_indices == POSITION["Cm_q"]] = 0.0
        still.append(replace(p, A=A, Z=Z))
    with pytest.raises(IdentificationError, match="cannot tell Cm_q:"):
        solve_normal_equations(accumulate(still, n), known, POSITION, none, np.zeros(0))
    # So is one that is a line in time in every window.
    lines = []
    for p in parts:
        A, Z = p.A.copy(), p.Z.copy()
        A[:, p.unknown_indices == POSITION["Cm_alpha"]] = p.trend_basis[:, -1:]
        Z[:, p.unknown_indices == POSITION["Cm_alpha"]] = p.trend_basis[:, -1:]
        lines.append(replace(p, A=A, Z=Z))
    with pytest.raises(IdentificationError, match="cannot tell Cm_alpha:"):
        solve_normal_equations(accumulate(lines, n), known, POSITION, none, np.zeros(0))
