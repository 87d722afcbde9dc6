"""Virtual flights for studies: a card and a seed in, a table and its truth out, no files left."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from host.aircraft.file import Aircraft
from host.errors import UsageError
from host.instrument.instrument_errors import InstrumentErrors
from host.log import read_log
from host.twin.flight.fly import FlightRecord, fly
from host.twin.outcome import compare, ideal, original_logger, truth_files
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import sitl
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import Card, load

CHAINS = ("sitl", "gps", "none", "true", "thesis")


@dataclass(frozen=True, slots=True)
class VirtualFlight:
    """One simulated flight with its truth.

    Attributes
    ----------
    table : DataFrame
        The columns that identification gets, SI; ``t_s`` in true seconds since power-on, as the
        windows.
    maneuvers : list of dict
        Windows, conditions, local derivatives and modes, as in the truth file.
    record : FlightRecord
        The simulated motion itself, with the drawn errors.
    """

    table: pd.DataFrame
    maneuvers: list[dict[str, object]]
    record: FlightRecord


def virtual_flight(
    card: str | Path | Card,
    seed: int,
    *,
    chain: str = "sitl",
    errors: InstrumentErrors | None = None,
    instrument_seed: int | None = None,
    noise_seed: int | None = None,
    aircraft: Aircraft | None = None,
) -> VirtualFlight:
    """Fly a card once.

    Parameters
    ----------
    card : str, Path or Card
    seed : int
    chain : str
        ``sitl`` through the recorder, decoded with the calibration of the virtual instrument;
        ``gps`` the sensors without recorder, ``none`` the same without GPS; ``true`` the truth in
        the same columns; ``thesis`` its logger.
    errors, instrument_seed, noise_seed, aircraft
        Errors of the instrument, seeds of it and of gusts and sensor noise, and what flies in place
        of the card's aircraft, as `fly` takes them.

    Returns
    -------
    VirtualFlight

    Raises
    ------
    HostError
        Unknown card or chain, or no recorder library.
    ValueError
        Unknown chain.

    Examples
    --------
    >>> flight = virtual_flight("multisine", 3)  # doctest: +SKIP
    >>> flight.maneuvers[0]["derivatives"]["Cm_alpha"]  # doctest: +SKIP
    """
    if chain not in CHAINS:
        raise ValueError(f"chain is {chain!r}, expected one of {', '.join(CHAINS)}")
    flown = card if isinstance(card, Card) else load(card)
    record = fly(
        flown, seed=seed, errors=errors, instrument_seed=instrument_seed, noise_seed=noise_seed,
        aircraft=aircraft,
    )  # fmt: skip
    data = air_data(record)
    if chain == "true":
        table = ideal.true_table(record, data)
    elif chain in ("gps", "none"):
        table = ideal.measured_table(record, data)
        if chain == "gps":
            table = table.assign(**ideal.gps_columns(record))
    elif chain == "thesis":
        table = original_logger.table(original_logger.rows(record, data))
    else:
        recording = sitl.record(
            stimuli(record, data),
            rate_hz=sitl.recorder_rate_hz(record.card.flight.rate_hz),
            aircraft=record.aircraft.name,
            faults=record.card.faults,
            seed=record.seed,
        )
        if not recording.log:
            raise UsageError(f"nothing was recorded: {recording.name}")
        with tempfile.TemporaryDirectory() as folder:
            log, text = Path(folder) / "flight.bin", Path(folder) / "calibration.toml"
            log.write_bytes(recording.log)
            text.write_text(calibration(record.aircraft, record.draws.errors), encoding="utf-8")
            decoded = read_log(log, calibration=text)
            table = decoded.table()
            first_us = int(decoded.frames["ident"]["t_us"][0])
        table["t_s"] = compare.true_times(record, table, first_us)
    return VirtualFlight(table, truth_files.maneuvers(record, data), record)
