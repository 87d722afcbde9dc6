"""Summary of an autopilot's log, and the metadata of its table."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from host.export.writer import Meta
from host.physical.columns import COLUMNS, UNITS
from host.readers.autopilot_flight import SURFACES, AutopilotFlight
from host.readers.autopilot_log import FORMATS
from host.readers.judgement import advice_lines


def summarise_autopilot(flight: AutopilotFlight) -> dict[str, Any]:
    """Return the contents of a log and its judgement, as plain data."""
    log, judgement = flight.log, flight.judgement
    signals = flight.channels.signals
    ends = [s.t_s[k] for s in signals.values() for k in (0, -1)]
    return {
        "file": str(log.path),
        "size_bytes": log.path.stat().st_size,
        "format": FORMATS[log.format],
        "vehicle": log.vehicle or None,
        "firmware": log.firmware or None,
        "duration_s": float(max(ends) - min(ends)) if ends else 0.0,
        "airborne_s": flight.flown.time_s,
        "complete": "damaged" if log.damage else "not proven",
        "losses": {"ranges": [{"text": text} for text in log.damage] if log.lost else []},
        "messages": {
            name: {str(k): len(one) for k, one in every.items()}
            for name, every in sorted(log.messages.items())
        },
        "parameters": len(log.parameters),
        "sources": {name: signal.source for name, signal in signals.items()},
        "judgement": judgement.document(),
        "lines": judgement.lines,
        "table": judgement.table(),
        "notes": list(flight.channels.notes),
        "flight": flight.number,
        "flights": [{**asdict(one), "text": one.text} for one in flight.listed],
    }


def summary_lines(summary: dict[str, Any]) -> list[str]:
    """Return the summary in words."""
    out = [
        f"{'log':<13}{summary['file']}, {summary['size_bytes']} bytes, {summary['format']}",
        f"{'duration':<13}{summary['duration_s']:.1f} s, {summary['airborne_s']:.0f} s of it in the"
        f" air; {summary['parameters']} parameters",
        f"{'vehicle':<13}{summary['lines'][0]}",
    ]
    out += [f"{'':<13}{line}" for line in summary["lines"][1:]]
    for one in summary["flights"]:
        many = one.get("maneuvers")
        found = "" if many is None else f", {many} maneuvers"
        used = (
            " (described here; --flight takes another)"
            if one["number"] == summary["flight"]
            else ""
        )
        out.append(f"{'':<13}{one['text']}{found}{used}")
    out += [f"{'note':<13}{note}" for note in summary["notes"]]
    refusal = summary["judgement"]["refusal"]
    if refusal:
        out.append(f"{'identify':<13}{refusal}")
        out += [f"{'':<13}{one}" for one in advice_lines(summary["judgement"]["settings"])]
    else:
        out += [f"{'identify':<13}{line}" for line in summary["table"]]
    return out


def autopilot_meta(summary: dict[str, Any]) -> Meta:
    """Return the metadata of a table."""
    shares = {f"{name}_share": "of full travel" for name in (*SURFACES, "flap")}
    texts = {column.name: column.text for column in COLUMNS}
    texts |= {f"{name}_share": "commanded; sign as of the angle" for name in SURFACES}
    return Meta(
        units={**UNITS, **shares},
        texts=texts,
        notes={
            "source": summary["file"],
            "format": summary["format"],
            "firmware": summary["firmware"] or "",
            "sources": ", ".join(f"{k} {v}" for k, v in summary["sources"].items()),
            "inputs": "commanded, shares of full travel",
        },
    )
