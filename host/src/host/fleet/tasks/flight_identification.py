"""Identify one flight and return it as one row; runs in a child process."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from host.aircraft.file import load_measured
from host.aircraft.gains import dimensional_name
from host.constants import GRAVITY_MPS2
from host.errors import HostError, IdentificationError
from host.fleet.flight_task import DEFAULT_MODELS, IDENTIFIED, described
from host.fleet.sources.flight_files import is_address, opened
from host.fleet.statistics.watched_quantities import LAG_S
from host.fleet.tasks.estimate_loadings import LoadedEstimates, coefficient_loadings
from host.fleet.tasks.linear_loadings import linear_loadings
from host.fleet.tasks.surface_response import surface_quantities
from host.fleet.tasks.vane_zeros import vane_zeros
from host.instrument.error_sources import AIRCRAFT_FILE, TYPE
from host.sysid.answer import doubted_by_findings
from host.sysid.checks import finding_document
from host.sysid.coefficients import CoefficientFit
from host.sysid.pipeline import Identification, identify
from host.sysid.reconstruction import SERVO_DELAY

_GPS_EPOCH = datetime(1980, 1, 6, tzinfo=UTC)
_POSTERIOR_PRIOR_RATIO = 0.9  # an estimate whose deviation is nearly its prior's is left out
_LEAST_WEEK = 1024  # below, a receiver without almanac counts from its own beginning

Watched = dict[str, tuple[float, float]]


def flight_row(values: dict[str, Any]) -> dict[str, Any]:
    """Return the row of a flight, from the values of its `FlightTask`.

    Raises
    ------
    host.errors.HostError
        If nothing can be identified of it.
    """
    began_s = time.process_time()
    with _local(values["source"]) as path:
        found = _identified(path, values)
        date = values["date"] or _recorded_on(path)
        surfaces = _surfaces(path, values["calibration"])
    instrument = found.flights[0].instrument
    if instrument is None:
        raise IdentificationError("the aircraft file does not describe its sensors")
    if found.coefficients is not None:
        parts = coefficient_loadings(found.coefficients.fit, instrument.errors)
    else:
        parts = linear_loadings(found.linear, instrument.errors)
    if not parts.names:
        raise IdentificationError("; ".join(found.notes) or "no coefficients")
    row = described({**values, "date": date}) | _estimate_columns(parts, values)
    return (
        row
        | _answer_columns(found)
        | _watched_columns(found, parts, values["aircraft_file"], surfaces)
        | _aircraft_columns(values["aircraft_file"])
        | {
            "state": IDENTIFIED,
            "reason": "",
            "processor_s": time.process_time() - began_s,
        }
    )


def _identified(path: Path, values: dict[str, Any]) -> Identification:
    """Identify a flight: its coefficients, or linear models where it has no vanes."""
    how = {
        "aircraft": values["aircraft_file"],
        "calibration": values["calibration"] or None,
        "mapping": values["mapping"] or None,
        "accept": list(values["accept"]),
    }
    try:
        return identify(path, models=list(values["models"]), **how)
    except IdentificationError as error:
        if list(values["models"]) != list(DEFAULT_MODELS):
            raise
        why = error
    try:
        return identify(path, **how)
    except IdentificationError:
        raise why from None


def _estimate_columns(parts: LoadedEstimates, values: dict[str, Any]) -> dict[str, Any]:
    # An instrument without a calibration shares its errors with no other.
    instrument = values["calibration_id"] or f"uncalibrated, {values['aircraft']}"
    whose = {
        AIRCRAFT_FILE: f"aircraft file {values['aircraft_id']}",
        TYPE: f"type {values['type']}",
    }
    return {
        "parameters": list(parts.names),
        "estimates": parts.values.tolist(),
        "own_covariance": parts.own.ravel().tolist(),
        "errors": list(parts.errors),
        "error_sources": [whose.get(s, f"instrument {instrument}") for s in parts.sources],
        "loadings": parts.loadings.ravel().tolist(),
    }


def _answer_columns(found: Identification) -> dict[str, Any]:
    answers = (found.coefficients,) if found.coefficients else found.linear
    delays = {name: list(pair) for answer in answers for name, pair in answer.delays.items()}
    return {
        "models": ["coefficients"] if found.coefficients else [a.template for a in found.linear],
        "doubted": _doubted(found),
        "verdict": list(found.verdict),
        "findings": json.dumps([finding_document(f) for f in found.findings]),
        "maneuvers": sum(len(answer.used) for answer in answers),
        "delays": json.dumps(delays),
    } | (_condition(found.coefficients.fit) if found.coefficients else _trimmed(found))


def _doubted(found: Identification) -> list[str]:
    """Return the coefficients that a finding about the data speaks against."""
    names = doubted_by_findings(found.linear, found.coefficients, found.findings)
    if found.coefficients:
        return sorted(names)
    linear_names = {c.name for answer in found.linear for c in answer.coefficients}
    return sorted(name for name in linear_names if dimensional_name(name) in names)


def _condition(fit: CoefficientFit) -> dict[str, float]:
    at = fit.condition
    return {
        "airspeed_mps": at.airspeed_mps,
        "alpha_rad": at.alpha_rad,
        "lift": at.lift,
        "drag": at.drag,
    }


def _trimmed(found: Identification) -> dict[str, float]:
    """Return the condition of linear answers: that of level flight at their trim.

    Drag is unknown and left out; it makes a hundredth of the change of Cm_alpha with the CG.
    """
    first, known = found.linear[0], found.aircraft
    assert known is not None  # a fleet's flights have an aircraft file
    frame, at = known.airframe, first.condition
    return {
        "airspeed_mps": at.airspeed_mps,
        "alpha_rad": first.trim.alpha_rad,
        "lift": frame.mass_kg * GRAVITY_MPS2 / (at.qbar_pa * frame.wing_area_m2),
        "drag": 0.0,
    }


def _aircraft_columns(source: str) -> dict[str, Any]:
    loaded = load_measured(source)
    return {
        "cg_m": [float(x) for x in loaded.vector("mass.cg_m")],
        "mass_kg": loaded.scalar("mass.mass_kg"),
        "chord_m": loaded.scalar("geometry.chord_m"),
        "span_m": loaded.scalar("geometry.span_m"),
    }


def _watched_columns(
    found: Identification, parts: LoadedEstimates, aircraft_file: str, surfaces: Watched
) -> dict[str, Any]:
    """Return the watched quantities that are no derivatives (`statistics.watched_quantities`)."""
    watched = dict(surfaces)
    if found.coefficients is not None:
        fit, own = found.coefficients.fit, np.sqrt(np.diag(parts.own))
        estimates = {
            n: (float(v), float(d)) for n, v, d in zip(parts.names, parts.values, own, strict=True)
        }
        watched |= vane_zeros(
            found.flights[0], estimates, float(fit.condition.drag), load_measured(aircraft_file)
        )
        watched |= {} if surfaces else _commanded_lag(fit)
    return {
        "watched": list(watched),
        "watched_values": [value for value, _ in watched.values()],
        "watched_deviations": [sd for _, sd in watched.values()],
    }


def _commanded_lag(fit: CoefficientFit) -> Watched:
    """Return the servos' lag as estimated from the data alone, the prior's information removed."""
    if SERVO_DELAY not in fit.errors:
        return {}
    value, sd = fit.errors[SERVO_DELAY]
    before = next((e.deviation for e in fit.error_sources if e.name == SERVO_DELAY), 0.0)
    if not 0.0 < sd < _POSTERIOR_PRIOR_RATIO * before:
        return {}
    information = 1.0 / sd**2 - 1.0 / before**2
    return {f"servo{LAG_S}": (float(value / sd**2 / information), float(information**-0.5))}


def _surfaces(path: Path, calibration: str) -> Watched:
    """Return throw and lag of the surfaces as their pots measured them; nothing of foreign logs."""
    from host.log import read_log

    try:
        table = read_log(path, calibration=Path(calibration) if calibration else None).table()
    except (HostError, KeyError, OSError):
        return {}
    return surface_quantities({name: np.asarray(table[name]) for name in table.columns})


@contextmanager
def _local(source: str) -> Iterator[Path]:
    """Give a path of a source, downloaded where it is an address."""
    if not is_address(source):
        yield Path(source)
        return
    with tempfile.TemporaryDirectory(prefix="host-fleet-") as folder:
        path = Path(folder) / source.rstrip("/").rpartition("/")[2]
        with opened(source) as far, path.open("wb") as near:
            while piece := far.read(1 << 20):
                near.write(piece)
        yield path


def _recorded_on(path: Path) -> str:
    """Return the day of a log of ours as its GPS said; empty where nothing says it."""
    from host.log import read_log

    try:
        data = read_log(path).frames["gps"]
    except (HostError, KeyError, OSError):
        return ""
    good = data[(data["week"] >= _LEAST_WEEK) & (data["itow_ms"] != 0xFFFFFFFF)]
    if not len(good):
        return ""
    week, second = int(np.median(good["week"])), float(np.median(good["itow_ms"])) * 1e-3
    return (_GPS_EPOCH + timedelta(weeks=week, seconds=second)).date().isoformat()
