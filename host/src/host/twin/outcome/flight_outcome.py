"""One virtual flight from card to files."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import pandas as pd

from host.aircraft.file import Aircraft
from host.errors import UsageError
from host.log import read_log
from host.twin.flight.fly import FlightRecord, fly
from host.twin.outcome import compare, ideal, original_logger, picture, truth_files
from host.twin.outcome.autopilot_logs import write_autopilot_log
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import avr, sitl, stimuli
from host.twin.recorder.logger_flight import logger_flight
from host.twin.sensors.imu import Imu
from host.twin.sensors.local_flow import AirData, air_data
from host.twin.testcard.cards import Card, Segment

Progress = Callable[[str, float], None]


@dataclass(slots=True)
class Outcome:
    """The results of a virtual flight, and its files.

    Attributes
    ----------
    record : FlightRecord
    data : AirData
    files : list of Path
    table : DataFrame or None
        Table that the picture shows: decoded, ideal or thesis rows.
    recording : Recording or None
        What the recorder left, with `firmware` ``sitl`` or ``avr``.
    deviations : list of Deviation
        The decoded log against the truth.
    first_row_s : float
        True time since power-on of the log's first row.
    missing : str
        The library whose absence left the picture out.
    wall_s, processor_s : dict
        Wall-clock seconds, and those of this process's processor time, per stage.
    """

    record: FlightRecord
    data: AirData
    files: list[Path] = field(default_factory=list)
    table: pd.DataFrame | None = None
    recording: sitl.Recording | None = None
    deviations: list[compare.Deviation] = field(default_factory=list)
    first_row_s: float = 0.0
    missing: str = ""
    wall_s: dict[str, float] = field(default_factory=dict)
    processor_s: dict[str, float] = field(default_factory=dict)


class _Clock:
    """Times of stages: on the wall, and of this process (another one may hold the core)."""

    def __init__(self) -> None:
        self.wall_s: dict[str, float] = {}
        self.processor_s: dict[str, float] = {}
        self._last = time.perf_counter(), time.process_time()

    def mark(self, stage: str) -> None:
        """End a stage."""
        now = time.perf_counter(), time.process_time()
        self.wall_s[stage] = now[0] - self._last[0]
        self.processor_s[stage] = now[1] - self._last[1]
        self._last = now


def load_kernels(card: Card, aircraft: Aircraft | None = None) -> None:
    """Load (the very first time: compile) every kernel by a flight of one second."""
    short = replace(
        card,
        segments=(Segment("trim", duration_s=1.0),),
        faults=(),
        flight=replace(card.flight, ground_s=0.5),
        air=replace(card.air, turbulence_mps=0.1),
    )
    record = fly(short, aircraft=aircraft)
    stimuli.stimuli(record, air_data(record))


def simulate(
    card: Card,
    folder: Path,
    *,
    seed: int,
    firmware: str,
    pictures: bool,
    both: bool,
    progress: Progress,
    logs: Sequence[str] = (),
    airframe: str = "conventional",
    aircraft: Aircraft | None = None,
    flight_card: bytes = b"",
) -> Outcome:
    """Fly a card and write everything it leaves.

    Parameters
    ----------
    card : Card
    folder : Path
        Made if missing; files of an earlier flight are overwritten.
    seed : int
    firmware : str
        ``sitl``, ``avr``, ``none`` or ``thesis``.
    pictures : bool
        Draw flight.png.
    both : bool
        Fly the thesis's logger too, into the same picture.
    progress : callable
        Called with the stage and its share.
    logs : sequence of str
        Write these logs of other autopilots too: keys of `autopilot_logs.WRITERS`.
    airframe : str
        Airframe of these logs, one of `autopilot_outputs.AIRFRAMES`.
    aircraft : Aircraft, optional
        In place of the card's.
    flight_card : bytes
        In the recorder's EEPROM: it flies the inputs of the card itself (firmware ``sitl``).

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
    clock = _Clock()
    progress("load", 0.0)
    load_kernels(card, aircraft)
    clock.mark("load")
    recorder = _recorder(firmware, seed, flight_card, progress)
    given: stimuli.Stimuli | None = None
    recording: sitl.Recording | None = None
    if flight_card:
        record, given, recording = logger_flight(
            flight_card,
            card,
            seed=seed,
            aircraft=aircraft,
            recorder=recorder,
        )
    else:
        share = partial(progress, "fly")
        record = fly(card, seed=seed, progress=share, aircraft=aircraft)
    clock.mark("fly")
    folder.mkdir(parents=True, exist_ok=True)
    data = air_data(record)
    outcome = Outcome(record, data)
    stem = folder / "flight"
    text = folder / "calibration.toml"
    text.write_text(calibration(record.aircraft, record.draws.errors), encoding="utf-8")
    outcome.files.append(text)
    if firmware == "none":
        outcome.table = ideal.measured_table(record, data)
        outcome.files += _csv(outcome.table, stem.with_name("flight.csv"))
        outcome.files += _csv(ideal.true_table(record, data), stem.with_name("flight.true.csv"))
    elif firmware == "thesis":
        outcome.table, files = _thesis(record, data, folder)
        outcome.files += files
    else:
        given = given or stimuli.stimuli(record, data)
        outcome.recording = recording or recorder(record, given)
        path = _written(outcome.recording, outcome, folder)
        clock.mark("record")
        if path is not None:
            chip = given.imu if firmware == "avr" else None
            outcome.table = _decoded(outcome, path, folder, chip)
    clock.mark("decode" if outcome.recording else firmware)
    outcome.files += truth_files.write(record, data, stem, first_row_s=outcome.first_row_s)
    clock.mark("truth")
    for name in logs:
        outcome.files.append(write_autopilot_log(name, record, data, stem, airframe=airframe))
    if logs:
        clock.mark("logs")
    second = None
    if both and firmware != "thesis":
        second, files = _thesis(record, data, folder)
        outcome.files += files
    if pictures and outcome.table is not None:
        progress("picture", 0.0)
        image = folder / "flight.png"
        try:
            zero_s = outcome.first_row_s
            true = truth_files.series(record, data)
            picture.draw(
                _counted_from(zero_s, outcome.table),
                image,
                title=f"{card.title} (simulated, seed {seed})",
                windows=truth_files.counted_from(zero_s, truth_files.maneuvers(record, data)),
                faults=[replace(fault, at_s=fault.at_s - zero_s) for fault in card.faults],
                truth=true | {"t_s": true["t_s"] - zero_s},
                second=None if second is None else _counted_from(zero_s, second),
                second_name="thesis logger",
                power_on_s=-zero_s,
            )
            outcome.files.append(image)
        except ImportError as error:  # a missing picture must not cost the flight
            outcome.missing = error.name or "matplotlib"
        clock.mark("picture")
    outcome.wall_s, outcome.processor_s = clock.wall_s, clock.processor_s
    return outcome


