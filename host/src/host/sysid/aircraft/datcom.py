"""Coefficients from the output of Digital Datcom (`for006.dat`), at an angle of attack.

Tables of fixed columns: a header, then a row per angle of attack; what does not change with it is
printed in the first row only, what the method does not know as NDM or stars. A file holds the
tables of several configurations, each later one more complete: the last is taken. Williams &
Vukelich, The USAF Stability and Control Digital Datcom, AFFDL-TR-79-3032, vol. I, sec. 6. Rates are
referred to half chord and half span over airspeed, as ours are.
"""

from __future__ import annotations

import re

import numpy as np

STATIC = {
    "CLA": "CL_alpha",
    "CMA": "Cm_alpha",
    "CYB": "CY_beta",
    "CNB": "Cn_beta",
    "CLB": "Cl_beta",
}
DYNAMIC = {
    "CLQ": "CL_q", "CMQ": "Cm_q", "CLP": "Cl_p", "CYP": "CY_p", "CNP": "Cn_p", "CNR": "Cn_r",
    "CLR": "Cl_r",
}  # fmt: skip
NAMES = {**STATIC, **DYNAMIC}
_NUMBER = re.compile(r"[-+]?\d*\.\d+(?:E[-+]?\d+)?")
_UNIT = re.compile(r"DERIVATIVES?\s*\(PER (DEGREE|RADIAN)\)")


def is_datcom(text: str) -> bool:
    """Return whether a text looks like Datcom's output."""
    return "ALPHA" in text and _UNIT.search(text) is not None


def read_datcom(text: str, alpha_rad: float) -> dict[str, float]:
    """Return coefficients per radian, between the rows of the table at `alpha_rad`.

    Parameters
    ----------
    text : str
        What Datcom wrote.
    alpha_rad : float
        Angle of attack wanted; at the ends of the table its last row stands.
    """
    found: dict[str, float] = {}
    scale, columns = 1.0, {}
    rows: dict[str, list[tuple[float, float]]] = {}
    for line in [*text.splitlines(), "1"]:
        unit = _UNIT.search(line)
        if unit:
            scale = 180.0 / np.pi if unit.group(1) == "DEGREE" else 1.0
        tokens = {m.group(): m.span() for m in re.finditer(r"[A-Z]+", line)}
        header = "ALPHA" in tokens and any(name in tokens for name in NAMES)
        if header or line.startswith("1") or (line.startswith("0") and line[1:].strip()):
            for name, points in rows.items():
                alpha, value = np.array(sorted(points)).T
                found[NAMES[name]] = scale * float(np.interp(np.degrees(alpha_rad), alpha, value))
            rows = {}
            columns = {k: 0.5 * sum(v) for k, v in tokens.items()} if header else {}
            continue
        values = [(float(m.group()), 0.5 * sum(m.span())) for m in _NUMBER.finditer(line)]
        if not columns or len(values) < 2:
            continue
        for value, middle in values[1:]:
            name = min(columns, key=lambda k: abs(columns[k] - middle))
            if name in NAMES:
                rows.setdefault(name, []).append((values[0][0], value))
    return found
