"""Notes of a flight on what its recording leaves open: sensors of others, servos, clock."""

from __future__ import annotations

import math

from host.constants import NORMAL_95
from host.instrument.deviations import SensorErrorModel, clock_share
from host.physical.recording import FOREIGN


def recording_notes(instrument: SensorErrorModel) -> list[str]:
    """Return the notes of a flight on surfaces without a pot and on a clock without GPS.

    Parameters
    ----------
    instrument : SensorErrorModel
        Error model of that flight: its `recording` says which surfaces were only commanded.

    Returns
    -------
    list of str
        A sentence for each, none where pots and GPS measured.
    """
    hertz, rate = instrument.servo
    whose = "the aircraft file's servos" if instrument.servo_hz > 0.0 else "usual servos"
    lines = []
    if instrument.recording.maker == FOREIGN:
        e = instrument.errors
        vanes, pitot = (100.0 * NORMAL_95 * e[n].of_mean() for n in ("vane_scale", "pitot_scale"))
        zero = math.degrees(NORMAL_95 * e["vane_zero_rad"].of_mean("alpha_a", "alpha_b"))
        lines.append(
            f"sensors of others: vanes may be wrong by {vanes:.0f} % and {zero:.1f} deg, dynamic"
            f" pressure by {pitot:.0f} % (95 %); [error.NAME] of a calibration says better"
        )
    if instrument.recording.commanded:
        lines.append(
            f"{', '.join(instrument.recording.commanded)}: the command through {whose}"
            f" ({hertz:g} Hz, {rate:.3g} rad/s); a pot would measure it"
        )
    if instrument.recording.clock_share is None:
        share = 100.0 * NORMAL_95 * clock_share(instrument)
        lines.append(f"no GPS checked the clock: {share:.2g} % of its scale are open (95 %)")
    return lines
