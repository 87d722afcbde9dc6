"""Cases that the logger's C++ and the host's Python must answer bit for bit.

    PYTHONPATH=host python -m tests.learning.shared_cases

writes tests/firmware/test_learning/cases.h.
A small linear aircraft answers to square waves, its signals are rounded to counts; samples and
slices of the solve alternate as they do in the logger. One case is of the largest numbers.
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from host.planning.onboard_sums import PITCH, ROLL, SAMPLE_HZ, YAW, AxisCard, FourierSums
from numpy.typing import NDArray
from studies.onboard_equation_error import EquationError, Learned

HEADER = Path(__file__).parents[1] / "firmware/test_learning/cases.h"
SLICES_PER_SAMPLE = 23
FIRST_SOLVE = 100
Rows = NDArray[np.int64]

_HEAD = """\
// Written by tests/learning/shared_cases.py from the host's arithmetic. Do not edit.
// clang-format off
#pragma once

#include <stdint.h>

#include "core/learning/axis_card.h"
#include "core/progmem.h"

namespace cases {

struct Solve {
  uint16_t count;          // samples when it ended
  uint32_t estimate[5];    // bits of the floats
  uint32_t half_width[5];
  uint8_t enough;
};

"""


@dataclass(frozen=True, slots=True)
class Case:
    """Raw counts of one axis, a row a sample."""

    name: str
    card: AxisCard
    rows: Rows


@dataclass(frozen=True, slots=True)
class Answer:
    """What comes of it: at which sample each solve ended, and the sums behind the last."""

    solves: list[tuple[int, Learned]]
    sums: FourierSums


def answer(case: Case, *, double: bool = False) -> Answer:
    """Return what the host's arithmetic makes of a case."""
    sums = FourierSums(case.card, exact=double)
    solves: list[tuple[int, Learned]] = []
    solver, work = EquationError(case.card, sums, double=double), None
    for row in case.rows:
        sums.take(row)
        if work is None and sums.count >= FIRST_SOLVE and sums.count % SAMPLE_HZ == 0:
            work = solver.slices()
        for _ in range(SLICES_PER_SAMPLE):
            if work is not None and next(work):
                work = None
                assert solver.learned is not None
                solves.append((sums.count, solver.learned))
    return Answer(solves, sums)


def _flown(A: Rows, B: Rows, samples: int, seed: int) -> NDArray[np.float64]:
    """Return states and inputs of a linear aircraft that answers to square waves, 50 Hz."""
    rng = np.random.default_rng(seed)
    fine, inputs = 20, B.shape[1]
    t = np.arange(samples * fine) / (SAMPLE_HZ * fine)
    periods = (0.7 + 0.6 * np.arange(inputs))[:, None] * np.array([1.0, 0.37])[None, :]
    u = 0.05 * np.sign(np.sin(2.0 * np.pi * t[:, None, None] / periods)).sum(axis=2)
    x = np.zeros((len(t), len(A)))
    gust = rng.normal(0.0, 0.3, (len(t) // fine + 1, len(A))).repeat(fine, axis=0)
    for n in range(len(t) - 1):
        x[n + 1] = x[n] + (A @ x[n] + B @ u[n] + gust[n]) / (SAMPLE_HZ * fine)
    return np.hstack([x, u])[::fine]


def _counts(values: NDArray[np.float64], per_count: NDArray[np.float64], trim: Rows) -> Rows:
    return np.rint(values / per_count).astype(np.int64) + trim


def every_case() -> list[Case]:
    """Return the shared cases."""
    longitudinal = np.array([[-5.0, 0.95], [-180.0, -9.0]]), np.array([[-0.4], [-140.0]])
    lateral = (
        np.array([[-0.5, 0.1, -0.98], [-60.0, -16.0, 3.0], [28.0, -0.4, -1.2]]),
        np.array([[0.0, 0.15], [300.0, 1.5], [1.0, -26.0]]),
    )
    rate, vane, pot = 2.664624812204e-4, 7.66990394e-4, 1.27831732e-3
    pitch = _counts(
        _flown(*longitudinal, 320, 1), np.array([vane, rate, pot]), np.array([4150, 12, 1930])
    )
    both = _counts(
        _flown(*lateral, 300, 2),
        np.array([vane, rate, rate, 0.5 * pot, pot]),
        np.array([4090, -30, 7, 25, 2050]),
    )
    pitch_card = AxisCard(
        PITCH, (3, 7, 11, 15, 19, 23, 27, 31, 35, 39), (1.1e-3, -7.6e-3), (1.2e-4, 4.5e-5),
        0.0036, 0.0, (1.31e-3, 0.17, 2.2e-3), (0.05, 0.9, 0.03), (15, 20, 10),
    )  # fmt: skip
    advances = (1.1e-3, -7.6e-3, -7.9e-3), (1.2e-4, 4.5e-5, 4.6e-5)
    roll_card = AxisCard(
        ROLL, (4, 9, 14, 19, 24, 29), *advances, -0.0036, -0.0055,
        (1.5e-4, 4.2e-3, 4.2e-3, 2.1e-4, 1.1e-4), (0.002, 0.01, 0.01, 0.006, 0.002),
        (15, 15, 50, 15, 50),
    )  # fmt: skip
    yaw_card = AxisCard(
        YAW, (3, 6, 10, 14, 19, 25), *advances, -0.0036, -0.002,
        (4.1e-4, 1.1e-2, 1.1e-2, 5.7e-4, 2.9e-4), (0.002, 0.004, 0.004, 0.002, 0.002),
        (10, 0, 20, 0, 10),
    )  # fmt: skip
    # An aileron that never moved, and a rudder that is another signal's copy.
    still, copied = both.copy(), both.copy()
    still[:, 3] = 0
    copied[:, 4] = copied[:, 3] - copied[:, 3][0]
    wild = np.random.default_rng(3).choice([-32768, 32767, 0, 1, -1], (260, 3))
    return [
        Case("Pitch", pitch_card, pitch),
        Case("Roll", roll_card, both),
        Case("Yaw", yaw_card, both[:260]),
        Case("Still", roll_card, still[:160]),
        Case("Copied", yaw_card, copied[:160]),
        Case("Wild", pitch_card, wild),
    ]


def header(cases: list[Case] | None = None) -> str:
    """Return the text of cases.h, of the shared cases or of others."""
    given = every_case() if cases is None else cases
    return _HEAD + "\n".join(_of(c) for c in given) + "\n}  // namespace cases\n"


def _of(case: Case) -> str:
    found, card = answer(case), case.card
    kinds = {PITCH: "kPitch", ROLL: "kRoll", YAW: "kYaw"}
    floats = [_floats(v) for v in (card.advance_s, card.curvature_s2)] + [
        _float(card.lever),
        _float(card.product),
    ]
    worth = ", ".join(
        f"{{{_float(g)}, {_float(t)}, {w}}}"
        for g, t, w in zip(card.gain, card.tolerance, card.wanted_percent, strict=True)
    )
    settings = ", ".join(
        [
            f"core::LearningAxis::{kinds[card.axis]}",
            str(len(card.harmonics)),
            _braced(card.harmonics),
            str(sum(1 << n for n, w in enumerate(card.wanted_percent) if w)),
            *floats,
        ]
    )
    solves = ",\n".join(
        f"    {{{count}, {_bits(one.estimate)}, {_bits(one.half_width)}, "
        f"{sum(1 << n for n, e in enumerate(one.enough) if e)}}}"
        for count, one in found.solves
    )
    n, rows = case.name, _lines(case.rows.ravel())
    sums = _lines(found.sums.sums.ravel().astype(np.int64))
    return f"""\
constexpr core::AxisCard k{n}Card CORE_FLASH = {{
    {settings}}};
constexpr core::DerivativeWorth k{n}Worth[] CORE_FLASH = {{{worth}}};
constexpr uint16_t k{n}Samples = {len(case.rows)};
constexpr int16_t k{n}Rows[] CORE_FLASH = {{
{rows}}};
constexpr Solve k{n}Solves[] CORE_FLASH = {{
{solves}}};
constexpr int32_t k{n}Sums[] CORE_FLASH = {{
{sums}}};
"""


def _float(value: float) -> str:
    return f"{np.float32(value):.9e}F"


def _floats(values: tuple[float, ...]) -> str:
    return "{" + ", ".join(map(_float, values)) + "}"


def _braced(values: tuple[int, ...]) -> str:
    return "{" + ", ".join(map(str, values)) + "}"


def _bits(values: NDArray[Any]) -> str:
    return "{" + ", ".join(f"0x{int(v):08X}U" for v in values.view(np.uint32)) + "}"


def _lines(values: NDArray[np.int64]) -> str:
    text = ", ".join("(-2147483647 - 1)" if v == -(2**31) else str(v) for v in values)
    return textwrap.fill(text, 98, initial_indent="    ", subsequent_indent="    ")


if __name__ == "__main__":
    HEADER.write_text(header(), encoding="ascii")
