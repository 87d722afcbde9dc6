"""Judges a heartbeat: the rests between its edges, and the gate they hold at the worst corner."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simavr_bench.charge_pump import ChargePump

LONGEST_REST_S = 0.004
LONGEST_PAIR_S = 0.0025
LEAST_GATE_VOLT = 2.0
# What ends a drive is longer than the slowest release; the pump has settled 30 ms behind its begin.
OVER_S = 0.1
SETTLED_S = 0.03
SUPPLY_VOLT = 4.5
# Marked tolerances of hw/relay.md's parts. A BAT54 drops at most 0.32 V at 1 mA; when a charge ends
# D2 carries less.
CAPACITOR, RESISTOR, DIODE_VOLT = 0.10, 0.05, (0.24, 0.32)
C1_F, C2_F, HALF_R1_OHM, R2_OHM = 0.33e-6, 0.47e-6, 51_000.0, 470.0


@dataclass(frozen=True, slots=True)
class Beats:
    """What a heartbeat did while it was made.

    Attributes
    ----------
    edges : int
        Edges seen.
    rest_s : float
        Longest time between two edges of one drive.
    pair_s : float
        Longest that two rests in a row both lasted.
    gate_volt : float
        Lowest voltage of the gate, the pump settled; nan: no edge.
    """

    edges: int
    rest_s: float
    pair_s: float
    gate_volt: float

    def wrong(self) -> list[str]:
        """Say which limit is missed."""
        found = []
        if self.rest_s > LONGEST_REST_S:
            found.append(f"the heartbeat rested {1e3 * self.rest_s:.2f} ms")
        if self.pair_s > LONGEST_PAIR_S:
            found.append(f"two rests of the heartbeat in a row of {1e3 * self.pair_s:.2f} ms")
        if self.gate_volt < LEAST_GATE_VOLT:
            found.append(f"the gate at {self.gate_volt:.2f} V")
        return found


def corner_pump(c1: int, c2: int, r1: int, r2: int, diode: int) -> ChargePump:
    """Make the pump with every part at one end of its tolerance: -1 low, 1 high; 4.5 V."""
    return ChargePump(
        series_ohm=R2_OHM * (1 + RESISTOR * r2),
        coupling_f=C1_F * (1 + CAPACITOR * c1),
        reservoir_f=C2_F * (1 + CAPACITOR * c2),
        bleed_ohm=HALF_R1_OHM / 2 * (1 + RESISTOR * r1),
        diode_volt=DIODE_VOLT[diode > 0],
        supply_volt=SUPPLY_VOLT,
    )


def worst_pump() -> ChargePump:
    """Make the pump whose gate falls lowest: C1, C2, R1 small, R2 and the diodes' drop large."""
    return corner_pump(-1, -1, -1, 1, 1)


def all_corners() -> list[ChargePump]:
    """Make the pump at every corner of its tolerances."""
    return [corner_pump(*signs) for signs in itertools.product((-1, 1), repeat=5)]


def judge_beats(
    cycles: NDArray[np.uint64],
    levels: NDArray[np.unsignedinteger[Any]],
    *,
    pump: ChargePump | None = None,
    until: int | None = None,
    may_stop: bool = False,
) -> Beats:
    """Judge the edges of a heartbeat.

    Parameters
    ----------
    cycles, levels : NDArray, shape (n,)
        Cycle and level of every edge.
    pump : ChargePump
        As it is before the first edge; the worst one unless given.
    until : int or None
        Cycle of the run's end while the heartbeat was still wanted: the rest up to it counts.
    may_stop : bool
        Whether the Mega may cease to drive: a rest above 100 ms then ends a drive, uncounted.

    Returns
    -------
    Beats
    """
    pump = worst_pump() if pump is None else pump
    at = cycles.astype(np.int64)
    if until is not None and len(at):
        at = np.append(at, until)
    rests = np.diff(at) / 16e6
    begins = (rests > OVER_S) & may_stop
    counted = np.where(begins, 0.0, rests)
    pairs = np.minimum(counted[1:], counted[:-1])
    return Beats(
        len(cycles),
        float(counted.max(initial=0.0)),
        float(pairs.max(initial=0.0)),
        _lowest_gate(pump, rests, begins, levels),
    )


def _lowest_gate(
    pump: ChargePump,
    rests: NDArray[np.float64],
    begins: NDArray[np.bool_],
    levels: NDArray[np.unsignedinteger[Any]],
) -> float:
    """Lowest gate voltage at the end of a rest; between two edges it is never below both ends."""
    if not len(levels):
        return float("nan")
    lowest, running_s = np.inf, 0.0
    pump.edge(bool(levels[0]), 0.0)
    for k, (rest_s, begins_anew) in enumerate(zip(rests.tolist(), begins.tolist(), strict=True)):
        running_s = 0.0 if begins_anew else running_s + rest_s
        _, gate_volt = pump.at(rest_s)
        if running_s > SETTLED_S:
            lowest = min(lowest, gate_volt)
        if k + 1 < len(levels):
            pump.edge(bool(levels[k + 1]), rest_s)
    return float(lowest) if lowest < np.inf else float("nan")
