"""What a running Fourier regression says after one cycle of the short period, at 20 and 100 Hz.

Still air, the first 3-2-1-1 of the demonstration's card. Real-time methods are said to converge
within one cycle of the dominant mode (Morelli, AIAA-99-4043). One row a flight, rate and number of
cycles goes to a file that a later run continues.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from host.aircraft.mass_properties import airframe_data
from host.log import read_log
from host.sysid.answer import true_coefficients
from host.sysid.estimators.recursive import fit_recursive_fourier
from host.sysid.flight import read_flight_columns
from host.sysid.maneuvers import detect_maneuvers
from host.sysid.models import Maneuver, model_from

from studies.linear import derivatives
from studies.radio_flights import RadioFlight, radio_flight
from studies.stored_rows import flown_rows, seeded_run
from studies.while_flying import AIRCRAFT, card_of

FIRST_SEED = 9100
CYCLES = (1, 2, 4, 12)
LEAD_S, EVERY_S = 0.5, 0.05
BAND_HZ = (0.2, 4.0)
MODEL = {
    "name": "short period", "states": ["alpha_rad", "q_radps"], "inputs": ["elevator_rad"],
    "outputs": ["alpha_rad", "q_radps"], "delays": [], "hold": "foh",
    "A": [["Z_alpha", "Z_q"], ["M_alpha", "M_q"]], "B": [["Z_de"], ["M_de"]],
    "parameters": {"Z_alpha": -5.0, "Z_q": 1.0, "M_alpha": -80.0, "M_q": -9.0, "Z_de": -0.5,
                   "M_de": -90.0},
}  # fmt: skip
COLUMNS = ("seed", "rate_hz", "cycles", "name", "true", "estimate")


def rows_of(seed: int) -> Iterator[dict[str, object]]:
    """Fly once; estimates after some cycles, from the radio and from the card."""
    flight = radio_flight(card_of("still"), seed)
    true = _truth(flight)
    period_s = 2.0 * np.pi / np.sqrt(true["M_q"] * true["Z_alpha"] - true["M_alpha"])
    with tempfile.TemporaryDirectory() as place:
        calibration = Path(place) / "calibration.toml"
        calibration.write_text(flight.calibration, encoding="utf-8")
        for rate_hz, data in (
            (20, b"".join(s.data for s in flight.sent)),
            (100, flight.card_log(seed)),
        ):
            log = Path(place) / f"{rate_hz}.bin"
            log.write_bytes(data)
            history_s, history, names = _history(log, calibration)
            for cycles in CYCLES:
                at = int(np.argmin(np.abs(history_s - LEAD_S - cycles * period_s)))
                for name in ("M_alpha", "M_q"):
                    value = float(history[at, names.index(name)])
                    row = (seed, rate_hz, cycles, name, true[name], value)
                    yield dict(zip(COLUMNS, row, strict=True))


def _truth(flight: RadioFlight) -> dict[str, float]:
    local = true_coefficients({"maneuver": flight.truth[:1]}, "longitudinal")
    return derivatives(
        local, flight.truth[:1], "longitudinal", airframe_data(AIRCRAFT), flight.sizes
    )


def _history(log: Path, calibration: Path) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Return instants from the window's begin, estimates and their names."""
    columns = read_flight_columns(read_log(log, calibration=calibration)).columns
    found = detect_maneuvers(columns)[0]
    t = columns["t_s"]
    inside = (t >= found.start_s - LEAD_S) & (t <= found.end_s)
    model = model_from(MODEL)
    maneuver = Maneuver(
        dt_s=float(t[1] - t[0]),
        inputs=columns["elevator_rad"][inside][:, None],
        outputs=np.column_stack([columns[name][inside] for name in model.outputs]),
        name="3-2-1-1",
    )
    result = fit_recursive_fourier(model, [maneuver], limits_hz=BAND_HZ, every_s=EVERY_S)
    history = (np.asarray(result.details[key]) for key in ("history_s", "history"))
    return next(history), next(history), result.names


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return the median error of each rate, name and number of cycles."""
    lines = [
        "rate Hz  name      median |error| after " + ", ".join(map(str, CYCLES)) + " cycles, %"
    ]
    for rate in ("20", "100"):
        for name in ("M_alpha", "M_q"):
            medians = []
            for cycles in map(str, CYCLES):
                own = [
                    r for r in rows
                    if (r["rate_hz"], r["name"], r["cycles"]) == (rate, name, cycles)
                ]  # fmt: skip
                true, value = (np.array([float(r[k]) for r in own]) for k in ("true", "estimate"))
                medians.append(f"{100.0 * np.median(np.abs(value / true - 1.0)):5.0f}")
            lines.append(f"{rate:>7s}  {name:8s}  {' '.join(medians)}")
    return lines


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    run = seeded_run("one_cycle", __doc__, arguments, flights=50, first_seed=FIRST_SEED)
    rows = flown_rows(
        run.rows, COLUMNS, [(seed,) for seed in run.seeds], lambda seed: list(rows_of(seed))
    )
    return run.report(rows, table)


if __name__ == "__main__":
    sys.exit(main())
