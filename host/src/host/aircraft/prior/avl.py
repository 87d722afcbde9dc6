"""Coefficients from what AVL writes with its commands ST (stability axes) and SB (body axes).

Several outputs in one file make a table over the angle of attack. Derivatives by alpha and beta
are per radian, rates are referred to half chord and half span over airspeed, as ours are. SB has
derivatives by the velocities u, v, w over the airspeed instead of alpha and beta. Controls are per
unit of AVL's control variable, taken for one degree of surface; their sign is the geometry file's
choice, so it is turned until Cm_de < 0, Cl_da > 0, Cn_dr < 0. Elevons count as elevator or as
aileron by their larger moment. Values printed as stars or as no number, and controls of other
names, are reported and left out.
"""

from __future__ import annotations

import re

import numpy as np

from host.aircraft.prior.prior_table import Points, PriorError, PriorTable
from host.constants import DEG_PER_RAD

_NUMBER = r"([-+]?\d*\.?\d+(?:[eE][-+]?\d+)?)"
_DERIVATIVE = re.compile(rf"\b(C[LDYXZlmn])([abpqruvw]|d\d+)\s*=\s*{_NUMBER}")
_NO_NUMBER = re.compile(
    r"\b(C[LDYXZlmn](?:[abpqruvw]|d\d+))\s*=\s*(?:\*+|[-+]?(?:nan|inf\w*))", re.IGNORECASE
)
_CONTROL = re.compile(r"(\S+)\s+d(\d+)\b(?!\s*=)")
_TITLE = re.compile(r"^(.*(?:Stability|Geometry)-axis derivatives)", re.MULTILINE)
_RUN = re.compile(r"Vortex Lattice Output", re.IGNORECASE)
LETTERS = {"a": "alpha", "b": "beta", "p": "p", "q": "q", "r": "r"}
SURFACES = {"elev": ("de", "Cm", -1.0), "ail": ("da", "Cl", 1.0), "rud": ("dr", "Cn", -1.0)}


def is_avl(text: str) -> bool:
    """Return whether a text looks like AVL's ST or SB output."""
    return _TITLE.search(text) is not None


def read_avl(text: str) -> PriorTable | None:
    """Return the table of one or several outputs; None if they hold no derivative.

    Parameters
    ----------
    text : str
        Files as AVL wrote them, one after another.

    Raises
    ------
    PriorError
        If ST and SB are mixed, or moments have AVL's geometric orientation (x aft, z up).
    """
    points: Points = {}
    kinds = set()
    header = ""
    left: dict[str, None] = {}
    strangers: dict[str, None] = {}
    for run in _runs(text):
        if "Geometric axis orientation" in run:
            raise PriorError(
                "AVL wrote x aft, z up (geometric axis orientation); expected its standard one,"
                " x forward, z down"
            )
        body = "Geometry-axis" in run
        kinds.add(body)
        alpha_deg = _value(run, "Alpha")
        if alpha_deg is None:
            raise PriorError(
                "AVL's 'Alpha =' is missing or no number; expected the whole output of ST or SB"
            )
        alpha = float(np.radians(alpha_deg))
        left |= dict.fromkeys(_NO_NUMBER.findall(run))
        strangers |= dict.fromkeys(x for x in _entries(run) if len(x) > 1 and not _kind(x))
        found = _from_body(run, alpha) if body else _from_stability(run)
        for name, value in found.items():
            points.setdefault(name, []).append((alpha, value))
        header = header or run
    if len(kinds) > 1:
        raise PriorError("AVL's ST and SB outputs in one file; give one kind")
    if not points:
        return None
    body = kinds.pop()
    where = f"AVL, {'body' if body else 'stability'} axes"
    sizes = [(label, _value(header, label)) for label in ("Sref", "Cref", "Bref", "Xref", "Zref")]
    references = ", ".join(f"{label} {value:g}" for label, value in sizes if value is not None)
    remarks = [f"{', '.join(left)} printed as no number: left out"] if left else []
    if strangers:
        remarks.append(f"control {', '.join(strangers)} no elevator, aileron or rudder: left out")
    return PriorTable(points, stability_axes=not body, source=(where, references, *remarks))


