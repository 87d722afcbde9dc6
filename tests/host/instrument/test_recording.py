"""Errors of servos and clock are in the intervals of flights that have them, and of no others."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.aircraft.airframe import ELEVATOR
from host.aircraft.mass_properties import airframe_data
from host.arrays import Array
from host.constants import NORMAL_95
from host.instrument.deviations import SensorErrorModel, deviations, sensor_error_model
from host.physical.calibration import load_calibration
from host.physical.recording import SURFACES, Recording
from host.readers.even_grid import even_columns
from host.readers.recorded import recording_of_table
from host.resources import resource
from host.sysid.pipeline import aircraft_data, at_hand, identify_columns
from host.sysid.reconstruction.servo_response import servo_response, surface_positions
from host.twin.faults import Fault
from host.twin.testcard.cards import load
from host.twin.virtual import VirtualFlight, virtual_flight
from scipy import integrate

import host
from tests.host.sysid.recorded import STRAIGHT_ON

NAME = "ultrastick25e"
SERVO = ("servo_scale", "servo_zero_rad", "servo_delay_s", "servo_bandwidth_share")
CHECKED, OPEN = Recording(), Recording(clock_share=None)
COMMANDED = Recording(commanded=SURFACES)
Intervals = dict[str, tuple[float, float]]


@pytest.fixture(scope="module")
def flown() -> VirtualFlight:
    """A flight whose table has the pots, and the commands too."""
    return virtual_flight(STRAIGHT_ON, 41, chain="none")


@pytest.fixture(scope="module")
def measured(flown: VirtualFlight) -> dict[str, Array]:
    return even_columns(flown.table)[0]


@pytest.fixture(scope="module")
def commanded(flown: VirtualFlight) -> dict[str, Array]:
    """The same flight had there been no pot: commands, which the door puts behind servos."""
    there = {f"{s}_rad": flown.table[f"{s}_command_rad"] for s in SURFACES}
    return even_columns(flown.table.assign(**there))[0]


def answers(columns: dict[str, Array], instrument: SensorErrorModel) -> Intervals:
    """Return value and half-width of both answers, the linear one by the quickest method."""
    known = replace(aircraft_data(NAME), instrument=instrument)
    # Servos as open as the file leaves them: the fit would estimate their delay.
    flight = at_hand(columns, aircraft=known, recording=instrument.recording, delays=False)
    models = ("coefficients", "longitudinal", "lateral")
    answer = identify_columns(flight, models=models, methods="output-error-white")
    assert answer.coefficients is not None
    found = {f"{c.name} direct": (c.value, c.half_width) for c in answer.coefficients.coefficients}
    for one in answer.linear:
        found |= {f"{c.name} linear": (c.value, c.half_width) for c in one.coefficients}
    return found


def wider(usual: Intervals, other: Intervals) -> dict[str, float]:
    """Return by how much each interval is wider, as a share."""
    return {name: other[name][1] / half - 1.0 for name, (_, half) in usual.items()}


def added(usual: Intervals, other: Intervals) -> dict[str, float]:
    """Return the half-width that an independent error added to each, as a share of its value."""
    return {
        name: float(np.sqrt(max(other[name][1] ** 2 - half**2, 0.0))) / abs(value)
        for name, (value, half) in usual.items()
    }


@pytest.fixture(scope="module")
def settled(measured: dict[str, Array]) -> Intervals:
    """Both answers with pots and GPS."""
    return answers(measured, sensor_error_model(NAME).recorded(CHECKED))


@pytest.fixture(scope="module")
def usual(commanded: dict[str, Array]) -> Intervals:
    """Both answers without pots."""
    return answers(commanded, sensor_error_model(NAME).recorded(COMMANDED))


def test_servos_and_clock_move_nothing_where_pots_and_gps_settled_them(
    measured: dict[str, Array], settled: Intervals
) -> None:
    large = sensor_error_model(NAME).scaled(10.0, *SERVO, "clock_share")
    assert answers(measured, large.recorded(Recording(clock_share=2e-7))) == settled


def test_servos_move_intervals_where_no_pot_measured(
    commanded: dict[str, Array], usual: Intervals
) -> None:
    servos = sensor_error_model(NAME).recorded(COMMANDED)

    def ten(name: str) -> dict[str, float]:
        return added(usual, answers(commanded, servos.scaled(10.0, name)))

    scale, late, slow = ten("servo_scale"), ten("servo_delay_s"), ten("servo_bandwidth_share")
    # A derivative by a surface is wrong by the share that the servo's scale is.
    share = NORMAL_95 * servos.errors["servo_scale"].sigma("rudder") * np.sqrt(10.0**2 - 1.0)
    for answer in ("direct", "linear"):
        for name in ("Cm_de", "Cl_da", "Cn_dr"):
            assert scale[f"{name} {answer}"] == pytest.approx(share, rel=0.3), (name, answer)
        assert late[f"Cl_p {answer}"] > 0.15, answer
        assert slow[f"Cl_p {answer}"] > 0.2, answer
    assert late["Cm_q linear"] > 0.15
    assert (
        late["Cm_q direct"] > 0.13
    )  # known to 30 % here, 18 before the vanes' delay was the file's


def test_a_zero_of_a_command_moves_neither_value_nor_interval(
    commanded: dict[str, Array], usual: Intervals
) -> None:
    """A constant: the data tell it. Three deviations are in them, and stated."""
    servos = sensor_error_model(NAME).recorded(COMMANDED).scaled(3.0, "servo_zero_rad")
    off = {f"{s}_rad": commanded[f"{s}_rad"] + 0.03 for s in SURFACES}
    there = answers(commanded | off, servos)
    for name, (value, half) in usual.items():
        assert abs(there[name][0] - value) < 0.02 * half, name
        assert there[name][1] == pytest.approx(half, rel=0.02), name


def test_the_clock_moves_intervals_where_gps_settled_it_not(
    measured: dict[str, Array], settled: Intervals
) -> None:
    plain = sensor_error_model(NAME)
    free = answers(measured, plain.recorded(OPEN))
    wide = wider(free, answers(measured, plain.recorded(OPEN).scaled(10.0, "clock_share")))
    for answer in ("direct", "linear"):
        assert free[f"Cm_de {answer}"][1] > settled[f"Cm_de {answer}"][1], answer
        assert wide[f"Cm_de {answer}"] > 0.05, answer


def test_one_deviation_of_the_clock_counts_what_a_wrong_clock_does(
    measured: dict[str, Array], settled: Intervals
) -> None:
    """GPS that leaves 2 % open widens by what a time axis stretched by 2 % does to the values."""
    share, plain = 0.02, sensor_error_model(NAME)
    there = answers(measured, plain.recorded(Recording(clock_share=share)))
    longer = measured | {"t_s": measured["t_s"] * (1.0 + share)}
    moved = answers(longer, plain.recorded(CHECKED))
    ratios = []
    for name in ("Cm_de direct", "Cl_da direct", "Cm_de linear", "Cl_da linear"):
        counted = np.sqrt(there[name][1] ** 2 - settled[name][1] ** 2) / 1.96
        ratios.append(counted / abs(moved[name][0] - settled[name][0]))
    # Cm_de by the direct fit counts 1.1 to 2.0 times as much as it moves, in three flights.
    assert 1.0 < ratios[0] < 2.0
    assert ratios[1:] == pytest.approx([1.0] * 3, rel=0.3)


def test_a_line_of_a_pulse_is_the_servos_deviation(tmp_path: Path) -> None:
    text = resource("default.toml").read_text(encoding="utf-8").replace("default = true", "")
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    own = sensor_error_model(NAME, load_calibration(path))
    found = deviations(own.recorded(Recording(("rudder",))), airframe_data(NAME))
    assert found["rudder_servo_scale"] == pytest.approx(0.25)
    assert "rudder_scale" not in found
    assert found["elevator_scale"] == pytest.approx(0.05)  # its pot's
    assert own.errors["servo_zero_rad"].sigma("rudder") == pytest.approx(30.0 * 9.934951e-4)


def test_servos_nobody_measured_are_less_certain() -> None:
    known = sensor_error_model(NAME).recorded(COMMANDED)
    unknown = replace(known, servo_hz=0.0, servo_rate_radps=0.0)
    late = [deviations(i, airframe_data(NAME))["servo_delay_s"] for i in (known, unknown)]
    assert late[1] > 2.0 * late[0]


def test_servo_response_solves_its_equation() -> None:
    rng = np.random.default_rng(3)
    command = np.cumsum(rng.normal(0.0, 0.03, 200))
    found = servo_response(command, 0.01, 8.0, 2.6)

    def rate(t: float, x: Array) -> Array:
        error = command[min(int(t / 0.01 + 1e-9), 199)] - x
        return np.asarray(np.clip(2.0 * np.pi * 8.0 * error, -2.6, 2.6))

    at = command[0]
    for k in range(199):
        assert found[k] == pytest.approx(float(at), abs=2e-6)
        span = (0.01 * k, 0.01 * (k + 1) - 1e-9)
        at = integrate.solve_ivp(rate, span, [at], rtol=1e-9, atol=1e-9).y[0, -1]


@pytest.fixture(scope="module")
def recorded() -> VirtualFlight:
    """A flight without pots and without GPS through the recorder, its servos drawn."""
    card = load(STRAIGHT_ON)
    pots = ("pot_elevator", "pot_aileron_left", "pot_aileron_right", "pot_rudder")
    faults = (*(Fault("pot_open", 0.0, channel=pot) for pot in pots), Fault("gps_off", 0.0))
    sensors = replace(card.sensors, servo_tolerance=True)
    return virtual_flight(replace(card, faults=faults, sensors=sensors), 1)


def test_servos_of_the_aircraft_file_bring_commands_to_the_surfaces(
    recorded: VirtualFlight,
) -> None:
    """22 ms ahead before, a servo's own errors and the age of a pulse after."""
    table, true = even_columns(recorded.table)[0], recorded.record
    still = sensor_error_model(NAME).recorded(COMMANDED)
    behind = surface_positions(table, still)
    draws = true.draws
    late = table["t_s"] - table["t_s"][0]  # of a clock that nobody checked
    at_s = table["t_s"][0] + late / (1.0 + draws.scalar("clock_share"))
    flying = (at_s > 20.0) & (at_s < 85.0)
    own_s = float(draws.vector("servo_delay_s")[0])
    own_s -= float(draws.vector("servo_bandwidth_share")[0]) / (2.0 * np.pi * 8.0)
    for k, surface in enumerate(SURFACES):
        there = np.interp(at_s, true.t_s, true.states[:, ELEVATOR + k])
        rate = np.gradient(there, at_s)[flying]
        ahead = []
        for columns in (table, behind):
            e = (columns[f"{surface}_rad"] - there)[flying]
            ahead.append(float((e - e.mean()) @ rate / (rate @ rate)))
        assert ahead[0] - own_s == pytest.approx(0.022, abs=0.004), surface
        assert abs(ahead[1] - own_s) < 0.005, surface


