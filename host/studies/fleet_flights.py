"""Fleets flown through the recorder: do mean, spreads and prediction hold what was drawn?

Three fleets of 12 aircraft with 8 flights each. Every flight is flown, recorded by the firmware and
kept as a log; `host fleet` identifies them all. A later run continues where one was stopped.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from host.export.toml import dumps
from host.fleet.dataset.row_flights import reference_cg
from host.fleet.flight_task import SET_ASIDE
from host.fleet.runs.fleet_answer import FleetAnswer, fleet_answer
from host.fleet.runs.fleet_run import run_fleet
from host.fleet.sources.fleet_table import read_table
from host.fleet.sources.flight_keys import FleetSources
from host.fleet.statistics.reference_cg import Place
from host.fleet.statistics.type_model import TypeModel
from host.fleet.tasks.task_cluster import ClusterOptions
from host.twin.flight.fly import fly
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import sitl
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import Card, load
from scipy import special

from studies.fleet_aircraft import BATTERY_M, TYPE, BuiltAircraft, built, fleet_errors, population
from studies.flights import PRINCIPAL

FIRST_SEED = 25_000
FLEETS, AIRCRAFT, FLIGHTS = 3, 12, 8
TRUTH_AIRCRAFT = 400  # aircraft that say what is true of the type
SAID = ("mean", "between", "within")
CARD = Path(__file__).with_name("fleet_card.toml")
COLUMNS = (
    "fleet", "name",
    *(f"{what}_{k}" for what in SAID for k in ("true", "value", "lower", "upper")),
    "new_lower", "new_upper", "flights", "set_aside",
)  # fmt: skip


def fly_fleet(folder: Path, fleet: int, aircraft: int, flights: int) -> None:
    """Fly what a folder has not yet: a log a flight, a file and a calibration an aircraft."""
    card, lines = load(CARD), ["source,aircraft,type,file,calibration"]
    for number in range(aircraft):
        seed = FIRST_SEED + 1000 * fleet + 20 * number
        name = f"N{number:02d}"
        one = built(name, np.random.default_rng(seed))
        own = folder / "logs" / name
        own.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.toml").write_text(dumps(one.document), encoding="utf-8")
        errors = fleet_errors(one.plane)
        text = f"# instrument of {name}\n" + calibration(one.plane, errors)
        (folder / f"{name}.calibration.toml").write_text(text, encoding="utf-8")
        lines.append(f"logs/{name},{name},{TYPE},{name}.toml,{name}.calibration.toml")
        for flight in range(flights):
            path = own / f"flight{flight}.bin"
            if not path.exists():
                part = path.with_suffix(".part")
                part.write_bytes(recorded(card, one, seed, seed + 1 + flight))
                part.replace(path)
                print(f"\rfleet {fleet}, {name}, flight {flight}   ", end="", file=sys.stderr)
    (folder / "FLEET.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def recorded(card: Card, one: BuiltAircraft, instrument_seed: int, seed: int) -> bytes:
    """Return the log of one flight of an aircraft with its own instrument."""
    battery_m = BATTERY_M * float(np.random.default_rng([seed, 9]).standard_normal())
    record = fly(
        card,
        seed=seed,
        aircraft=one.loaded(battery_m),
        errors=fleet_errors(one.plane),
        instrument_seed=instrument_seed,
    )
    return sitl.record(
        stimuli(record, air_data(record)),
        rate_hz=sitl.recorder_rate_hz(card.flight.rate_hz),
        aircraft=TYPE,
        faults=(),
        seed=seed,
    ).log


def answered(folder: Path) -> tuple[FleetAnswer, Place, int]:
    """Identify a fleet as the verb does; return its answer, the CG that it holds about, and how
    many flights were set aside."""
    sources = FleetSources((), "", read_table(folder / "FLEET.csv"))
    run = run_fleet(sources, folder / "out", cluster=ClusterOptions(workers=1))
    assert run.rows is not None
    aside = int((run.rows["state"] == SET_ASIDE).sum())
    return fleet_answer(run.rows, folder / "out"), reference_cg(run.rows), aside


def rows_of(
    fleet: int, model: TypeModel, cg_m: Place, set_aside: int
) -> Iterator[dict[str, object]]:
    """Yield each principal derivative and what was drawn."""
    truth = population(TRUTH_AIRCRAFT, FIRST_SEED - 1, cg_m)
    for name in PRINCIPAL:
        if name not in model.effects:
            continue
        effect = model.effects[name]
        row: dict[str, object] = {"fleet": fleet, "name": name, "set_aside": set_aside}
        true = dict(zip(("mean", "between", "within"), truth[name], strict=True))
        for what, value in true.items():
            found = getattr(effect, what)
            row |= {f"{what}_true": value, f"{what}_value": found.value}
            row |= {f"{what}_lower": found.lower, f"{what}_upper": found.upper}
        new = effect.new_aircraft
        yield row | {"new_lower": new.lower, "new_upper": new.upper, "flights": effect.flights}


def table(rows: Sequence[dict[str, str]]) -> Iterator[str]:
    """Yield a line a derivative over all fleets, then what all come to."""
    yield "             mean held   between held   within held   new aircraft: held by drawn ones"
    counts = {what: [0, 0] for what in ("mean", "between", "within")}
    shares = []
    for name in dict.fromkeys(r["name"] for r in rows):
        own = [
            {k: float(v) for k, v in r.items() if k != "name"} for r in rows if r["name"] == name
        ]
        cells = []
        for what, count in counts.items():
            held = sum(r[f"{what}_lower"] <= r[f"{what}_true"] <= r[f"{what}_upper"] for r in own)
            count[0], count[1] = count[0] + held, count[1] + len(own)
            cells.append(f"{held} of {len(own)}")
        inside = [_inside(r) for r in own]
        shares += inside
        yield (
            f"{name:10s}" + "".join(f"{c:>14s}" for c in cells) + f"{100 * np.mean(inside):12.1f} %"
        )
    text = "  ".join(f"{what} {a} of {b}" for what, (a, b) in counts.items())
    yield f"all: {text}; of new aircraft {100 * np.mean(shares):.1f} % are inside"


def _inside(row: dict[str, float]) -> float:
    """Return the share of the type's aircraft inside the interval of a new one."""
    spread = max(row["between_true"], 1e-12)
    ends = [(row[f"new_{end}"] - row["mean_true"]) / spread for end in ("lower", "upper")]
    return float(special.ndtr(ends[1]) - special.ndtr(ends[0]))


def main(arguments: list[str] | None = None) -> int:
    """Fly, identify and print the table."""
    parser = argparse.ArgumentParser(prog="python -m studies.fleet_flights", description=__doc__)
    parser.add_argument("--fleets", type=int, default=FLEETS, metavar="N")
    parser.add_argument("--aircraft", type=int, default=AIRCRAFT, metavar="N")
    parser.add_argument("--flights", type=int, default=FLIGHTS, metavar="N")
    parser.add_argument("--folder", type=Path, default=Path("../build/study/fleet_flights"))
    args = parser.parse_args(arguments)
    rows: list[dict[str, object]] = []
    for fleet in range(args.fleets):
        folder = args.folder / f"fleet{fleet}"
        fly_fleet(folder, fleet, args.aircraft, args.flights)
        answer, cg_m, aside = answered(folder)
        rows += rows_of(fleet, answer.models[0], cg_m, aside)
        print("\n".join(answer.lines()), flush=True)
        with (args.folder / "rows.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)
    with (args.folder / "rows.csv").open(newline="", encoding="utf-8") as file:
        print("\n".join(table(list(csv.DictReader(file)))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
