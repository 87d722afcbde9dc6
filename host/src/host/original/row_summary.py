"""The summary of `host decode` for a file of original ASCII rows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from host.export.writer import Meta
from host.original.row_table import NOTES, RowTable
from host.original.rows import LAYOUTS, OriginalRows
from host.physical.calibration import Calibration
from host.physical.columns import COLUMNS, UNITS

Json = dict[str, Any]
_SHOWN = 8
_LISTED = 10_000  # a file with more damaged rows tells nothing by listing them


def summarise_rows(
    path: Path, rows: OriginalRows, table: RowTable, calibration: Calibration
) -> Json:
    """Return everything worth saying about original rows, ready for ``json.dumps``."""
    hurt = np.flatnonzero(rows.damaged)
    known = table.rate.known
    return {
        "file": str(path),
        "format": f"original ASCII rows, {rows.variant}",
        "layout": LAYOUTS[rows.variant],
        "complete": "damaged" if len(hurt) else "complete",
        "rows": len(rows),
        "duration_s": len(rows) / table.rate.rate_hz if known else None,
        "row_rate_hz": table.rate.rate_hz if known else None,
        "row_rate_half_width_hz": table.rate.half_width_hz if known else None,
        "row_rate_origin": table.rate.origin,
        "times": "reconstructed" if known else "unknown",
        "sessions": [],
        "damaged_fields": int(rows.damaged.sum()),
        "overflow_undone": table.undone,
        "overflow_ambiguous": table.ambiguous,
        "notes": [note.format(rate=table.rate.text) for note in NOTES],
        "losses": {
            "ranges": [
                {
                    "cause": "damaged_row",
                    "offset": int(rows.offset[at]),
                    "length": int(rows.length[at]),
                    "blocks": 0,
                    "frames": 0,
                    "seconds": 0.0,
                    "other_frames": 0,
                    "t_s": float(table.columns["t_s"][at]) if known else None,
                    "text": f"byte {rows.offset[at]}, row {at + 1}: {rows.damaged[at]} of"
                    f" {len(rows.values)} fields missing or damaged, marked invalid",
                }
                for at in hurt[:_LISTED].tolist()
            ],
            "damaged_rows": len(hurt),
            "ending": None,
        },
        "calibration": {
            "name": calibration.name,
            "date": calibration.date,
            "default_columns": [
                column.name for column in COLUMNS if column.name.endswith(("_rad", "ps", "ps2"))
            ]
            if calibration.defaults()
            else [],
        },
    }


def row_lines(summary: Json) -> list[str]:
    """Return the summary in words."""
    out = [
        f"{'rows':<13}{summary['file']}  {summary['format']} ({summary['layout']}),"
        f" {summary['complete']}",
        f"{'duration':<13}"
        + (f"{summary['duration_s']:.2f} s" if summary["duration_s"] is not None else "unknown")
        + f", {summary['rows']} rows",
    ]
    undone = {name: count for name, count in summary["overflow_undone"].items() if count}
    if undone:
        words = ", ".join(f"{name} {count}" for name, count in undone.items())
        out.append(f"{'overflow':<13}undone in {words}")
    lost = {name: count for name, count in summary["overflow_ambiguous"].items() if count}
    if lost:
        words = ", ".join(f"{name} {count}" for name, count in lost.items())
        out.append(f"{'overflow':<13}two counts explain the value, marked invalid: {words}")
    ranges = summary["losses"]["ranges"]
    hurt = summary["losses"]["damaged_rows"]
    out.append(f"{'losses':<13}" + (f"{hurt} damaged rows" if hurt else "none"))
    out += [f"{'':<13}{loss['text']}" for loss in ranges[:_SHOWN]]
    if hurt > _SHOWN:
        out.append(f"{'':<13}... and {hurt - _SHOWN} more: --json lists {len(ranges)}")
    out += [f"{'note':<13}{note}" for note in summary["notes"]]
    out.append(f"{'calibration':<13}{summary['calibration']['name']}")
    return out


def row_meta(path: Path, summary: Json) -> Meta:
    """Return the metadata of a table of original rows."""
    return Meta(
        units=UNITS,
        texts={column.name: column.text for column in COLUMNS},
        notes={
            "source": path.name,
            "format": summary["format"],
            "times": summary["times"],
            "notes": "; ".join(summary["notes"]),
            "calibration_name": summary["calibration"]["name"],
            "default_columns": ", ".join(summary["calibration"]["default_columns"]),
        },
    )