def _runs(text: str) -> list[str]:
    starts = [m.start() for m in _RUN.finditer(text)]
    if not starts:
        return [text]
    parts = [text[a:b] for a, b in zip(starts, [*starts[1:], len(text)], strict=True)]
    return [part for part in parts if _TITLE.search(part)]


def _value(text: str, label: str) -> float | None:
    found = re.search(rf"\b{label}\s*=\s*{_NUMBER}", text)
    return float(found.group(1)) if found else None


def _entries(run: str) -> dict[str, dict[str, float]]:
    """Return printed derivatives: by letter of the variable or surface, then by coefficient."""
    title = _TITLE.search(run)
    after = run[title.end() :] if title else run
    # The line of the spiral figure, "Clb Cnr / Clr Cnb = ...", is no derivative.
    lines = "\n".join(line for line in after.splitlines() if "/" not in line)
    controls = {int(number): name for name, number in _CONTROL.findall(lines)}
    found: dict[str, dict[str, float]] = {}
    for coefficient, letter, value in _DERIVATIVE.findall(lines):
        label = controls.get(int(letter[1:]), letter) if letter[0] == "d" else letter
        found.setdefault(label, {}).setdefault(coefficient, float(value))
    return found


def _from_stability(run: str) -> dict[str, float]:
    entries = _entries(run)
    found = {f"{c}_{LETTERS[x]}": v for x in LETTERS for c, v in entries.get(x, {}).items()}
    return found | _controls(entries)


def _from_body(run: str, alpha: float) -> dict[str, float]:
    """Return derivatives by alpha at constant airspeed: du = -sin(alpha), dw = cos(alpha)."""
    entries = _entries(run)
    cos, sin = float(np.cos(alpha)), float(np.sin(alpha))
    found = {f"{c}_{LETTERS[x]}": v for x in "pqr" for c, v in entries.get(x, {}).items()}
    found |= {f"{c}_beta": v for c, v in entries.get("v", {}).items()}
    by_u, by_w = entries.get("u", {}), entries.get("w", {})
    found |= {f"{c}_alpha": cos * by_w[c] - sin * by_u[c] for c in by_u.keys() & by_w.keys()}
    found |= _controls(entries)
    total = [_value(run, label) for label in ("CXtot", "CZtot")]
    for last in {name.split("_", 1)[1] for name in found}:
        X, Z = found.pop(f"CX_{last}", None), found.pop(f"CZ_{last}", None)
        if X is None or Z is None:
            continue
        lift, drag = X * sin - Z * cos, -X * cos - Z * sin
        if last == "alpha":
            if total[0] is None or total[1] is None:
                continue
            # Lift and drag turn with the wind: each gains the other's share of the force itself.
            lift += total[0] * cos + total[1] * sin
            drag += total[0] * sin - total[1] * cos
        found |= {f"CL_{last}": lift, f"CD_{last}": drag}
    return found


def _kind(label: str) -> str:
    """Return the beginning of `SURFACES` that a control's name has; nothing where none."""
    return next((start for start in SURFACES if label.lower().startswith(start)), "")


def _controls(entries: dict[str, dict[str, float]]) -> dict[str, float]:
    found: dict[str, float] = {}
    for label, values in entries.items():
        start = _kind(label) if len(label) > 1 else ""
        if label.lower().startswith("elevon"):
            rolls = abs(values.get("Cl", 0.0)) > abs(values.get("Cm", 0.0))
            start = "ail" if rolls else "elev"
        suffix, moment, sign = SURFACES.get(start, ("", "", 0.0))
        if moment not in values:
            continue
        turn = np.sign(sign * values[moment]) * DEG_PER_RAD
        for coefficient, value in values.items():
            found.setdefault(f"{coefficient}_{suffix}", float(turn * value))
    return found
