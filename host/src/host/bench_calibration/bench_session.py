"""One calibration from its sources to its file: read, fit, check, write, draw, report."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from host.bench_calibration.bench_answer import iron_report, line_report, plain, supply_report
from host.bench_calibration.bench_log import BenchLog, FaceLog, LogSource, turns_of
from host.bench_calibration.bench_plan import AIR_KGPM3, Subject, local_gravity_mps2
from host.bench_calibration.bifilar_pendulum import mass_section, read_swings
from host.bench_calibration.calibrated_lines import Calibrated, calibrated_lines
from host.bench_calibration.calibration_file import Made, lines_of, write_lines
from host.bench_calibration.calibration_picture import draw_picture
from host.bench_calibration.hard_iron import hard_iron
from host.bench_calibration.held_position import Held, Source
from host.bench_calibration.other_sensor import judged_subject
from host.bench_calibration.reading_table import TableSource, number_of, rows_of
from host.bench_calibration.six_faces import FaceTable, crooked_deg, crooked_doubt
from host.bench_calibration.supply_reference import NOMINAL_MV, supply_reference
from host.bench_calibration.turned_gyro import Rest, Turn, gyro_lines, read_turns
from host.bench_calibration.typed_readings import TypedSource
from host.bench_calibration.usb_channels import UsbChannels
from host.bench_calibration.usb_port import is_port, open_port, record_port
from host.bench_calibration.usb_readings import UsbSource
from host.errors import ExitCode, UsageError
from host.files.regular import regular_file

TYPED = Path("-")
_RECORDED = ("accelerometers", "gyros")  # over USB: in any order, found in what was recorded


@dataclass(frozen=True, slots=True)
class Bench:
    """Request of a calibration.

    Attributes
    ----------
    sources : tuple of Path
        Tables, logs, captured radio, the logger's port; ``-``: typed. A further source is a
        further repeat.
    positions : tuple of float
        Positions of one round; empty: those of the subject.
    into, picture : Path or None
        None: named by instrument and date; in the file's folder.
    turn_deg : float
        Turn of the gyros' turntable, in a recording.
    """

    subject: Subject
    channel: str
    sources: tuple[Path, ...]
    positions: tuple[float, ...] = ()
    instrument: str = "instrument"
    day: str = ""
    by: str = ""
    serials: Mapping[str, str] = field(default_factory=dict)
    temperature_degc: float | None = None
    latitude_deg: float | None = None
    density_kgpm3: float = AIR_KGPM3
    turn_deg: float = 3600.0
    was_mv: float = NOMINAL_MV
    mass_kg: tuple[float, float] | None = None
    cg_tolerance_m: float = 0.010
    into: Path | None = None
    picture: Path | None = None


@dataclass(frozen=True, slots=True)
class Result:
    """Result of a calibration: lines for people, plain data, files, the exit code."""

    lines: tuple[str, ...]
    data: dict[str, Any]
    files: tuple[Path, ...]
    exit_code: ExitCode


def calibrate(
    bench: Bench,
    ask: Callable[[str], str] = input,
    say: Callable[[str], None] = print,
    show: Callable[[str], None] | None = None,
) -> Result:
    """Calibrate one subject; lines that nobody doubts go into the file.

    Parameters
    ----------
    bench : Bench
    ask, say : callable
        A question to whoever is at the bench, and a line for them.
    show : callable, optional
        Takes the question again with the value over USB as it is now.

    Raises
    ------
    UsageError
        If a source is none, or too little is in it; DeviceError of a port.
    """
    if bench.picture is not None and bench.picture.suffix.lower() != ".svg":
        raise UsageError(f"{bench.picture}: a picture's name ends in .svg")
    ports = [p for p in bench.sources if is_port(p)]
    if ports and bench.subject.name in ("magnetometer", "supply", "inertia", "speed"):
        raise UsageError(
            f"{ports[0]}: {bench.subject.name} is not read over USB; give a table or a recording"
            f" (host calibrate {bench.subject.name} says how)"
        )
    if bench.subject.name == "magnetometer":
        return _magnetometer(bench)
    if bench.subject.name == "supply":
        return _supply(bench)
    if bench.subject.name == "inertia":
        return _inertia(bench)
    if bench.subject.name in _RECORDED:
        sources = [
            record_port(p, bench.subject, ask, say) if is_port(p) else p for p in bench.sources
        ]
        bench = replace(bench, sources=tuple(sources))
    temperature, lines, extra = _lines(bench, ask, say, show)
    made = Made(
        bench.instrument,
        bench.day or date.today().isoformat(),
        bench.by,
        bench.serials,
        bench.temperature_degc if bench.temperature_degc is not None else temperature,
    )
    said = [*line_report(bench.subject, lines), *extra]
    tables = lines_of(bench.subject, lines, made)
    files = []
    into = bench.into or Path(f"{_file_name(made.instrument)}-{made.date}.toml")
    if tables:
        write_lines(into, bench.subject, tables, made)
        files.append(into)
        said.append(f"wrote {', '.join(f'{bench.subject.table}.{t}' for t in tables)} to {into}")
    else:
        said.append("nothing was written: no line without doubt")
    picture = bench.picture or into.with_name(f"{into.stem}-{bench.subject.name}.svg")
    if any(c.fit is not None for c in lines):
        draw_picture(bench.subject, lines, picture)
        files.append(picture)
        said.append(f"drew {picture}")
    doubted = bool(extra) or any(c.doubt for c in lines)
    code = ExitCode.CHECK if doubted else ExitCode.OK
    data = plain(bench.subject, lines) | {"files": [str(f) for f in files]}
    return Result(tuple(said), data, tuple(files), code)


def _lines(
    bench: Bench,
    ask: Callable[[str], str],
    say: Callable[[str], None],
    show: Callable[[str], None] | None,
) -> tuple[float | None, list[Calibrated], list[str]]:
    """Return temperature, lines, and further faults in words."""
    logs = {p: BenchLog.read(p) for p in bench.sources if _is_log(p)}
    warm = [t for log in logs.values() if (t := log.temperature_degc()) is not None]
    temperature = float(np.mean(warm)) if warm else None
    if bench.subject.name == "gyros":
        return temperature, _gyros(bench, logs), []
    held: list[Held] = []
    for path in bench.sources:
        first = max((p.repeat for p in held), default=0) + 1
        if is_port(path):
            held += _over_usb(bench, path, first, ask, say, show)
        else:
            held += _source(bench, path, logs, first, ask, say).held()
    subject = judged_subject(bench.subject, held, ask)
    lines = calibrated_lines(subject, held, density_kgpm3=bench.density_kgpm3)
    if not lines:
        wanted = bench.channel or ", ".join(bench.subject.channels)
        raise UsageError(f"no reading of {wanted} in {', '.join(map(str, bench.sources))}")
    extra = []
    if bench.subject.name == "accelerometers":
        crooked = crooked_doubt(bench.subject, crooked_deg(held, lines))
        extra = [f"  {crooked}"] if crooked else []
    return temperature, lines, extra


def _source(
    bench: Bench,
    path: Path,
    logs: Mapping[Path, BenchLog],
    first: int,
    ask: Callable[[str], str],
    say: Callable[[str], None],
) -> Source:
    subject, channel = bench.subject, bench.channel
    if subject.name == "accelerometers":
        gravity = local_gravity_mps2(bench.latitude_deg)
        return (
            FaceLog(logs[path], gravity, first) if path in logs else FaceTable(path, gravity, first)
        )
    if path not in logs and path != TYPED:
        return TableSource(path, subject, channel, first)
    _one_channel(bench)
    positions = bench.positions or subject.positions
    if path == TYPED:
        return TypedSource(subject, channel, positions, ask, say)
    return LogSource(logs[path], subject, channel, positions, first)


def _over_usb(
    bench: Bench,
    path: Path,
    first: int,
    ask: Callable[[str], str],
    say: Callable[[str], None],
    show: Callable[[str], None] | None,
) -> list[Held]:
    _one_channel(bench)
    positions = bench.positions or bench.subject.positions
    with open_port(path, say) as link, UsbChannels(link) as channels:
        channels.next_rows(1)  # it is our logger, and it sends
        return UsbSource(
            channels, bench.subject, bench.channel, positions, ask, say, first, show
        ).held()


def _one_channel(bench: Bench) -> None:
    if not bench.channel:
        raise UsageError(
            f"which channel was moved? name one of {', '.join(bench.subject.channels)} in place of"
            f" {bench.subject.name}"
        )


def _gyros(bench: Bench, logs: Mapping[Path, BenchLog]) -> list[Calibrated]:
    rests: list[Rest] = []
    turns: list[Turn] = []
    for path in bench.sources:
        first = max((r.repeat for r in rests), default=0) + 1
        more = (
            turns_of(logs[path], bench.turn_deg, first) if path in logs else read_turns(path, first)
        )
        rests += more[0]
        turns += more[1]
    return gyro_lines(bench.subject, rests, turns)


def _magnetometer(bench: Bench) -> Result:
    parts = []
    for path in bench.sources:
        if _is_log(path):
            parts.append(BenchLog.read(path).magnetic_counts())
            continue
        rows = rows_of(path, bench.subject.channels)
        parts.append(
            np.array([[number_of(path, row, c, k) for c in bench.subject.channels]
                      for k, row in enumerate(rows, start=2)])
        )  # fmt: skip
    counts = np.concatenate(parts)
    found = hard_iron(bench.subject, counts[np.isfinite(counts).all(axis=1)])
    data = {
        "subject": "magnetometer",
        "hard_iron": found.centre.tolist(),
        "hard_iron_sigma": found.centre_sigma.tolist(),
        "radius": found.radius.tolist(),
        "residual": found.residual,
        "doubt": found.doubt,
    }
    code = ExitCode.CHECK if found.doubt else ExitCode.OK
    return Result(tuple(iron_report(found)), data, (), code)


def _supply(bench: Bench) -> Result:
    shown: list[float] = []
    meter: list[float] = []
    for path in bench.sources:
        for index, row in enumerate(rows_of(path, ("shown_v", "meter_v")), start=2):
            shown.append(number_of(path, row, "shown_v", index))
            meter.append(number_of(path, row, "meter_v", index))
    found = supply_reference(bench.subject, shown, meter, bench.was_mv)
    data = {
        "subject": "supply",
        "reference_mv": found.reference_mv,
        "sigma_mv": found.sigma_mv,
        "doubt": found.doubt,
    }
    code = ExitCode.CHECK if found.doubt else ExitCode.OK
    return Result(tuple(supply_report(found)), data, (), code)


def _inertia(bench: Bench) -> Result:
    if bench.mass_kg is None or not all(0.0 <= m < np.inf for m in bench.mass_kg):
        raise UsageError("inertia needs --mass KG SIGMA: what hangs, and the scale's deviation")
    if not bench.mass_kg[0] > 0.0:
        raise UsageError(f"--mass {bench.mass_kg[0]:g}: mass, distance, length must be above zero")
    (path, *more) = bench.sources
    if more:
        raise UsageError("inertia takes one table with all three axes")
    swings = read_swings(path, bench.subject, *bench.mass_kg)
    day = bench.day or date.today().isoformat()
    source = ", ".join(["bifilar pendulum", *([bench.by] if bench.by else []), day])
    text = mass_section(
        bench.subject, bench.mass_kg, swings, cg_tolerance_m=bench.cg_tolerance_m, source=source
    )
    data = {"subject": "inertia", "mass": tomllib.loads(text)["mass"]}
    said = ["# for the aircraft file (host/IDENTIFY.md)", *text.splitlines()]
    return Result(tuple(said), data, (), ExitCode.OK)


def _is_log(path: Path) -> bool:
    """Return whether a source is a recording: a table is text and has a comma in its first line."""
    if path == TYPED or is_port(path):
        return False
    if not path.exists():
        raise UsageError(f"{path}: no such file; a table, a log of the bench, or - to type")
    regular_file(path)
    with path.open("rb") as file:
        head = file.read(512)
    first = head.partition(b"\n")[0]
    return not (b"\0" not in head and (b"," in first or first.startswith(b"#")))


def _file_name(instrument: str) -> str:
    return re.sub(r"[^\w.+-]", "_", instrument)[:100].lstrip(".") or "instrument"
