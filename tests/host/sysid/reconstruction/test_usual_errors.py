"""Sensors of others are not held to the tolerances of ours."""

from __future__ import annotations

import pytest
from host.instrument.deviations import unknown_sensors
from host.instrument.instrument_errors import errors_without_file
from host.instrument.recording_notes import recording_notes
from host.physical.recording import Recording
from host.sysid.reconstruction import prior


def test_priors_of_a_table_of_others_are_wide() -> None:
    ours, theirs = (prior(unknown_sensors(Recording(maker=m))) for m in ("own", "foreign"))
    for name in ("alpha_scale", "beta_scale", "alpha_zero_rad", "pitot_scale", "gyro_x_scale",
                 "accel_z_bias_mps2", "gyro_y_bias_radps"):  # fmt: skip
        assert theirs[name][1] > 1.7 * ours[name][1], name


def test_it_is_said_and_of_ours_it_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("host.instrument.deviations.errors_without_file", errors_without_file)
    [note] = recording_notes(unknown_sensors(Recording(maker="foreign")))
    assert note.startswith("sensors of others: vanes may be wrong by 12 % and 1.6 deg")
    assert "[error.NAME]" in note
    assert recording_notes(unknown_sensors()) == []


@pytest.mark.parametrize("maker", ["own", "foreign", "autopilot"])
def test_every_maker_has_every_error(maker: str) -> None:
    names = {e.name for e in unknown_sensors(Recording(maker=maker)).errors}
    assert names == {e.name for e in unknown_sensors().errors}
