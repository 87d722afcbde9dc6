"""A flight card in words: whose it is, its limits, its rows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from host.wire.flight_card import AXES, HEAD, HELD, NONE, CardFile, components, held_axes, scale
from host.wire.schema_text import packed_schema

NAMES = {"three_two_one_one": "3-2-1-1"}


def card_document(card: CardFile) -> dict[str, Any]:
    """Return a card as plain numbers and strings, raw."""
    return {
        "hash": f"{card.hash:08x}",
        "head": _plain(card.head),
        "rows": list(card.rows),
        "teaches": list(card.teaches),
        "hold": _plain(card.hold) if card.hold else None,
    }


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    return {
        k: v.decode("ascii", "replace") if isinstance(v, bytes) else v for k, v in values.items()
    }


def card_lines(card: CardFile) -> list[str]:
    """Return a card as people read it."""
    head = card.head
    whose = head["aircraft"].decode("ascii", "replace")

    def degrees(name: str) -> float:
        return math.degrees(head[name] * scale(HEAD, name))

    lines = [
        f"card {card.hash:08x} of {whose}, {len(card.rows)} rows",
        f"  ends at: sticks {head['stick_us']} us from their places, bank"
        f" {degrees('phi_max'):.0f}, pitch {degrees('theta_min'):.0f} to"
        f" {degrees('theta_max'):.0f} deg, rates {degrees('p_max'):.0f}, {degrees('q_max'):.0f},"
        f" {degrees('r_max'):.0f} deg/s,",
        f"    az {head['az_min'] * scale(HEAD, 'az_min'):.1f} to"
        f" {head['az_max'] * scale(HEAD, 'az_max'):.1f} m/s2, {head['height_min_pa'] / 12.0:.0f}"
        f" to {head['height_max_pa'] / 12.0:.0f} m above the field, {head['distance_max_m']} m"
        " from home",
        f"    travel {_travel(head)} us, at most {head['rate_max_usps']} us/s and"
        f" {head['frequency_max_chz'] / 100.0:g} Hz",
        f"  starts where for 3 s {_proof(head)}",
    ]
    if card.hold:
        lines.append(f"  {_hold(card.hold)}")
    for k, (row, turn) in enumerate(zip(card.rows, card.teaches, strict=True), start=1):
        lines.append(f"  {k:2d}  {_row(row)}{f'; teaches {turn}' if turn else ''}")
    return lines


def _hold(hold: Mapping[str, Any]) -> str:
    """Return whose gains they are, how far each surface goes, and what shows its sense."""
    model = hold["model"].decode("ascii", "replace")
    date = str(hold["model_date"])
    each = ", ".join(
        f"{axis} up to {most} us, a longer pulse {'raises' if gain > 0 else 'lowers'} {angle}"
        for axis, angle, most, gain in zip(
            HELD, ("the right-wing-down angle", "the nose"),
            hold["authority_us"], hold["angle_gain"], strict=True,
        )
    )  # fmt: skip
    return f"holds with gains of {model}, {date[:4]}-{date[4:6]}-{date[6:]}: {each}"


def _proof(head: Mapping[str, Any]) -> str:
    """Return what the logger takes for flying (firmware/core/flying_proof.h)."""
    gps = "GPS above 5 m/s over ground"
    if head["airspeed_input"] == NONE:
        return f"{gps}: the card names no pitot, and without GPS no row starts"
    return (
        "the pitot reads the least airspeed, and 100 Pa (12.8 m/s) above its zero, or"
        f" {gps}; with neither no row starts"
    )


def _travel(head: Mapping[str, Any]) -> str:
    return ", ".join(
        f"{axis} {low} to {high}"
        for axis, low, high in zip(AXES, head["servo_min_us"], head["servo_max_us"], strict=True)
    )


def _row(row: Mapping[str, Any]) -> str:
    shapes = {value: name for name, value in packed_schema().enums["card_shape"].items()}
    shape = shapes.get(row["shape"], f"shape {row['shape']}")
    moved = ", ".join(
        f"{axis} {size:+d} us" for axis, size in zip(AXES, row["amplitude_us"], strict=True) if size
    )
    tones = components(row)
    hertz = [1000.0 * harmonic / row["duration_ms"] for _, harmonic, _, _ in tones]
    if shape == "sweep":
        hertz = [row["first_chz"] / 100.0, row["last_chz"] / 100.0]
    held = held_axes(row)
    holds = f"; holds {', '.join(held)}" if held else ""
    band = f", {min(hertz):.2g} to {max(hertz):.2g} Hz" if hertz else ""
    return (
        f"{NAMES.get(shape, shape)}: {moved}; {row['duration_ms'] / 1000.0:g} s"
        f" behind {row['quiet_ms'] / 1000.0:g} s of quiet{band}{holds}"
    )
