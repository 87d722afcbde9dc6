"""Powers and phases of a multisine that tells most in the least time.

Powers: a norm of the relative variances of the wanted derivatives, averaged over drawn aircraft, is
the least for a given mean-square excursion (between A- and minimax-optimal; multiplicative
algorithm: Titterington 1976; Yu, Annals of Statistics 38, 2010). Phases: the least peak of
inputs and excursions over their rms (orthogonal phase-optimised multisines: Morelli, Journal of
Aircraft 49, 2012; Klein & Morelli, Aircraft System Identification, ch. 9), by random search.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.aircraft.airframe import Array
from host.arrays import BoolArray, IntArray
from host.planning.tone_information import WANTED, ToneTable

ITERATIONS = 400
STARTS, DESCENTS = 200, 60
GRID = 512
PHASES = 256  # steps of a turn in the logger's card
NORM = 3.0  # of the relative variances: 1 minds their sum, a large one the widest only
WEIGHT_OF_PRIOR = 1e-9  # of the largest information: keeps singular starts invertible


def powers(
    tables: Sequence[ToneTable], block: str, allowed: BoolArray, each: Sequence[int]
) -> Array:
    """Return mean-square amplitudes (k,) of the tones, of unit mean-square excursion.

    Parameters
    ----------
    tables : sequence of ToneTable
        Tables of the same tones on drawn aircraft.
    block : str
    allowed : (k,) array of bool
        Tones to choose from.
    each : sequence of int
        How many tones each surface of the block gets; a harmonic goes to one surface only.
    """
    weights = _optimal(tables, block, allowed)
    keep = np.zeros(len(allowed), dtype=bool)
    taken: set[float] = set()
    loads = np.mean([_load(t) for t in tables], axis=0)
    for k in np.argsort(-weights * loads):
        axis, f = int(tables[0].axis[k]), float(tables[0].frequency_hz[k])
        if allowed[k] and f not in taken and np.sum(keep & (tables[0].axis == axis)) < each[axis]:
            keep[k] = True
            taken.add(f)
    return _optimal(tables, block, keep)


def _load(table: ToneTable) -> Array:
    return np.asarray(np.sum(np.abs(table.response) ** 2, axis=1) / 2.0)


def _optimal(tables: Sequence[ToneTable], block: str, allowed: BoolArray) -> Array:
    """Return the best powers (k,) of the allowed tones; all aircraft in one array, for speed."""
    cost = np.mean([_load(t) for t in tables], axis=0)[allowed]
    information = np.array([t.information[allowed] for t in tables])
    value = np.array([t.value for t in tables])
    # Weight of a tone: its share of the mean-square excursion that its surface may make. In one
    # budget for both the rudder takes all, and roll is worst: rolling gusts are the strongest.
    axes = [tables[0].axis[allowed] == k for k in np.unique(tables[0].axis)]
    share = np.ones(len(cost))
    for _ in range(ITERATIONS):
        for own in axes:
            share[own] /= np.sum(share[own])
        gradient = _gradient(information, value, block, share / cost) / cost
        for own in axes:
            largest = np.max(gradient[own])
            share[own] *= np.maximum(gradient[own] / largest, 0.0) ** (1.0 / (1.0 + NORM))
    for own in axes:
        share[own] /= np.sum(share[own])
    found = np.zeros(len(allowed))
    found[allowed] = share / cost
    return found


def _gradient(information: Array, value: Array, block: str, weights: Array) -> Array:
    """Return the decrease of the norm of relative variances for a unit of each tone's power.

    Parameters
    ----------
    information : (aircraft, k, rows, n, n) array
    value : (aircraft, rows, n) array
    block : str
    weights : (k,) array
    """
    total = np.tensordot(weights, information, axes=(0, 1))
    out = np.zeros(len(weights))
    for row in range(total.shape[1]):
        columns = [c for r, c in WANTED[block] if r == row]
        own, of = total[:, row], value[:, row, columns]
        floor = WEIGHT_OF_PRIOR * np.trace(own, axis1=1, axis2=2)[:, None, None]
        inverse = np.linalg.inv(own + floor * np.eye(own.shape[1]))[:, :, columns] / of[:, None]
        variance = np.diagonal(inverse[:, columns], axis1=1, axis2=2) / of
        inverse = inverse * variance[:, None] ** (0.5 * (NORM - 1.0))
        pairs = inverse @ inverse.transpose(0, 2, 1)
        out += np.einsum("akij,aij->k", information[:, :, row], pairs)
    return out


def relative_variances(table: ToneTable, block: str, weights: Array) -> Array:
    """Return the variances of the wanted derivatives over their squares, of one second.

    Parameters
    ----------
    table : ToneTable
    block : str
    weights : (k,) array
        Squared amplitudes of the tones, rad^2.
    """
    total = np.einsum("k,krij->rij", weights, table.information)
    inverse = [np.linalg.pinv(matrix) for matrix in total]
    return np.array([inverse[r][c, c] / table.value[r, c] ** 2 for r, c in WANTED[block]])


def phases(
    table: ToneTable, amplitude_rad: Array, harmonic: IntArray, rng: np.random.Generator
) -> Array:
    """Return phases (k,) in turns of few peaks, each input beginning near its zero.

    Parameters
    ----------
    table : ToneTable
        Table of the chosen tones only.
    amplitude_rad : (k,) array
    harmonic : (k,) array of int
        Harmonics of the point's duration.
    rng : numpy Generator
    """
    at = np.arange(GRID) / GRID
    carrier = np.exp(2j * np.pi * np.outer(at, harmonic))
    shape = table.response * amplitude_rad[:, None]
    rms = np.sqrt(np.sum(np.abs(shape) ** 2, axis=0) / 2.0)

    def peaks(turns: Array) -> float:
        waves = np.imag((carrier * np.exp(2j * np.pi * turns)) @ shape)
        return float(np.max(np.max(np.abs(waves), axis=0) * np.sqrt(rms)))

    starts = rng.random((STARTS, len(harmonic)))
    best = min(starts, key=peaks)
    least = peaks(best)
    for step in np.repeat([0.1, 0.03, 0.01], DESCENTS // 3):
        trial = best + step * rng.standard_normal(len(best))
        if (found := peaks(trial)) < least:
            best, least = trial, found
    # A common delay keeps all peaks and moves the start to where the inputs are small.

    inputs = np.array(
        [
            np.imag((carrier * np.exp(2j * np.pi * best))[:, table.axis == k]
                    @ amplitude_rad[table.axis == k])
            for k in np.unique(table.axis)
        ]
    )  # fmt: skip

    begin = int(np.argmin(np.max(np.abs(inputs), axis=0)))
    moved = best + harmonic * at[begin]
    return np.asarray(np.round(np.mod(moved, 1.0) * PHASES) % PHASES / PHASES)
