"""Hold the routed board's copper against its currents; needs no KiCad.

python hw/board/copper.py

Widths by IPC-2221 for outer layers of 35 um: I = 0.048 dT^0.44 A^0.725, A in square mils.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

HERE = Path(__file__).resolve().parent
COPPER_MIL = 35.0 / 25.4
MIL_MM = 0.0254
# The board's file counts from a sheet's corner; the Mega's lower left corner lies here.
ORIGIN_MM = (60.0, 120.0)
LEAST_MM = 0.2
SERVO_A, SERVO_RISE_K = 5.0, 20.0
# The rail runs past J1 ... J9 to its terminal; branches to coils, divider, test point carry 0.13 A.
BUS_ENDS_MM = ((10.0, 71.46), (83.42, 71.46), (83.42, 65.5))
CURRENTS_A = {"+5V": 0.5, "/Supply/battery_in": 0.5, "Net-(D6-A)": 0.5}
COILS = ("/Heartbeat pump and coils/coils", 0.15)
# x and y from the Mega's corner: its USB shell and its power jack stand below.
GROUND_ONLY_MM = {"USB shell": (0.0, 31.3, 10.0, 44.4), "power jack": (0.0, 3.2, 11.5, 12.4)}
_SEGMENT = re.compile(
    r"\(segment\s+\(start ([-\d.]+) ([-\d.]+)\)\s+\(end ([-\d.]+) ([-\d.]+)\)"
    r"\s+\(width ([\d.]+)\)(?:\s+\(locked yes\))?\s+\(layer \"(.+?)\"\)\s+\(net (\d+)\)"
)
_VIA = re.compile(r"\(via\s+\(at ([-\d.]+) ([-\d.]+)\)[^\n]*(?:\n(?!\t\)).*)*?\(net (\d+)\)")
_NET = re.compile(r'^\t\(net (\d+) "(.*)"\)$', re.M)


@dataclass(frozen=True, slots=True)
class Track:
    """A straight piece of copper; mm from the Mega's lower left corner, y up."""

    net: str
    layer: str
    x1_mm: float
    y1_mm: float
    x2_mm: float
    y2_mm: float
    width_mm: float

    def crosses(self, box: tuple[float, float, float, float]) -> bool:
        """Say whether any of it lies within (x1, y1, x2, y2)."""
        steps = 1 + int(10 * max(abs(self.x2_mm - self.x1_mm), abs(self.y2_mm - self.y1_mm)))
        half = self.width_mm / 2
        for k in range(steps + 1):
            x = self.x1_mm + (self.x2_mm - self.x1_mm) * k / steps
            y = self.y1_mm + (self.y2_mm - self.y1_mm) * k / steps
            if box[0] < x + half and x - half < box[2] and box[1] < y + half and y - half < box[3]:
                return True
        return False


def width_mm(current_a: float, rise_K: float) -> float:
    """Return the least width of an outer track of 35 um.

    Parameters
    ----------
    current_a
        Continuous current.
    rise_K
        Temperature above the board's.
    """
    area_mil2 = (current_a / (0.048 * rise_K**0.44)) ** (1.0 / 0.725)
    return float(area_mil2 / COPPER_MIL * MIL_MM)


def tracks(text: str) -> list[Track]:
    """Return every track of a .kicad_pcb, and every via as one of no length."""
    nets = {number: name.replace("\\/", "/") for number, name in _NET.findall(text)}

    def here(x: str, y: str) -> tuple[float, float]:
        return round(float(x) - ORIGIN_MM[0], 4), round(ORIGIN_MM[1] - float(y), 4)

    found = [
        Track(nets[net], layer, *here(x1, y1), *here(x2, y2), float(width))
        for x1, y1, x2, y2, width, layer, net in _SEGMENT.findall(text)
    ]
    vias = [(here(x, y), nets[net]) for x, y, net in _VIA.findall(text)]
    return found + [Track(net, "via", *place, *place, 0.7) for place, net in vias]


def faults(text: str) -> list[str]:
    """Name every track that is too thin for its current or stands where only ground may.

    Parameters
    ----------
    text
        Content of logger.kicad_pcb.
    """
    found = []
    all_tracks = tracks(text)
    if not all_tracks:
        return ["found no track"]
    wires = [track for track in all_tracks if track.layer != "via"]
    found += [
        f"{track.net}: {track.width_mm} mm, least {LEAST_MM} mm"
        for track in wires
        if track.width_mm < LEAST_MM
    ]
    for net, current in (*CURRENTS_A.items(), COILS):
        need = width_mm(current, 10.0)
        thin = min((t.width_mm for t in wires if t.net == net), default=0.0)
        if thin < need:
            found.append(f"{net}: {thin} mm, {current} A at 10 K rise needs {need:.2f} mm")
    need = width_mm(SERVO_A, SERVO_RISE_K)
    rail = [t for t in wires if t.net == "+VSERVO" and t.width_mm >= need]
    for start, end in pairwise(BUS_ENDS_MM):
        ends = {(start, end), (end, start)}
        if not any(((t.x1_mm, t.y1_mm), (t.x2_mm, t.y2_mm)) in ends for t in rail):
            found.append(f"+VSERVO: no track of {need:.2f} mm from {start} to {end}")
    for name, box in GROUND_ONLY_MM.items():
        found += [
            f"{track.net} above the Mega's {name}"
            for track in all_tracks
            if track.net != "GND" and track.crosses(box)
        ]
    return found


def main() -> int:
    """Print widths and faults; 0 none, 6 some."""
    text = (HERE / "logger.kicad_pcb").read_text(encoding="utf-8")
    print(
        f"servo rail, {SERVO_A:g} A at {SERVO_RISE_K:g} K: {width_mm(SERVO_A, SERVO_RISE_K):.2f} mm"
    )
    found = faults(text)
    print("\n".join(found) or f"{len(tracks(text))} tracks and vias agree with their currents")
    return 6 if found else 0


if __name__ == "__main__":
    sys.exit(main())