def test_a_log_without_pots_and_gps_says_so_and_holds_the_truth(recorded: VirtualFlight) -> None:
    """Commands that passed for surfaces left five of these seven outside."""
    assert not recorded.table["elevator_pot_rad"].notna().any()
    answer = host.identify(recorded.table, aircraft=NAME, models=["coefficients"])
    assert any("the command through the aircraft file's servos (8 Hz" in n for n in answer.notes)
    assert any("no GPS checked the clock: 0.57 %" in n for n in answer.notes)
    assert answer.coefficients is not None
    true = truths(recorded)
    for d in answer.coefficients.fit.derivatives:
        if d.name in true:
            assert abs(d.value - true[d.name]) <= d.half_width, d.name


def truths(flight: VirtualFlight) -> dict[str, float]:
    """Return the mean over all maneuvers of the principal derivatives."""
    names = ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da", "Cn_beta")
    own = pd.DataFrame([m["derivatives"] for m in flight.maneuvers])
    return {name: float(own[name].mean()) for name in names}


def test_a_table_of_ours_shows_what_was_commanded_and_who_checked_the_clock(
    recorded: VirtualFlight, flown: VirtualFlight
) -> None:
    said = {"inputs": dict.fromkeys(SURFACES, "commanded"), "clock_half_width": None}
    assert {k: recorded.table.attrs[k] for k in said} == said
    alone = Recording(SURFACES, None)
    columns = numbers(recorded.table)
    assert recording_of_table(columns, said) == alone
    assert recording_of_table(columns, {}) == alone  # as a file of text has it
    pot = columns | {"rudder_pot_rad": columns["rudder_rad"], "v_north_mps": columns["t_s"]}
    assert recording_of_table(pot, {}) == Recording(("elevator", "aileron"), 0.0)
    checked = recording_of_table(columns, said | {"clock_half_width": 1e-4 * NORMAL_95})
    assert checked.clock_share == pytest.approx(1e-4)
    assert recording_of_table(numbers(flown.table), {}) == Recording(clock_share=None)  # no GPS
    others = numbers(flown.table.drop(columns="mega_drives"))
    assert recording_of_table(others, {}) == Recording(maker="foreign")


