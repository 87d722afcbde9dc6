"""Foreign names, units and signs through a small TOML map, one line per column of ours:

```toml
[columns]
alpha_rad = { from = "AOA", unit = "deg" }
az_mps2 = { from = "Nz", unit = "g", sign = -1 }
t_s = { from = "TimeUS", unit = "us" }
density_kgpm3 = "rho"
flap_rad = { from = "Flap", unit = "deg" }    # any name, for a model of one's own
elevator_rad = { from = "de", commanded = true }    # a command: the surface comes later
```

Of a table of others a map hides what it does not name, but for the time.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from host.arrays import Array
from host.constants import GRAVITY_MPS2, RAD_PER_DEG
from host.files.quantities import Quantity
from host.files.user_text import read_toml
from host.instrument.recording import SURFACES
from host.sysid.identification_error import IdentificationError

DEG, FOOT, POUND_PA = RAD_PER_DEG, 0.3048, 6894.757
# What a column of ours may come in, by the end of its name.
UNITS: dict[str, dict[str, float]] = {
    "rad": {"rad": 1.0, "deg": DEG, "mrad": 1e-3},
    "radps": {"rad/s": 1.0, "deg/s": DEG},
    "mps2": {"m/s2": 1.0, "g": GRAVITY_MPS2, "ft/s2": FOOT, "mg": 1e-3 * GRAVITY_MPS2},
    "mps": {
        "m/s": 1.0, "kt": 1852.0 / 3600.0, "km/h": 1.0 / 3.6, "mph": 0.44704, "ft/s": FOOT,
        "ft/min": FOOT / 60.0, "cm/s": 0.01,
    },
    "m": {"m": 1.0, "ft": FOOT, "cm": 0.01, "mm": 1e-3},
    "pa": {
        "Pa": 1.0, "hPa": 100.0, "mbar": 100.0, "kPa": 1e3, "psi": POUND_PA,
        "psf": POUND_PA / 144.0, "inHg": 3386.389,
    },
    "kgpm3": {"kg/m3": 1.0, "slug/ft3": 515.3788},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "n": {"N": 1.0, "lbf": 4.448222, "kgf": GRAVITY_MPS2},
    "w": {"W": 1.0, "kW": 1000.0, "hp": 745.6999},
    "throttle": {"1": 1.0, "percent": 0.01},
}  # fmt: skip
# What people write for them.
ALIASES = {
    "degree": "deg", "degrees": "deg", "°": "deg", "radian": "rad", "radians": "rad",
    "deg/sec": "deg/s", "degrees/s": "deg/s", "°/s": "deg/s", "dps": "deg/s", "rad/sec": "rad/s",
    "m/s/s": "m/s2", "m/sec2": "m/s2", "ft/s/s": "ft/s2", "ft/sec2": "ft/s2",
    "knots": "kt", "knot": "kt", "kts": "kt", "kn": "kt", "kph": "km/h", "kmh": "km/h",
    "fps": "ft/s", "ft/sec": "ft/s", "m/sec": "m/s", "mps": "m/s", "fpm": "ft/min",
    "feet": "ft", "meter": "m", "meters": "m", "metres": "m", "pa": "Pa", "hpa": "hPa",
    "kpa": "kPa", "mb": "mbar", "lb/ft2": "psf", "inhg": "inHg", "%": "percent",
    "sec": "s", "seconds": "s", "msec": "ms", "usec": "us", "µs": "us", "μs": "us",
}  # fmt: skip
KEYS = {"from", "unit", "sign", "scale", "offset", "commanded"}
COMMANDABLE = tuple(f"{surface}_rad" for surface in SURFACES)
_FACTOR = Quantity("", -1e12, 1e12, "nanoseconds to seconds: 1e-9; no unit is further from ours")


@dataclass(frozen=True, slots=True)
class Line:
    """One line of a map: ours = foreign * gain + offset; of a surface, whether it is a command."""

    foreign: str
    gain: float
    offset: float
    commanded: bool = False


def read_map(path: Path, known: Sequence[str]) -> dict[str, Line]:
    """Return the lines of a map by the name of our column.

    Parameters
    ----------
    path : Path
    known : sequence of str
        Columns that identification or a model asks for; others are taken too, but for one that
        looks like a misspelt one of these.

    Raises
    ------
    IdentificationError
        If it cannot be read or says what nobody understands.
    """
    document = read_toml(path, IdentificationError)
    lines = document.get("columns")
    if not isinstance(lines, dict) or not lines:
        raise IdentificationError(f"{path}: no table [columns]")
    for name in lines:
        if name not in known and _misspelt(name, known):
            raise IdentificationError(
                f"{path}: unknown column {name}{like(name, known)}; ours are {', '.join(known)}"
            )
    strangers = [key for key in document if key != "columns"]
    if strangers:
        raise IdentificationError(
            f"{path}: unknown key {strangers[0]}; all lines of a map stand below [columns]"
        )
    result = {name: _line(f"{path}: {name}", name, line) for name, line in lines.items()}
    for name, line in result.items():
        others = [k for k, other in result.items() if other.foreign == line.foreign and k != name]
        if others:
            raise IdentificationError(
                f"{path}: {name} and {others[0]} both come from '{line.foreign}'"
            )
    return result


def _misspelt(name: str, known: Sequence[str]) -> bool:
    """Return whether a name is one of ours with a slip: as long, its letters almost the same."""
    near = difflib.get_close_matches(name.lower(), [k.lower() for k in known], n=1, cutoff=0.85)
    digit = any(c.isdigit() for c in name)
    return bool(near) and abs(len(name) - len(near[0])) <= 1 and not digit


def _line(where: str, name: str, line: object) -> Line:
    if isinstance(line, str):
        line = {"from": line}
    if not isinstance(line, dict) or not isinstance(line.get("from"), str):
        raise IdentificationError(f'{where}: expected "name" or {{ from = "name", unit = "..." }}')
    strange = [key for key in line if key not in KEYS]
    if strange:
        raise IdentificationError(
            f"{where}: unknown key {strange[0]}; a line may say {', '.join(sorted(KEYS))}"
        )
    units = UNITS.get(name.rsplit("_", 1)[-1], {"1": 1.0})
    unit = line.get("unit", "") or next(iter(units))
    if isinstance(unit, str) and unit not in units:
        plain = unit.lower().replace("²", "2").replace("^2", "2").replace("**2", "2")
        unit = plain if plain in units else ALIASES.get(plain, unit)
    if not isinstance(unit, str) or unit not in units:
        raise IdentificationError(f"{where}: unit '{unit}' unknown; use one of {', '.join(units)}")
    for key in ("sign", "scale", "offset"):
        _FACTOR.check(f"{where}: {key}", line.get(key, 1), IdentificationError)
    sign, scale = line.get("sign", 1), float(line.get("scale", 1.0))
    if sign not in (1, -1) or scale == 0.0:
        raise IdentificationError(f"{where}: sign must be 1 or -1, scale not zero")
    commanded = line.get("commanded", False)
    if not isinstance(commanded, bool) or ("commanded" in line and name not in COMMANDABLE):
        raise IdentificationError(
            f"{where}: commanded is true or false, of {', '.join(COMMANDABLE)} only"
        )
    offset = float(line.get("offset", 0.0))
    return Line(line["from"], units[unit] * sign * scale, offset, commanded)


def mapped(
    raw: Mapping[str, Array],
    unusable: Mapping[str, str],
    lines: Mapping[str, Line],
    path: Path,
    twice: Collection[str] = (),
) -> dict[str, Array]:
    """Return our columns made of the foreign ones a map names.

    Parameters
    ----------
    raw : mapping
        Foreign columns.
    unusable : mapping
        What else the file holds, and why it is no column.
    lines, path
        The map and where it came from.
    twice : collection of str
        Names that several foreign columns have.

    Raises
    ------
    IdentificationError
        If a foreign column is not there or not usable.
    """
    result: dict[str, Array] = {}
    for name, line in lines.items():
        if line.foreign in twice:
            raise IdentificationError(
                f"{path}: {name}: the data have several columns '{line.foreign}': rename them"
            )
        if line.foreign in unusable and line.foreign not in raw:
            raise IdentificationError(
                f"{path}: {name}: '{line.foreign}' is {unusable[line.foreign]}"
            )
        if line.foreign not in raw:
            raise IdentificationError(
                f"{path}: {name}: the data have no column '{line.foreign}'"
                f"{like(line.foreign, tuple(raw))}; {listed(raw, unusable)}"
            )
        result[name] = raw[line.foreign] * line.gain + line.offset
    return result


def listed(raw: Mapping[str, Array], unusable: Mapping[str, str]) -> str:
    """Return in words which columns a file has."""
    names = list(raw)
    words = f"they have {', '.join(names[:40])}" if names else "they have no column of numbers"
    words += f" and {len(names) - 40} more" if len(names) > 40 else ""
    return words + "".join(f"; {name} is {why}" for name, why in list(unusable.items())[:5])


def like(name: str, known: Sequence[str]) -> str:
    """Return in brackets which of the known names may have been meant; empty if none."""
    lower = {k.lower(): k for k in known}
    near = difflib.get_close_matches(name.lower(), lower, n=1, cutoff=0.6)
    return f" (did you mean {lower[near[0]]}?)" if near else ""
