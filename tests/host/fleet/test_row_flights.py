"""Rows that released versions wrote are read."""

import pandas as pd
from host.fleet.dataset.row_flights import type_flights

from tests.host.fleet.stub_work import stub_row


def test_an_error_of_a_released_row_has_its_name_of_today() -> None:
    texts = ("key", "source", "log_id", "type", "aircraft", "aircraft_file", "aircraft_id")
    task = dict.fromkeys((*texts, "calibration_id", "version", "date"), "x")
    row = stub_row({**task, "models": []})
    row |= {"watched": [], "watched_values": [], "watched_deviations": []}
    row |= {"errors": ["tilt_y_rad", "cg_x_m"], "error_sources": ["instrument a", "f1"]}
    row |= {"loadings": [0.5, 0.25]}
    [flight] = type_flights(pd.DataFrame([row]))
    assert flight.sources == (("instrument a", "imu_tilt_y_rad"), ("f1", "cg_x_m"))
