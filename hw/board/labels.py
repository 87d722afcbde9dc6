"""Hold the print against holes and pads: no label may lie above one.

/usr/bin/python3 hw/board/labels.py     needs pcbnew, which KiCad brings for the system's Python
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pcbnew

HERE = Path(__file__).resolve().parent
BOARDS = (
    HERE / "logger.kicad_pcb",
    HERE / "sensors/vane.kicad_pcb",
    HERE / "sensors/pitot.kicad_pcb",
)
# A hole's rim and the fabricator's tolerance.
MARGIN_MM = 0.15


def labels(board: Any) -> list[tuple[str, Any]]:
    """Return the printed texts of both sides."""
    texts = [text for text in board.GetDrawings() if isinstance(text, pcbnew.PCB_TEXT)]
    for footprint in board.GetFootprints():
        texts += [field for field in footprint.GetFields() if field.IsVisible()]
        texts += [t for t in footprint.GraphicalItems() if isinstance(t, pcbnew.PCB_TEXT)]
    silk = (pcbnew.F_SilkS, pcbnew.B_SilkS)
    return [(text.GetShownText(True), text) for text in texts if text.GetLayer() in silk]


def obstacles(board: Any, layer: int) -> list[tuple[str, Any]]:
    """Return what a label on a layer may not cover: vias' holes, pads."""
    front = layer == pcbnew.F_SilkS
    found: list[tuple[str, Any]] = []
    for via in (track for track in board.GetTracks() if isinstance(track, pcbnew.PCB_VIA)):
        box = pcbnew.BOX2I(via.GetPosition())
        box.Inflate(via.GetDrillValue() // 2 + pcbnew.FromMM(MARGIN_MM))
        found.append((f"a via at {via.GetPosition()}", box))
    for footprint in board.GetFootprints():
        for pad in footprint.Pads():
            if pad.IsOnLayer(pcbnew.F_Cu if front else pcbnew.B_Cu):
                found.append((f"a pad of {footprint.GetReference()}", pad.GetBoundingBox()))
    return found


def faults(path: Path) -> list[str]:
    """Name every label above a hole or a pad.

    Parameters
    ----------
    path
        A .kicad_pcb.
    """
    board = pcbnew.LoadBoard(str(path))
    kept = {layer: obstacles(board, layer) for layer in (pcbnew.F_SilkS, pcbnew.B_SilkS)}
    return [
        f"{path.name}: '{name}' lies above {what}"
        for name, text in labels(board)
        for what, box in kept[text.GetLayer()]
        if text.GetEffectiveShape().Collide(box.GetCenter(), box.GetWidth() // 2)
    ]


def main() -> int:
    """Print every covered label; 0 none, 6 some."""
    found = [line for path in BOARDS for line in faults(path)]
    print("\n".join(found) or "no label lies above a hole or a pad")
    return 6 if found else 0


if __name__ == "__main__":
    sys.exit(main())
