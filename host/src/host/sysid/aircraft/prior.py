"""What a handbook or a vortex lattice said before the flight, beside what the flight says.

TOML: `[coefficients]` with names as in the answer (`CL_alpha = 4.1`), per radian; the text that AVL
writes with its command ST; or Digital Datcom's output (`datcom`). Both give moments about
stability axes, ours are about body axes: at a few degrees of alpha they differ by that angle times
the other moment, which is not turned here.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path

from host.sysid.aircraft.airframe import Coefficient
from host.sysid.aircraft.datcom import is_datcom, read_datcom
from host.sysid.errors import IdentificationError

_AVL = re.compile(r"\b(CL|CY|Cl|Cm|Cn)([abpqr])\s*=\s*([-+]?\d*\.?\d+(?:[eE][-+]?\d+)?)")
_LABELS = {"a": "alpha", "b": "beta", "p": "p", "q": "q", "r": "r"}


def read_prior(path: Path, alpha_rad: float = 0.0) -> dict[str, float]:
    """Return coefficients by name.

    Parameters
    ----------
    path : Path
        TOML, AVL's ST output, or Datcom's output.
    alpha_rad : float
        Where a table over the angle of attack is read.

    Raises
    ------
    IdentificationError
        If the file cannot be read or holds no coefficient.
    """
    try:
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".toml":
            table = tomllib.loads(text).get("coefficients", {})
            found = {str(k): float(v) for k, v in dict(table).items()}
        elif is_datcom(text):
            found = read_datcom(text, alpha_rad)
        else:
            # The line of the spiral figure, "Clb Cnr / Clr Cnb = ...", is no derivative.
            text = "\n".join(line for line in text.splitlines() if "/" not in line)
            found = {f"{c}_{_LABELS[x]}": float(v) for c, x, v in _AVL.findall(text)}
    except (OSError, ValueError, TypeError) as error:
        raise IdentificationError(f"{path}: {error}") from error
    if not found:
        raise IdentificationError(
            f"{path}: no coefficient; expected TOML with [coefficients], or output of AVL (ST) or"
            " Datcom"
        )
    return found


def prior_lines(coefficients: Sequence[Coefficient], prior: dict[str, float]) -> list[str]:
    """Return a table: identified with its interval, prior, and whether they disagree."""
    lines = [f"{'coefficient':12s} {'identified':>12s} {'95 %':>10s} {'prior':>10s}"]
    for c in coefficients:
        if c.name in prior:
            outside = abs(c.value - prior[c.name]) > c.half_width
            lines.append(
                f"{c.name:12s} {c.value:12.4g} {c.half_width:10.2g} {prior[c.name]:10.4g}"
                f"  {'outside the interval' if outside else 'inside'}"
            )
    return lines
