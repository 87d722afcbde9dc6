"""Read a flight into an even SI table: log, CSV, Parquet or MAT, foreign names through a map.

The map is TOML, one line per column of ours:

```toml
[columns]
alpha_rad = { from = "AOA", unit = "deg" }
az_mps2 = { from = "Nz", unit = "g", sign = -1 }
t_s = { from = "TimeUS", unit = "us" }
```
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from host.compiled import Array
from host.sysid.errors import IdentificationError

if TYPE_CHECKING:
    import pandas as pd

UNITS = {
    "": 1.0, "rad": 1.0, "rad/s": 1.0, "m/s": 1.0, "m/s2": 1.0, "s": 1.0, "Pa": 1.0, "m": 1.0,
    "deg": np.pi / 180.0, "deg/s": np.pi / 180.0, "kt": 1852.0 / 3600.0, "km/h": 1.0 / 3.6,
    "ft": 0.3048, "ft/s": 0.3048, "ft/s2": 0.3048, "g": 9.80665, "ms": 1e-3, "us": 1e-6,
    "hPa": 100.0, "percent": 0.01,
}  # fmt: skip
ANGLES = ("alpha_rad", "beta_rad", "phi_rad", "theta_rad", "psi_rad")
USED = (
    "airspeed_mps", "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps",
    "ax_mps2", "ay_mps2", "az_mps2", "phi_rad", "theta_rad", "psi_rad",
    "elevator_rad", "aileron_rad", "rudder_rad", "throttle",
    "qbar_pa", "static_pa", "density_kgpm3", "altitude_m",
    "v_north_mps", "v_east_mps", "v_down_mps",
)  # fmt: skip
WANTED = frozenset(("t_s", *USED))
LONGEST_GAP_S = 0.25


def read_columns(
    source: Path, mapping: Path | None = None, *, calibration: Path | None = None
) -> tuple[dict[str, Array], list[str]]:
    """Return the columns identification uses, and notes about what was done to them.

    Parameters
    ----------
    source : Path
        ``.bin`` log, ``.csv``, ``.parquet`` or ``.mat``; a folder is read as a log.
    mapping : Path, optional
        TOML map of foreign names, units and signs.
    calibration : Path, optional
        Calibration of a log; the default one without.

    Raises
    ------
    IdentificationError
        If the file or the map cannot be used.
    """
    if not source.exists():
        raise IdentificationError(f"{source}: no such file")
    notes: list[str] = []
    kind = source.suffix.lower()
    if kind == ".csv":
        raw = _from_frame(_csv(source))
    elif kind == ".parquet":
        raw = _from_frame(_parquet(source))
    elif kind == ".mat":
        raw = _mat(source)
    else:
        from host.log import read_log
        from host.summary import calibration_note

        log = read_log(source, calibration=calibration)
        raw = {k: np.asarray(v, dtype=np.float64) for k, v in log.columns().items() if k in WANTED}
        poor_columns = [c for c in calibration_note(log)["default_columns"] if c in USED]
        if poor_columns:
            notes.append(
                "default calibration, not this instrument's own, under: " + ", ".join(poor_columns)
            )
        poor = [f"{name} {how}" for name, how in log.inputs.items() if how != "measured"]
        if poor:
            notes.append(f"control inputs: {', '.join(poor)}")
    if mapping is not None:
        raw = {**raw, **_mapped(raw, mapping)}
    if "t_s" not in raw:
        raise IdentificationError(f"{source}: no column t_s; name it in a map (--map)")
    return _even({k: raw[k] for k in ("t_s", *USED) if k in raw}, notes), notes


def even_columns(table: pd.DataFrame) -> tuple[dict[str, Array], list[str]]:
    """Return the columns identification uses of a decoded table, on an even grid, and notes.

    Raises
    ------
    IdentificationError
        If there is no time in it, or too little of it.
    """
    raw = {k: v for k, v in _from_frame(table).items() if k in WANTED}
    if "t_s" not in raw:
        raise IdentificationError("no column t_s in the table")
    notes: list[str] = []
    return _even(raw, notes), notes


def _csv(source: Path) -> pd.DataFrame:
    import pandas as pd

    try:
        return pd.read_csv(source, comment="#")
    except (ValueError, UnicodeDecodeError) as error:
        raise IdentificationError(f"{source}: not a CSV table: {error}") from error


def _parquet(source: Path) -> pd.DataFrame:
    import pandas as pd

    try:
        return pd.read_parquet(source)
    except ImportError as error:
        raise IdentificationError(
            f"{source}: Parquet needs the extra: pip install './host[parquet]'"
        ) from error
    except (ValueError, OSError) as error:
        raise IdentificationError(f"{source}: not a Parquet file: {error}") from error


def _from_frame(frame: pd.DataFrame) -> dict[str, Array]:
    columns: dict[str, Array] = {}
    for name in frame.columns:
        values = frame[name]
        if values.dtype.kind in "fiub":
            columns[str(name)] = values.to_numpy(dtype=np.float64)
    return columns


def _mat(source: Path) -> dict[str, Array]:
    from scipy import io

    try:
        content = io.loadmat(source, squeeze_me=True, struct_as_record=True)
    except (ValueError, NotImplementedError, OSError) as error:
        raise IdentificationError(f"{source}: not a MAT file of version 4 to 7: {error}") from error
    columns: dict[str, Array] = {}
    for name, value in content.items():
        array = np.asarray(value)
        if array.dtype.names:
            for field in array.dtype.names:
                inner = np.asarray(array[field].item() if array.shape == () else array[field])
                if inner.ndim == 1 and inner.dtype.kind in "fiu":
                    columns[field] = inner.astype(np.float64)
        elif array.ndim == 1 and array.dtype.kind in "fiu":
            columns[name] = array.astype(np.float64)
    return columns


def _mapped(raw: Mapping[str, Array], mapping: Path) -> dict[str, Array]:
    try:
        with mapping.open("rb") as file:
            document = tomllib.load(file)
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise IdentificationError(f"{mapping}: cannot be used as a map: {error}") from error
    lines = document.get("columns")
    if not isinstance(lines, dict):
        raise IdentificationError(f"{mapping}: no table [columns]")
    result: dict[str, Array] = {}
    for name, line in lines.items():
        if isinstance(line, str):
            line = {"from": line}
        foreign = line.get("from") if isinstance(line, dict) else None
        unit = line.get("unit", "") if isinstance(line, dict) else ""
        if name not in ("t_s", *USED):
            raise IdentificationError(f"{mapping}: unknown column {name}")
        if foreign not in raw:
            raise IdentificationError(f"{mapping}: {name}: the data have no column '{foreign}'")
        if unit not in UNITS:
            raise IdentificationError(
                f"{mapping}: {name}: unit '{unit}' unknown; use one of {', '.join(UNITS)}"
            )
        scale = UNITS[unit] * float(line.get("sign", 1)) * float(line.get("scale", 1))
        result[name] = raw[str(foreign)] * scale + float(line.get("offset", 0))
    return result


def _even(columns: dict[str, Array], notes: list[str]) -> dict[str, Array]:
    """Bring the table to an even grid, unwrap angles once, fill short gaps."""
    t = columns["t_s"]
    good = np.isfinite(t)
    t = t[good]
    if len(t) < 32 or not np.all(np.diff(t) > 0.0):
        order = np.argsort(t, kind="stable")
        keep = np.concatenate([[True], np.diff(t[order]) > 0.0]) if len(t) else np.array([])
        if len(t) < 32 or keep.sum() < 32:
            raise IdentificationError(f"{len(t)} samples with a time, at least 32 are needed")
        notes.append("time ran backwards or stood still; samples were sorted")
        index = np.flatnonzero(good)[order][keep.astype(bool)]
    else:
        index = np.flatnonzero(good)
    t = columns["t_s"][index]
    dt_s = float(np.median(np.diff(t)))
    grid = t[0] + dt_s * np.arange(int((t[-1] - t[0]) / dt_s) + 1)
    gaps = np.diff(t)
    if float(gaps.max()) > LONGEST_GAP_S:
        notes.append(f"{int((gaps > LONGEST_GAP_S).sum())} gaps, the longest {gaps.max():.2f} s")
    result: dict[str, Array] = {"t_s": grid}
    for name, values in columns.items():
        if name == "t_s":
            continue
        series = values[index]
        seen = np.isfinite(series)
        if seen.sum() < 0.5 * len(series):
            notes.append(f"{name}: {100.0 * (1.0 - seen.mean()):.0f} % missing, not used")
            continue
        series = series[seen]
        if name in ANGLES:
            series = np.unwrap(series)
        result[name] = np.interp(grid, t[seen], series)
    return result
