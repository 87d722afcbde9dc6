"""Does every named error of an instrument reach an interval? Ten times and a tenth, one by one.

One flight, decoded once; each error of the instrument's file is made ten times and a tenth as
large, and both answers of `host identify` are found again. An error that moves no interval is known
from the data themselves: then many deviations of it are put into the data, and the answer stays.
Errors of servos and of the clock are looked at twice: on this flight, whose pots and GPS settle
them, and on the same one had there been neither.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

from host.aircraft.mass_properties import AirframeData, airframe_data
from host.arrays import Array
from host.instrument.deviations import SensorErrorModel, sensor_error_model
from host.readers.even_grid import even_columns
from host.readers.recorded import recording_of_table
from host.sysid.pipeline import aircraft_data, at_hand, identify_columns
from host.twin.faults import Fault
from host.twin.testcard.cards import load
from host.twin.virtual import virtual_flight

AIRCRAFT = "ultrastick25e"
MODELS = ("coefficients", "longitudinal", "lateral")
MOVED = 0.01  # of a half-width: less is rounding of the search
GROUPS: dict[str, tuple[str, ...]] = {
    "gyro bias": ("gyro_bias_radps",),
    "gyro scale": ("gyro_scale",),
    "accelerometer bias": ("accel_bias_mps2",),
    "accelerometer scale": ("accel_scale",),
    "misalignment": ("misalignment_rad",),
    "vane zero": ("vane_zero_rad",),
    "vane scale": ("vane_scale",),
    "vane friction": ("vane_friction_share",),
    "pitot zero": ("pitot_zero_pa",),
    "pitot scale": ("pitot_scale",),
    "pot scale": ("pot_scale",),
    "pot zero": ("pot_zero_rad",),
    "delays": ("delay_share", "delay_least_s"),
    "filter model": ("filter_model_s",),
    "thrust": ("thrust_share",),
    "servo scale": ("servo_scale",),
    "servo zero": ("servo_zero_rad",),
    "servo delay": ("servo_delay_s",),
    "servo speed": ("servo_bandwidth_share",),
    "density": ("density_share", "fuselage_heat_share"),
    "barometer offset": ("baro_offset_pa",),
    "clock": ("clock_share",),
    "GPS place": ("gps_place_m",),
    "places": ("place_m",),
    "CG": ("cg_m",),
    "mass": ("mass_share",),
    "inertia": ("inertia_share",),
    "upwash": ("upwash_share",),
}
Interval = tuple[float, float]  # value, half-width
Columns = Mapping[str, Array]
Flown = tuple[Columns, SensorErrorModel]  # and the instrument as it was on that flight


def _shifted(names: tuple[str, ...], by: float) -> Callable[[Columns], dict[str, Array]]:
    return lambda columns: {k: v + by if k in names else v for k, v in columns.items()}


# What the data tell themselves: three or ten deviations of it put into the columns, and why nothing
# moves.
DATA_INFORMED: dict[str, tuple[Callable[[Columns], dict[str, Array]], str]] = {
    "gyro bias": (
        _shifted(("p_radps", "q_radps", "r_radps"), 3.0 * 0.005),
        "every maneuver has constants of its own, and attitude tells the rest",
    ),
    "pot zero": (
        _shifted(("elevator_rad", "aileron_rad", "rudder_rad"), 10.0 * 0.003),
        "every maneuver has constants of its own",
    ),
    "barometer offset": (
        _shifted(("static_pa",), 10.0 * 57.7),
        "only changes of height are looked at; its part of density is in density_share",
    ),
    "servo zero": (
        _shifted(("elevator_rad", "aileron_rad", "rudder_rad"), 10.0 * 0.01),
        "every maneuver has constants of its own",
    ),
    "GPS place": (
        _shifted(("altitude_m",), 10.0 * 2.9),
        "only velocities and changes of height are looked at",
    ),
}
# What pots and GPS settle: looked at on a flight without them too.
SETTLED = {
    "servo scale": "pots measured what the servos did",
    "servo zero": "pots measured what the servos did",
    "servo delay": "pots measured what the servos did",
    "servo speed": "pots measured what the servos did",
    "clock": "GPS gave the clock's scale while it was decoded (physical/timebase)",
}
POTS = ("pot_elevator", "pot_aileron_left", "pot_aileron_right", "pot_rudder")


@dataclass(frozen=True, slots=True)
class Reach:
    """How far the half-widths of both answers move with one group: the largest change of each."""

    group: str
    tenth: tuple[float, str]
    ten: tuple[float, str]

    @property
    def moves(self) -> bool:
        """Whether an interval follows the file."""
        return max(-self.tenth[0], self.ten[0]) > MOVED


def answers(
    columns: Columns, airframe: AirframeData, data: SensorErrorModel
) -> dict[str, Interval]:
    """Return both answers of `host identify`: coefficients, then the linear one's."""
    known = replace(aircraft_data(AIRCRAFT), airframe=airframe, instrument=data)
    found = identify_columns(
        at_hand(columns, aircraft=known, recording=data.recording), models=MODELS
    )
    result: dict[str, Interval] = {}
    if found.coefficients is not None:
        direct = found.coefficients.coefficients
        result |= {f"{c.name} (direct)": (c.value, c.half_width) for c in direct}
    for answer in found.linear:
        result |= {f"{c.name} (linear)": (c.value, c.half_width) for c in answer.coefficients}
    return result