def _recorder(
    firmware: str, seed: int, flight_card: bytes, progress: Progress
) -> Callable[[FlightRecord, stimuli.Stimuli], sitl.Recording]:
    """Return the function that runs the firmware through a flight."""
    live: Callable[..., sitl.Recording] = avr.record
    if firmware == "sitl":
        live = partial(sitl.record, flight_card=flight_card)
    elif flight_card:
        raise UsageError(f"--flight-card with --firmware {firmware}: only sitl flies it here")

    def recorder(record: FlightRecord, given: stimuli.Stimuli) -> sitl.Recording:
        return live(
            given,
            rate_hz=sitl.recorder_rate_hz(record.card.flight.rate_hz),
            aircraft=record.aircraft.name,
            faults=record.card.faults,
            seed=seed,
            progress=partial(progress, "record"),
        )

    return recorder


def _written(recording: sitl.Recording, outcome: Outcome, folder: Path) -> Path | None:
    """Write flight.bin, if there is one."""
    path = folder / "flight.bin"
    path.unlink(missing_ok=True)
    if not recording.log:
        return None
    path.write_bytes(recording.log)
    outcome.files.insert(0, path)
    return path


def _decoded(outcome: Outcome, path: Path, folder: Path, chip: Imu | None) -> pd.DataFrame:
    """Decode the log with its calibration, and put its rows on true time for the picture.

    `chip` are the IMU's samples where the recorder's clock begins later than the flight.
    """
    log = read_log(path, calibration=folder / "calibration.toml")
    table = log.table()
    ident = log.frames["ident"]
    began_s = compare.clock_began_s(outcome.record, chip, ident) if chip else 0.0
    table["t_s"] = compare.true_times(outcome.record, table, int(ident["t_us"][0]), began_s)
    outcome.deviations = compare.deviations(outcome.record, table, table["t_s"])
    outcome.first_row_s = float(table["t_s"].iloc[0])
    return table


def _counted_from(first_row_s: float, table: pd.DataFrame) -> pd.DataFrame:
    return table.assign(t_s=table["t_s"] - first_row_s)


def _csv(table: pd.DataFrame, path: Path) -> list[Path]:
    # Writes the same bytes as pandas' `to_csv` in a fifth of its time, which was half of a
    # flight's.
    row = ",".join(["%.9g"] * len(table.columns)) + "\n"
    text = "".join(row % tuple(values) for values in table.to_numpy(float).tolist())
    header = ",".join(table.columns) + "\n"
    path.write_text(header + text.replace("nan", ""), encoding="utf-8")
    return [path]


def _thesis(record: FlightRecord, data: AirData, folder: Path) -> tuple[pd.DataFrame, list[Path]]:
    rate = record.card.flight.rate_hz
    if rate > 20.0:
        # The same flight, at the rate of the thesis's second one.
        slow = replace(record.card, flight=replace(record.card.flight, rate_hz=20.0))
        record = replace(record, card=slow)
    printed = original_logger.rows(record, data)
    path = folder / "flight.thesis.txt"
    paired = record.card.flight.rate_hz >= original_logger.PAIRED_HZ
    original_logger.write_rows(printed, path, paired=paired)
    return original_logger.table(printed), [path]
