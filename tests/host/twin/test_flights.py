"""Cards, pilot, faults and the truth file."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.aircraft import handbook
from host.aircraft.airframe import P, R
from host.aircraft.attitude import euler
from host.aircraft.local_derivatives import local_derivatives
from host.twin.flight.fly import fly
from host.twin.flight.pilot import schedule
from host.twin.flight.stick_commands import NEUTRAL_US, THROW_US
from host.twin.outcome import original_logger
from host.twin.outcome.truth_files import maneuvers, series, write
from host.twin.sensors.analog import analog
from host.twin.sensors.local_flow import air_data
from host.twin.testcard import cards
from host.twin.testcard.cards import duration_s
from host.twin.testcard.input_shapes import multisine, multisine_signal, sweep_signal

MINIMAL = {"format": 1, "aircraft": "ultrastick25e", "segment": [{"kind": "trim", "duration_s": 2}]}


@pytest.mark.parametrize("name", cards.names())
def test_every_packaged_card_flies_and_stays_in_the_air(name: str) -> None:
    card = cards.load(name)
    record = fly(card, seed=2)
    cut = any(fault.kind == "motor_cut" for fault in card.faults)
    flying = record.t_s > card.flight.ground_s + 1.0
    assert len(record.t_s) == round(duration_s(card) * 1000) or cut
    phi, theta, _ = euler(record.states[:, 6:10])
    assert np.abs(phi[flying]).max() < np.deg2rad(75)
    assert np.abs(theta[flying]).max() < np.deg2rad(50)
    speed = air_data(record).airspeed_mps[flying]
    assert speed.min() > 0.6 * record.trim.airspeed_mps
    assert speed.max() < 1.6 * record.trim.airspeed_mps
    assert len(maneuvers(record, air_data(record))) >= 2


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": 2}, "format is 2, expected 1"),
        ({"segment": []}, r"no \[\[segment\]\]"),
        ({"segment": [{"kind": "loop"}]}, "kind is 'loop', expected trim, turn"),
        ({"segment": [{"kind": "trim"}]}, "trim needs duration_s above 0"),
        ({"segment": [{"kind": "trim", "duration_s": "long"}]}, "is 'long', expected a number"),
        ({"segment": [{"kind": "pulse", "axis": "flap", "amplitude": 1}]}, "axis is 'flap'"),
        (
            {"segment": [{"kind": "doublet", "axis": "rudder", "amplitude": [1, 2], "width_s": 1}]},
            "1 axes and 2 amplitudes",
        ),
        (
            {
                "segment": [
                    {
                        "kind": "multisine",
                        "axis": ["elevator", "aileron", "rudder"],
                        "amplitude": [1, 1, 1],
                        "duration_s": 4,
                        "low_hz": 0.2,
                        "high_hz": 0.6,
                    }
                ]
            },
            "2 whole multiples of 1/duration_s between low_hz and high_hz for 3 axes",
        ),
        ({"wind": 3}, "unknown key 'wind'"),
        ({"air": {"gust": 3}}, "unknown air.gust"),
        ({"air": {"turbulence_mps": -1}}, "turbulence_mps is -1 m/s, expected 0 to 15"),
        ({"flight": {"ground_s": -3}}, "ground_s is -3 s, expected 0 to 600"),
        ({"fault": [{"kind": "card_full", "at_s": 3}]}, "stands at power-on"),
        ({"fault": [{"kind": "power_cut", "at_s": 3, "duration_s": 2}]}, "unknown key 'duration_"),
        ({"fault": [{"kind": "vane_open", "at_s": 3, "channel": "dp_a"}]}, "channel is 'dp_a'"),
        ({"sensors": {"noise": 1}}, "expected true or false"),
        ({"fault": [{"kind": "bird"}]}, "kind is 'bird'"),
        ({"fault": [{"kind": "imu_off"}]}, "imu_off needs at_s"),
    ],
)
def test_broken_cards_say_what_is_wrong(change: dict[str, object], message: str) -> None:
    with pytest.raises(cards.CardError, match=message):
        cards.parse({**MINIMAL, **change}, "card")


def test_human_hand_scatters_as_stated_and_a_machine_does_not() -> None:
    document = {
        **MINIMAL,
        "pilot": {"early": 0.0, "drift": 0.0},
        "segment": [
            {"kind": "doublet", "axis": "rudder", "amplitude": 6.0, "width_s": 0.5, "repeat": 100}
        ],
    }
    card = cards.parse(document, "card")
    plan = schedule(card, 17.0, 1e-3, np.random.default_rng(1))
    widths = np.array([w.input_end_s - w.start_s for w in plan.windows]) - card.pilot.hand_s
    assert widths.mean() == pytest.approx(1.0, abs=0.02)
    # Two edges of 0.03 s each.
    assert widths.std() == pytest.approx(0.03 * 2**0.5, rel=0.3)
    peaks = [
        np.degrees(
            plan.orders.program[round(w.start_s * 1000) : round(w.input_end_s * 1000), 2].max()
        )
        for w in plan.windows
    ]
    assert np.std(peaks) / np.mean(peaks) == pytest.approx(0.08, rel=0.35)
    exact = replace(card, pilot=replace(card.pilot, timing_s=0.0, amplitude=0.0, hand_s=0.0))
    plan = schedule(exact, 17.0, 1e-3, np.random.default_rng(1))
    assert {round(w.input_end_s - w.start_s, 6) for w in plan.windows} == {1.0}


def test_pilot_keeps_off_during_an_input_unless_he_corrects_early() -> None:
    card = cards.load("calm")
    quiet = schedule(card, 17.0, 1e-3, np.random.default_rng(1))
    for w in quiet.windows:
        inside = slice(round(w.start_s * 1000), round(w.input_end_s * 1000))
        assert quiet.orders.attention[inside].max() == 0.0
    eager = replace(card, pilot=replace(card.pilot, early=1.0))
    early = schedule(eager, 17.0, 1e-3, np.random.default_rng(1))
    assert all(w.attention_s < w.input_end_s for w in early.windows)


def test_a_pilot_who_breaks_off_lets_go_early_and_corrects_at_once() -> None:
    card = cards.load("calm")
    whole = schedule(card, 17.0, 1e-3, np.random.default_rng(1)).windows
    hasty = replace(card, pilot=replace(card.pilot, breaks_off=1.0, early=0.0))
    broken = schedule(hasty, 17.0, 1e-3, np.random.default_rng(1)).windows
    for kept, w in zip(whole, broken, strict=True):
        if w.kind in ("doublet", "3211"):
            assert w.input_end_s - w.start_s < 0.85 * (kept.input_end_s - kept.start_s)
            assert w.attention_s == w.input_end_s


def test_the_same_inputs_are_flown_in_another_air() -> None:
    card = cards.load("calm")
    card = replace(card, air=replace(card.air, turbulence_mps=0.3))
    first, same, other = (fly(card, seed=4, noise_seed=n) for n in (None, 4, 5))
    assert np.array_equal(first.states, same.states)
    assert np.array_equal(first.schedule.orders.program, other.schedule.orders.program)
    assert first.draws.values["cg_m"].tolist() == other.draws.values["cg_m"].tolist()
    assert first.air[:, 3:].std(axis=0) == pytest.approx(other.air[:, 3:].std(axis=0), rel=0.5)
    assert abs(np.corrcoef(first.air[:, 5], other.air[:, 5])[0, 1]) < 0.3
    seen, elsewhere = (analog(flown, air_data(flown)).counts for flown in (same, other))
    assert not np.array_equal(seen, elsewhere)


def test_three_multisines_reach_the_sticks_orthogonal_and_in_their_own_sizes() -> None:
    document = {
        **MINIMAL,
        "segment": [
            {"kind": "multisine", "axis": ["elevator", "aileron", "rudder"],
             "amplitude": [2.0, 3.0, 4.0], "duration_s": 20, "low_hz": 0.1, "high_hz": 2.5}
        ],
    }  # fmt: skip
    plan = schedule(cards.parse(document, "card"), 17.0, 1e-3, np.random.default_rng(1))
    sticks = plan.orders.program[:, :3]
    assert np.degrees(np.abs(sticks).max(axis=0)) == pytest.approx([2.0, 3.0, 4.0], rel=0.01)
    unit = sticks / np.linalg.norm(sticks, axis=0)
    assert np.abs(unit.T @ unit - np.eye(3)).max() < 1e-9
    # One input half a second late, and they are no longer.
    assert abs(np.roll(unit[:, 0], 500) @ unit[:, 1]) > 1e-3


def test_multisines_are_orthogonal_flat_and_start_at_zero() -> None:
    t = np.arange(0.0, 20.0, 1e-3)
    waves = [
        multisine_signal(t, 20.0, f, phase)
        for f, phase in zip(*multisine(20.0, 0.1, 3.5, 2), strict=True)
    ]
    assert abs(waves[0] @ waves[1]) / (waves[0] @ waves[0]) < 1e-9
    for wave in waves:
        # Relative peak factor: peak to peak over 2 sqrt(2) rms; 1 is a sine, random phases give 2.
        assert np.ptp(wave) / (2 * 2**0.5 * wave.std()) < 1.35
        assert abs(wave[0]) < 0.05


def test_sweep_passes_its_frequencies_in_order() -> None:
    t = np.arange(0.0, 30.0, 1e-3)
    wave = sweep_signal(t, 30.0, 0.2, 4.0)
    crossings = t[1:][(wave[:-1] <= 0) & (wave[1:] > 0)]
    rates = 1.0 / np.diff(crossings)
    assert np.all(np.diff(rates) > 0)
    assert rates[0] == pytest.approx(0.2 * 20 ** (0.08), rel=0.15)
    assert rates[-1] == pytest.approx(4.0, rel=0.1)


def test_motor_cut_stops_the_propeller_and_the_pilot_glides() -> None:
    record = fly(cards.load("thesis_flight2"), seed=1)
    cut = next(f.at_s for f in record.card.faults if f.kind == "motor_cut")
    after = record.t_s > cut + 5.0
    assert record.states[after, 16].max() < 0.2 * record.trim.state[16]
    assert record.thrust_n[after].max() < 0.0
    height = -record.states[:, 12]
    assert height[-1] < height[record.t_s < cut][-1] - 15.0
    assert air_data(record).airspeed_mps[after].min() > 14.0


def test_a_flight_ends_where_it_meets_the_ground(tmp_path: Path) -> None:
    card = cards.load("thesis_flight2")
    record = fly(card, seed=1)
    height = -record.states[:, 12]
    assert record.touched_ground
    assert height.min() >= 0.0
    assert height[-1] == pytest.approx(0.0, abs=0.02)
    assert 1.0 < record.sink_mps < 6.0
    assert record.sink_mps == pytest.approx((height[-11] - height[-1]) / 0.01, abs=0.1)
    text = tomllib.loads(write(record, air_data(record), tmp_path / "flight")[1].read_text())
    assert text["ended_on_ground"] is True
    assert not fly(cards.load("calm"), seed=1).touched_ground
    with pytest.raises(cards.CardError, match="height_m is 0 m, expected above 0"):
        cards.parse({**MINIMAL, "flight": {"height_m": 0}}, "card")


def test_truth_windows_hold_the_input_and_nothing_of_the_next(tmp_path: Path) -> None:
    record = fly(cards.load("demo"), seed=5)
    data = air_data(record)
    found = write(record, data, tmp_path / "flight")
    arrays = np.load(found[0])
    text = tomllib.loads(found[1].read_text())
    assert text["seed"] == 5
    assert text["flown"]["mass_kg"] == record.frame.mass_kg
    assert text["drawn"]["mass_share"] * 1.793 + 1.793 == pytest.approx(record.frame.mass_kg)
    listed = text["maneuver"]
    assert len(listed) == len(record.schedule.windows)
    for one, following in zip(listed, [*listed[1:], None], strict=True):
        assert (
            one["start_s"] < one["input_end_s"] <= one["end_s"] <= one["input_end_s"] + 3.0 + 1e-9
        )
        if following:
            assert one["end_s"] <= following["start_s"]
        axis = {"elevator": 0, "aileron": 1, "rudder": 2, "throttle": 3}[one["axes"][0]]
        program = record.schedule.orders.program[:, axis]
        before = (record.t_s > one["start_s"] - 1.0) & (record.t_s < one["start_s"] - 2e-3)
        assert np.abs(program[before]).max() < 1e-12
        inside = (record.t_s > one["start_s"]) & (record.t_s < one["input_end_s"])
        assert np.abs(program[inside]).max() > 0.0
    columns = series(record, data)
    assert set(arrays.files) == set(columns)
    assert np.array_equal(arrays["alpha_rad"], columns["alpha_rad"])


def test_local_derivatives_explain_the_flown_moment() -> None:
    """Cm built from the truth file's derivatives is the Cm that turned the aircraft."""
    record = fly(cards.load("calm"), seed=6)
    data = air_data(record)
    one = next(m for m in maneuvers(record, data) if m["axes"] == ["elevator"])
    d, frame = one["derivatives"], record.frame
    assert isinstance(d, dict)
    start, end = float(str(one["start_s"])), float(str(one["end_s"]))
    inside = (record.t_s > start) & (record.t_s < end)
    speed = data.airspeed_mps[inside]
    q_hat = record.states[inside, 4] * frame.chord_m / (2 * speed)
    cm = (
        d["Cm_0"]
        + d["Cm_alpha"] * data.alpha_rad[inside]
        + d["Cm_q"] * q_hat
        + d["Cm_de"] * record.states[inside, 13]
    )
    p, r = record.states[inside, 3], record.states[inside, 5]
    acceleration = record.angular_acceleration_radps2[inside, 1]
    spin = frame.rotor_inertia_kgm2 * record.states[inside, 16]
    moment = (
        frame.iyy_kgm2 * acceleration
        + (frame.ixx_kgm2 - frame.izz_kgm2) * p * r
        + frame.ixz_kgm2 * (p**2 - r**2)
        + spin * (r * frame.thrust_axis[0] - p * frame.thrust_axis[2])
    )
    lever = (frame.hub_m[2] - frame.cg_m[2]) * frame.thrust_axis[0]
    lever -= (frame.hub_m[0] - frame.cg_m[0]) * frame.thrust_axis[2]
    moment -= lever * record.thrust_n[inside]
    flown = moment / (data.qbar_pa[inside] * frame.wing_area_m2 * frame.chord_m)
    assert np.abs(flown - cm).max() < 0.03 * np.abs(flown - flown[0]).max()
    nominal = local_derivatives(record.aircraft.airframe(), np.zeros(8))
    wrong = cm + (nominal["Cm_alpha"] * 0.8 - d["Cm_alpha"]) * data.alpha_rad[inside]
    assert np.abs(flown - wrong).max() > 0.05 * np.abs(flown - flown[0]).max()


