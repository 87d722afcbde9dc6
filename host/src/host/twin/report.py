"""One virtual flight from card to files."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import pandas as pd

from host.errors import UsageError
from host.twin import ideal, picture, thesis, truth
from host.twin.airdata import AirData, air_data
from host.twin.cards import Card
from host.twin.flight import FlightRecord, fly
from host.twin.instrument import calibration

FIRMWARES = ("sitl", "avr", "none", "thesis")
Progress = Callable[[str, float], None]


@dataclass(slots=True)
class Outcome:
    """What a virtual flight left behind.

    Attributes
    ----------
    record : FlightRecord
    data : AirData
    files : list of Path
    table : DataFrame or None
        What the picture shows: decoded, ideal or thesis rows.
    wall_s : dict
        Wall-clock seconds per stage.
    """

    record: FlightRecord
    data: AirData
    files: list[Path] = field(default_factory=list)
    table: pd.DataFrame | None = None
    wall_s: dict[str, float] = field(default_factory=dict)


def simulate(
    card: Card,
    folder: Path,
    *,
    seed: int,
    firmware: str,
    pictures: bool,
    both: bool,
    progress: Progress,
) -> Outcome:
    """Fly a card and write everything it leaves.

    Parameters
    ----------
    card : Card
    folder : Path
        Made if missing; files of an earlier flight are overwritten.
    seed : int
    firmware : str
        One of `FIRMWARES`.
    pictures : bool
        Draw flight.png.
    both : bool
        Fly the thesis's logger beside it, into the same picture.
    progress : callable
        Called with the stage and its share.

    Returns
    -------
    Outcome

    Raises
    ------
    HostError
        The card, the aircraft or the firmware does not work as asked.
    OSError
        The folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    marks = [("start", time.perf_counter())]
    record = fly(card, seed=seed, progress=lambda share: progress("fly", share))
    marks.append(("fly", time.perf_counter()))
    data = air_data(record)
    outcome = Outcome(record, data)
    stem = folder / "flight"
    outcome.files += truth.write(record, data, stem)
    text = folder / "calibration.toml"
    text.write_text(calibration(record.aircraft), encoding="utf-8")
    outcome.files.append(text)
    marks.append(("truth", time.perf_counter()))
    if firmware == "none":
        outcome.table = ideal.measured_table(record, data)
        outcome.files += _csv(outcome.table, stem.with_name("flight.csv"))
        outcome.files += _csv(ideal.true_table(record, data), stem.with_name("flight.true.csv"))
    elif firmware == "thesis":
        outcome.table, files = _thesis(record, data, folder)
        outcome.files += files
    else:
        raise UsageError(f"--firmware {firmware} is not built here")
    marks.append((firmware, time.perf_counter()))
    second = None
    if both and firmware != "thesis":
        second, files = _thesis(record, data, folder)
        outcome.files += files
    if pictures:
        progress("picture", 0.0)
        image = folder / "flight.png"
        picture.draw(
            outcome.table,
            image,
            title=f"{card.title} (simulated, seed {seed})",
            windows=truth.maneuvers(record, data),
            truth=truth.series(record, data),
            second=second,
            second_name="thesis logger",
        )
        outcome.files.append(image)
        marks.append(("picture", time.perf_counter()))
    outcome.wall_s = {name: now - before for (_, before), (name, now) in pairwise(marks)}
    return outcome


def _csv(table: pd.DataFrame, path: Path) -> list[Path]:
    table.to_csv(path, index=False, float_format="%.9g")
    return [path]


def _thesis(record: FlightRecord, data: AirData, folder: Path) -> tuple[pd.DataFrame, list[Path]]:
    rate = record.card.flight.rate_hz
    if rate > 20.0:
        # The same flight, at the rate of the thesis's second one.
        slow = replace(record.card, flight=replace(record.card.flight, rate_hz=20.0))
        record = replace(record, card=slow)
    printed = thesis.rows(record, data)
    path = folder / "flight.thesis.txt"
    thesis.write_rows(printed, path)
    return thesis.table(printed), [path]
