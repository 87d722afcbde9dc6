"""A flight as MCAP: every column at full rate as JSON rows, events, calibration attached."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from host.export.mcap_writer import write_mcap
from host.report.exported_rows import exported_rows
from host.report.flight_geography import NO_DATE_S
from host.report.shown_flight import ShownFlight

TOPIC = "/flight"


def write_flight_mcap(flight: ShownFlight, path: Path) -> None:
    """Write a flight as MCAP.

    Raises
    ------
    ModuleNotFoundError
        mcap is missing.
    OSError
        The file cannot be written.
    """
    columns = exported_rows(flight)
    start = NO_DATE_S if flight.utc_s is None else flight.utc_s

    def ns(t_s: float) -> int:
        return round((t_s + start) * 1e6) * 1000

    own = flight.summary.get("calibration") or {}
    texts = {
        name: f"{flight.units.get(name, '')}: {flight.texts.get(name, '')}" for name in columns
    }
    notes = {
        "source": flight.name,
        "complete": flight.summary["complete"],
        "losses": str(len(flight.summary["losses"]["ranges"])),
        "calibration": f"{own.get('name') or 'none'} {own.get('date') or ''}".strip(),
        "date": "by GPS" if flight.utc_s is not None else "unknown: 2000-01-01 stands for it",
    }
    files = (
        {"calibration.toml": flight.calibration_text.encode()} if flight.calibration_text else {}
    )
    files["decode.txt"] = "\n".join(flight.lines).encode()
    times = (np.round((columns["t_s"] + start) * 1e6).astype(np.int64) * 1000).tolist()
    events = [(ns(one.t_s), one.text) for one in flight.events if ns(one.t_s) >= 0]
    write_mcap(
        path, columns, times, topic=TOPIC, texts=texts, events=events, attachments=files,
        notes=notes,
    )  # fmt: skip