def reaches(flown: Flown, groups: Mapping[str, tuple[str, ...]]) -> Iterator[Reach]:
    """Find both answers again with every group a tenth and ten times as large."""
    columns, data = flown
    airframe = airframe_data(AIRCRAFT)
    usual = answers(columns, airframe, data)
    for group, names in groups.items():
        both = []
        for factor, pick in ((0.1, min), (10.0, max)):
            there = answers(columns, scaled_airframe(airframe, group, factor),
                            data.scaled(factor, *names))  # fmt: skip
            changes = [(there[n][1] / usual[n][1] - 1.0, n) for n in usual if n in there]
            both.append(pick(changes))
        yield Reach(group, both[0], both[1])


def scaled_airframe(airframe: AirframeData, group: str, factor: float) -> AirframeData:
    """Return an airframe with its own share of a group that many times as large."""
    if group == "mass":
        return replace(airframe, mass_share=factor * airframe.mass_share)
    if group == "inertia":
        return replace(airframe, inertia_share=factor * airframe.inertia_share)
    if group == "upwash":
        return replace(airframe, upwash_share=factor * airframe.upwash_share)
    return airframe


def shift_with(flown: Flown, group: str) -> tuple[float, str]:
    """Return the largest shift of a value, in half-widths, with many deviations in the data.

    The file says so too: it states ten times as much.
    """
    columns, airframe = flown[0], airframe_data(AIRCRAFT)
    data = flown[1].scaled(10.0, *GROUPS[group])
    usual = answers(columns, airframe, data)
    there = answers(DATA_INFORMED[group][0](columns), airframe, data)
    return max((abs(there[n][0] - v) / h, n) for n, (v, h) in usual.items())


def flight(card: str, seed: int, *, bare: bool = False) -> Flown:
    """Return one virtual flight through the recorder; bare: no pot and no GPS was fitted."""
    plan = load(card)
    if bare:
        missing = (*(Fault("pot_open", 0.0, channel=pot) for pot in POTS), Fault("gps_off", 0.0))
        plan = replace(plan, faults=missing)
    table = virtual_flight(plan, seed).table
    columns, _ = even_columns(table)
    recording = recording_of_table(columns, table.attrs)
    data = sensor_error_model(AIRCRAFT).recorded(recording)
    return columns, data


def lines(flown: Flown, bare: Flown, groups: Mapping[str, tuple[str, ...]]) -> Iterator[str]:
    """Return the table, row by row as it is found."""
    yield f"{'group':20s} {'a tenth':>9s} {'ten times':>10s}  interval that moves most"
    for r in reaches(flown, groups):
        why = SETTLED.get(r.group, "")
        yield _row(r) + (_why(flown, r, why) if not r.moves else "")
    settled = {name: names for name, names in groups.items() if name in SETTLED}
    if settled:
        yield "the same flight without pots and GPS"
        for r in reaches(bare, settled):
            yield _row(r) + (_why(bare, r, "") if not r.moves else "")


def _row(r: Reach) -> str:
    return f"{r.group:20s} {100 * r.tenth[0]:+8.1f}% {100 * r.ten[0]:+9.1f}%  {r.ten[1]}"


def _why(flown: Flown, r: Reach, settled: str) -> str:
    """Return why a group moves no interval."""
    if settled:
        return f"; {settled}"
    if r.group not in DATA_INFORMED:
        return "; MOVES NOTHING"
    moved, name = shift_with(flown, r.group)
    return (
        f"; known from the data: many deviations in them move {name} by {moved:.2f} half-widths:"
        f" {DATA_INFORMED[r.group][1]}"
    )


def main(arguments: list[str] | None = None) -> int:
    """Fly, find, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--card", default="demo")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--group", action="append", choices=list(GROUPS))
    options = parser.parse_args(arguments)
    groups = {name: GROUPS[name] for name in options.group or GROUPS}
    flown, bare = (flight(options.card, options.seed, bare=bare) for bare in (False, True))
    for line in lines(flown, bare, groups):
        sys.stdout.write(line + "\n")
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