def test_thesis_rows_have_its_faults() -> None:
    card = cards.load("thesis_flight2")
    record = fly(card, seed=4)
    printed = original_logger.rows(record, air_data(record))
    assert np.diff(printed["t_s"]).mean() == pytest.approx(0.05, rel=0.02)
    # Each half of an IMU sample comes every other row.
    same = (np.diff(printed["AN1"]) == 0.0).mean()
    assert same == pytest.approx(0.5, abs=0.05)
    assert (np.diff(printed["AN1"])[1::2] == 0.0).mean() > 0.98 or (
        np.diff(printed["AN1"])[0::2] == 0.0
    ).mean() > 0.98
    assert set((printed["altitude"] % 1).tolist()) == {0.0}
    # Noise about the zero of boot, clipped: some rows at rest say nought, the others a speed.
    rest = printed["velocity"][printed["t_s"] < card.flight.ground_s]
    assert (rest == 0.0).mean() == pytest.approx(0.5, abs=0.4)
    assert rest.min() == 0.0
    assert rest.max() < 15.0
    # Surfaces are commands: the hand-made map's slope, not the linkage's.
    row = np.searchsorted(record.pulse_starts_s + 0.012, printed["t_s"] - 0.03, side="right") - 1
    pulse_us = record.pulses_us[np.maximum(row, 0)]
    for name, channel, slope in (
        ("elevs", 1, 0.0756 * 1000 / (1904 - 1152)),
        ("ails", 0, 0.0738 * 1000 / (1956 - 1100)),
    ):
        found = np.polyfit(pulse_us[:, channel], printed[name], 1)[0]
        assert found == pytest.approx(slope, rel=0.03), name
        linkage = np.degrees(record.frame.surface_limit_rad[0]) / THROW_US
        assert found != pytest.approx(linkage, rel=0.03), name
    # A rudder at rest is printed as 4.7 deg: its map jumps, and its zero is no neutral.
    mapped = (pulse_us[:, 2].mean() - 1124.0) * 1000.0 / (1904 - 1124) + 1000.0
    assert printed["rdrs"].mean() == pytest.approx(0.0333 * mapped - 45.434, abs=0.06)
    assert printed["rdrs"].mean() > 4.0
    assert abs(np.degrees(record.states[:, 15]).mean()) < 1.0


