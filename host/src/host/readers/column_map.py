"""Foreign names, units and signs through a small TOML map, one line per column of ours:

```toml
[columns]
alpha_rad = { from = "AOA", unit = "deg" }
az_mps2 = { from = "Nz", unit = "g", sign = -1 }
t_s = { from = "TimeUS", unit = "us" }
density_kgpm3 = "rho"
flap_rad = { from = "Flap", unit = "deg" }    # any name, for a model of one's own
elevator_rad = { from = "de", commanded = true }    # a command: the surface comes later
aileron_rad = { from = "left", minus = "right", scale = 0.5 }
```

A map hides what it does not name of a table of others, but for the time. `base = "inav"` above it
all takes the lines of a shipped map (`shipped_maps.py`) that it does not have itself.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from host.arrays import Array
from host.constants import GRAVITY_MPS2, RAD_PER_DEG
from host.errors import IdentificationError
from host.files.quantities import Quantity
from host.files.user_text import read_toml
from host.near_names import like
from host.physical.recording import SURFACES
from host.readers.shipped_maps import is_shipped, map_file

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
LONGEST_MESSAGE = 200  # characters of what is said about a map
KEYS = {"from", "minus", "unit", "sign", "scale", "offset", "commanded"}
HEADS = {"columns", "about", "base"}
COMMANDABLE = tuple(f"{surface}_rad" for surface in SURFACES)
_FACTOR = Quantity("", -1e12, 1e12, "nanoseconds to seconds: 1e-9; no unit is further from ours")


@dataclass(frozen=True, slots=True)
class Line:
    """One line of a map: ours = (foreign - minus) * gain + offset; of a surface, whether it is a
    command. Where a shipped map says it, the data may lack it."""

    foreign: str
    gain: float
    offset: float
    commanded: bool = False
    minus: str = ""
    shipped: bool = False

    @property
    def needed(self) -> tuple[str, ...]:
        """The foreign columns it is made of."""
        return (self.foreign, self.minus) if self.minus else (self.foreign,)


def read_map(path: Path, known: Sequence[str]) -> dict[str, Line]:
    """Return the lines of a map by the name of our column.

    Parameters
    ----------
    path : Path
        File, or the name of a shipped map.
    known : sequence of str
        Columns that identification or a model asks for; others are taken too, but for one that
        looks like a misspelt one of these.

    Raises
    ------
    IdentificationError
        If it cannot be read or says what nobody understands.
    """
    try:
        return _read_map(path, known)
    except IdentificationError as error:  # it repeats a stranger's words
        text, most = str(error), LONGEST_MESSAGE
        raise IdentificationError(text if len(text) <= most else f"{text[: most - 3]}...") from None


def _read_map(path: Path, known: Sequence[str]) -> dict[str, Line]:
    shipped = is_shipped(path)
    path = map_file(path)
    document = read_toml(path, IdentificationError)
    lines = document.get("columns")
    if not isinstance(lines, dict) or not lines:
        raise IdentificationError(f"{path}: no table [columns]")
    for name in lines:
        if name not in known and _misspelt(name, known):
            raise IdentificationError(
                f"{path}: unknown column {name}{like(name, known)}; ours are {', '.join(known)}"
            )
    strangers = [key for key in document if key not in HEADS]
    if strangers:
        raise IdentificationError(
            f"{path}: unknown key {strangers[0]}; all lines of a map stand below [columns]"
        )
    own = {
        name: replace(_line(f"{path}: {name}", name, line), shipped=shipped and name != "t_s")
        for name, line in lines.items()
    }
    for name, line in own.items():
        others = [k for k, other in own.items() if other.foreign == line.foreign and k != name]
        if others:
            raise IdentificationError(
                f"{path}: {name} and {others[0]} both come from '{line.foreign}'"
            )
    base = document.get("base", "")
    if base and (shipped or not isinstance(base, str) or not is_shipped(Path(base))):
        raise IdentificationError(
            f"{path}: base is {base!r}, expected a shipped map; `--map list` shows them"
        )
    return (read_map(Path(base), known) if base else {}) | own


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
    minus = line.get("minus", "")
    if not isinstance(minus, str):
        raise IdentificationError(f'{where}: minus is {minus!r}, expected "name"')
    return Line(line["from"], units[unit] * sign * scale, offset, commanded, minus)


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
        if line.shipped and not all(column in raw for column in line.needed):
            continue
        for column in line.needed:
            _usable(f"{path}: {name}", column, raw, unusable, twice)
        values = raw[line.foreign] - raw[line.minus] if line.minus else raw[line.foreign]
        result[name] = values * line.gain + line.offset
    return result


def missing_lines(lines: Mapping[str, Line], raw: Collection[str]) -> list[str]:
    """Return a note where a shipped map names columns that the data do not have."""
    gone = [name for name, line in lines.items() if not set(line.needed) <= set(raw)]
    return [f"the map names {', '.join(gone)}, which the data do not have"] if gone else []


def _usable(
    where: str,
    column: str,
    raw: Mapping[str, Array],
    unusable: Mapping[str, str],
    twice: Collection[str],
) -> None:
    """Refuse a foreign column that is not there, is none, or is there twice."""
    if column in twice:
        raise IdentificationError(f"{where}: the data have several columns '{column}': rename them")
    if column in unusable and column not in raw:
        raise IdentificationError(f"{where}: '{column}' is {unusable[column]}")
    if column not in raw:
        raise IdentificationError(
            f"{where}: the data have no column '{column}'"
            f"{like(column, tuple(raw))}; {listed(raw, unusable)}"
        )


def listed(raw: Mapping[str, Array], unusable: Mapping[str, str]) -> str:
    """Return in words which columns a file has."""
    names = list(raw)
    words = f"they have {', '.join(names[:40])}" if names else "they have no column of numbers"
    words += f" and {len(names) - 40} more" if len(names) > 40 else ""
    return words + "".join(f"; {name} is {why}" for name, why in list(unusable.items())[:5])
