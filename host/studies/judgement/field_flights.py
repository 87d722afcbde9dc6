"""Flights with the errors of real records, analysed without a file."""

from __future__ import annotations

import numpy as np
import pandas as pd
from host.physical.recording import FOREIGN, SURFACES, Recording
from host.readers.even_grid import even_columns
from host.sysid.pipeline import Identification, at_hand, identify_columns

from studies.field_records.ranges import draw
from studies.field_records.record_flight import RATE_HZ, drawn_aircraft, fly
from studies.field_records.recorded_columns import ROW_HZ, columns_of
from studies.field_records.true_derivatives import short_period_radps, true_derivatives
from studies.judgement.default_errors import with_default_errors
from studies.judgement.judged_rows import COEFFICIENTS, Flown
from studies.judgement.trainer_flights import truth_document

DRAW = 1945
OWN = ("places", "upwash", "vane_scale", "delay_least_s")  # the record has its own


def without_file(seed: int) -> Flown:
    """Return a flight of unknown sensors and of an aircraft that no linear model has."""
    rng = np.random.default_rng([DRAW, seed])
    by = draw(rng)
    plane = drawn_aircraft(rng, by)
    rows = fly(plane, by, rng)
    at_trim = true_derivatives(plane, float(rows[0, 19]), plane.trim_alpha, plane.trim_de)
    record = columns_of(rows, by, short_period_radps(at_trim), rng)
    record = with_default_errors(record, rng, OWN)
    thin = rows[:: RATE_HZ // ROW_HZ].astype(np.float64)
    true = {
        "t_s": record["t_s"],
        "airspeed_mps": thin[:, 19],
        "alpha_rad": thin[:, 20],
        "elevator_rad": thin[:, 25],
    }
    truth = truth_document(
        true,
        lambda speed, alpha, de: {
            "derivatives": dict.fromkeys(COEFFICIENTS, 0.0),
            "dimensional": true_derivatives(plane, speed, alpha, de),
        },
    )

    def identify() -> Identification:
        columns, _ = even_columns(pd.DataFrame(record))
        recording = Recording(commanded=SURFACES, maker=FOREIGN)
        return identify_columns(at_hand(columns, recording=recording), truth=truth)

    return Flown(truth, identify)