def test_a_surface_worked_on_since_is_that_of_its_pots_or_of_its_command(
    flown: VirtualFlight,
) -> None:
    columns = numbers(flown.table)
    own = columns["elevator_pot_rad"]
    smooth = 1.05 * np.convolve(np.pad(own, 2, mode="edge"), np.full(5, 0.2), mode="valid") + 0.02
    command = columns["elevator_command_rad"]
    pulses = {"servo_elevator_us": 1500.0 - 700.0 * command, "rc_elevator_us": 0.0 * command}
    assert np.all(columns["mega_drives"] == 1.0)
    logged = {k: v for k, v in columns.items() if not k.endswith("_command_rad")} | pulses
    for table in (columns, logged):
        assert recording_of_table(table | {"elevator_rad": smooth}, {}).commanded == ()
        moved = table | {"elevator_rad": 1.05 * command + 0.02}
        assert recording_of_table(moved, {}).commanded == ("elevator",)
    unknown = {k: v for k, v in logged.items() if k not in pulses} | {"elevator_rad": smooth}
    assert recording_of_table(unknown, {}).commanded == ("elevator",)


def numbers(table: pd.DataFrame) -> dict[str, Array]:
    """Return a table's columns by name."""
    return {str(name): table[name].to_numpy(dtype=np.float64) for name in table}