def test_thesis_altitude_locks_on_a_field_above_100_m() -> None:
    card = cards.load("thesis_flight2")
    high = replace(card, flight=replace(card.flight, field_pressure_pa=99_000.0))
    record = fly(high, seed=1)
    locked = original_logger.rows(record, air_data(record))["altitude"]
    assert locked.nunique() == 1
    assert locked[0] == pytest.approx(-195.0, abs=15.0)  # minus the height of the field, for ever
    low = fly(card, seed=1)
    assert original_logger.rows(low, air_data(low))["altitude"].nunique() > 10


def test_vane_expression_overflows_as_the_printed_row_shows() -> None:
    # ADC 507, 514, 521, 523 are -737, -713, -690, -683 in the thesis's own sample row.
    printed = original_logger.overflowed_vane(np.array([507.0, 514.0, 521.0, 523.0]))
    assert printed.tolist() == [-737.0, -713.0, -690.0, -683.0]
    assert original_logger.overflowed_vane(np.array([364.0, 365.0])).tolist() == [1213.0, -1210.0]


def test_pulses_carry_the_sticks(tmp_path: Path) -> None:
    record = fly(cards.load("calm"), seed=1)
    limit = record.frame.surface_limit_rad[0]
    asked = (record.pulses_us[:, 1] - NEUTRAL_US) / THROW_US * limit
    row = np.searchsorted(record.pulse_starts_s, record.t_s - 0.03) - 1
    surface = record.states[:, 13]
    settled = (record.t_s > 6.0) & (record.t_s < 8.0)
    assert np.abs(asked[row][settled] - surface[settled]).max() < 0.01


def test_generated_aircraft_are_current() -> None:
    assert handbook.main(["--check"]) == 0


def test_handbook_comes_near_the_vortex_lattice_of_the_ultra_stick() -> None:
    # From the dimensions of its wing alone: the slopes that hardly need the tail.
    aspect = 1.26365**2 / 0.3093671232
    assert -handbook.rolling_slope(aspect) / 8.0 == pytest.approx(-0.392, rel=0.15)
    assert handbook.lift_slope(aspect) == pytest.approx(3.93, rel=0.10)


def test_an_aircraft_does_not_take_gusts_along() -> None:
    """In body axes they change by minus the rates times themselves, besides their own changes."""
    card = cards.load("demo")
    record = fly(replace(card, air=replace(card.air, turbulence_mps=1.0)), seed=2)
    flown = record.t_s > card.flight.ground_s + 5.0
    gust, rates = record.air[flown, 3:6], record.states[flown, P : R + 1]
    turned = -np.cross(rates, gust)[:-1].ravel()
    share = np.diff(gust, axis=0).ravel() / np.diff(record.t_s).mean() @ turned / (turned @ turned)
    assert share > 0.4  # 0.0 to 0.1 of three flights whose gusts turned with the aircraft
