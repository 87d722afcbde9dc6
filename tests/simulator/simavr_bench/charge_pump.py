"""The charge pump of hw/relay.md: edges of the heartbeat in, gate voltage out, solved exactly.

Pin, R2, C1 to a node; D1 from ground to the node, D2 from the node to the gate; C2 and R1 from the
gate to ground. While the pin is high and D2 conducts the circuit is linear with two states, the
voltages of C1 and C2; while it is low C1 empties through D1 and C2 through R1.

A pin that stays high goes on feeding the gate through C1 while C2 runs down: the gate then falls
with R1 (C1 + C2), not with R1 C2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(slots=True)
class ChargePump:
    """Capacitor voltages at a time, and how they go on.

    Parameters
    ----------
    series_ohm, coupling_f, reservoir_f, bleed_ohm : float
        R2, C1, C2, R1.
    diode_volt, supply_volt : float
        Drop of each diode; level of a high pin.

    Attributes
    ----------
    level : bool
        Level of the pin.
    coupling_volt, gate_volt : float
        At the time of the last edge.
    """

    series_ohm: float = 470.0
    coupling_f: float = 0.33e-6
    reservoir_f: float = 0.47e-6
    bleed_ohm: float = 25_500.0
    diode_volt: float = 0.3
    supply_volt: float = 5.0
    level: bool = False
    coupling_volt: float = 0.0
    gate_volt: float = 0.0
    _slow: float = field(init=False)
    _fast: float = field(init=False)
    _split: float = field(init=False)

    def __post_init__(self) -> None:
        """Find the two rates of the circuit while D2 conducts."""
        a = 1 / (self.series_ohm * self.coupling_f)
        b = 1 / (self.series_ohm * self.reservoir_f)
        c = 1 / (self.bleed_ohm * self.reservoir_f)
        # y1 = v1 - (supply - diode), y2 = v2:  y1' = -a (y1 + y2),  y2' = -b (y1 + y2) - c y2
        half, root = (a + b + c) / 2, math.sqrt((a + b + c) ** 2 / 4 - a * c)
        self._slow, self._fast = half - root, half + root
        self._split = a

    @property
    def _drive_volt(self) -> float:
        return self.supply_volt - self.diode_volt

    def at(self, time_s: float) -> tuple[float, float]:
        """Voltages of C1 and of the gate a time after the last edge, in V."""
        bleed = self.bleed_ohm * self.reservoir_f
        if not self.level:
            decay = math.exp(-time_s / (self.series_ohm * self.coupling_f))
            left = self.coupling_volt - self.diode_volt
            coupling = self.diode_volt + left * decay if left > 0 else self.coupling_volt
            return coupling, self.gate_volt * math.exp(-time_s / bleed)
        gate, blocked_s = self.gate_volt, 0.0
        room = self._drive_volt - self.coupling_volt
        if gate > room:  # D2 blocks until C2 has run down to what the pin can give
            blocked_s = bleed * math.log(gate / room) if room > 0 else math.inf
            if time_s <= blocked_s:
                return self.coupling_volt, gate * math.exp(-time_s / bleed)
            gate = room
        return self._conducting(-room, gate, time_s - blocked_s)

    def _conducting(self, y1: float, y2: float, time_s: float) -> tuple[float, float]:
        # Eigenvectors (1, w) with w = (rate - a) / a.
        slow = (self._slow - self._split) / self._split
        fast = (self._fast - self._split) / self._split
        of_fast = (y2 - slow * y1) / (fast - slow)
        of_slow = y1 - of_fast
        of_slow *= math.exp(-self._slow * time_s)
        of_fast *= math.exp(-self._fast * time_s)
        return self._drive_volt + of_slow + of_fast, slow * of_slow + fast * of_fast

    def edge(self, level: bool, after_s: float) -> None:
        """Let the pin change its level a time after the last edge."""
        self.coupling_volt, self.gate_volt = self.at(after_s)
        self.level = level

    def falls_below(self, volt: float) -> float:
        """Time after the last edge at which the gate comes below a voltage for good, in s."""
        low, high = 0.0, 1.0
        # The gate of a high pin first rises, then only falls: look behind its highest point.
        if self.level and self.at(0.0)[1] <= self.at(1e-5)[1]:
            low = self._peak_s()
        if self.at(low)[1] <= volt:
            return 0.0
        for _ in range(40):
            middle = (low + high) / 2
            low, high = (middle, high) if self.at(middle)[1] > volt else (low, middle)
        return high

    def rises_above(self, volt: float) -> float | None:
        """Time after the last edge at which the gate comes above a voltage; None: it does not."""
        if self.at(0.0)[1] >= volt:
            return 0.0
        low, high = 0.0, self._peak_s() if self.level else 0.0
        if self.at(high)[1] < volt:
            return None
        for _ in range(40):
            middle = (low + high) / 2
            low, high = (low, middle) if self.at(middle)[1] >= volt else (middle, high)
        return high

    def _peak_s(self) -> float:
        low, high = 0.0, 20 * self.series_ohm * self.coupling_f
        for _ in range(60):
            left, right = low + (high - low) / 3, high - (high - low) / 3
            if self.at(left)[1] < self.at(right)[1]:
                low = left
            else:
                high = right
        return (low + high) / 2
