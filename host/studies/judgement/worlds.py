"""The worlds that answers are judged in, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from studies.judgement import field_flights, trainer_flights, twin_flights
from studies.judgement.judged_rows import COEFFICIENTS, DERIVATIVES, Flown


@dataclass(frozen=True, slots=True)
class World:
    """How a flight of it is flown and identified, and which parameters its model has."""

    fly: Callable[[int], Flown]
    names: tuple[str, ...]
    least_relied: float | None = None  # % of right principal parameters under trust or care
    apart: bool = False  # not in the pooled score


# Without vanes the short period stands for the longitudinal model.
WITHOUT_DRAG = tuple(name for name in COEFFICIENTS if not name.startswith("CD_"))
WORLDS = {
    "twin, no file": World(twin_flights.without_file, DERIVATIVES),
    "twin, file": World(twin_flights.with_file, COEFFICIENTS, least_relied=85.0),
    "twin, file, coefficients": World(
        lambda seed: twin_flights.with_file(seed, twin_flights.DIRECT), COEFFICIENTS
    ),
    "twin calibrated, no file": World(
        twin_flights.calibrated_without_file, DERIVATIVES, apart=True
    ),
    "PX4 log without vanes, file": World(twin_flights.imported, WITHOUT_DRAG),
    "independent, no file": World(trainer_flights.without_file, DERIVATIVES),
    "independent, file": World(trainer_flights.with_file, COEFFICIENTS),
    "real records, no file": World(field_flights.without_file, DERIVATIVES, least_relied=60.0),
    "perfect sensors, known": World(trainer_flights.perfect_sensors, DERIVATIVES, apart=True),
}
