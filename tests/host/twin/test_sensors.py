"""Sensors against their specification; each error has a switch that takes it out."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from host.aircraft.airframe import NORTH
from host.aircraft.attitude import euler
from host.twin.flight.draws import GROUPS
from host.twin.flight.fly import STEP_S, FlightRecord, fly
from host.twin.outcome.ideal import gps_columns, measured_table, times, true_table
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors import bmp085
from host.twin.sensors.analog import analog, convert, nominal
from host.twin.sensors.filters import delayed, first_order, vane
from host.twin.sensors.imu import imu
from host.twin.sensors.local_flow import AirData, air_data
from host.twin.sensors.mega_clock import ticks
from host.twin.sensors.sensor_delays import FILTERS
from host.twin.sensors.ubx import VELOCITY_NOISE_MPS, packet
from host.twin.testcard.cards import Card, Sensors, load
from host.wire.packets import packet as imu_packet
from scipy.stats import kstest

IDEAL = Sensors(**{f.name: False for f in fields(Sensors)})


@pytest.fixture(scope="module")
def calm() -> Card:
    return load("calm")


@pytest.fixture(scope="module")
def perfect(calm: Card) -> FlightRecord:
    return fly(replace(calm, sensors=IDEAL), seed=3)


@pytest.fixture(scope="module")
def real(calm: Card) -> FlightRecord:
    return fly(calm, seed=3)


@pytest.fixture(scope="module")
def perfect_data(perfect: FlightRecord) -> AirData:
    return air_data(perfect)


def test_without_errors_the_table_is_the_truth_to_the_resolution(perfect: FlightRecord) -> None:
    measured, true = measured_table(perfect), true_table(perfect)
    flying = (true["t_s"] > 6.0).to_numpy()
    # Half a count and what interpolation between 10 ms samples leaves.
    allowed = {"airspeed_mps": 0.15, "alpha_rad": 0.0035, "beta_rad": 0.0045, "p_radps": 0.02,
               "q_radps": 0.02, "r_radps": 0.02, "ax_mps2": 0.02, "ay_mps2": 0.02,
               "az_mps2": 0.15, "phi_rad": 2e-4, "theta_rad": 2e-4, "elevator_rad": 0.004,
               "aileron_rad": 0.004, "rudder_rad": 0.004}  # fmt: skip
    for name, limit in allowed.items():
        assert np.abs(measured[name] - true[name])[flying].max() < limit, name


def test_gps_columns_are_the_true_velocity_as_late_as_the_receiver(real: FlightRecord) -> None:
    at, north = times(real), gps_columns(real)["v_north_mps"]
    late_s = 0.15
    true = np.gradient(real.states[:, NORTH], STEP_S)
    flying = at > 6.5
    error = (north - np.interp(at - late_s, real.t_s, true))[flying]
    assert np.std(error) < 1.5 * VELOCITY_NOISE_MPS
    assert np.isnan(north[at < 0.2]).all()
    assert np.isfinite(north[flying][:-100]).all()


def test_deterministic_by_seed_and_different_by_seed(calm: Card, real: FlightRecord) -> None:
    again = fly(calm, seed=3)
    assert np.array_equal(real.states, again.states)
    assert measured_table(real).equals(measured_table(again))
    other = fly(calm, seed=4)
    assert other.frame.mass_kg != real.frame.mass_kg


def test_draws_stay_within_their_stated_ranges(calm: Card) -> None:
    from host.aircraft.file import load as load_aircraft
    from host.twin.flight.draws import draw

    plane = load_aircraft("ultrastick25e")
    drawn = [draw(plane, np.random.default_rng(k), tolerances=True) for k in range(300)]
    limits = {
        "mass_share": 0.01, "inertia_share": 0.05, "cg_m": 0.01, "imu_m": 0.01, "vane_a_m": 0.01,
        "vane_b_m": 0.01, "pitot_a_m": 0.01, "pitot_b_m": 0.01, "upwash_share": 0.2,
        "vane_scale_share": 0.03, "pitot_scale_share": 0.03, "pitot_drift_count": 1.0,
        "misalignment_rad": np.deg2rad(1.0), "imu_delay_share": 0.2, "vane_delay_share": 0.2,
        "pitot_delay_share": 0.2, "gps_delay_share": 0.2, "imu_delay_s": 1e-3,
        "vane_delay_s": 1e-3, "pitot_delay_s": 1e-3, "clock_share": 0.005,
    }  # fmt: skip
    for name, limit in limits.items():
        size = np.array([np.abs(d.vector(name)).max() for d in drawn])
        assert 0.95 * limit < size.max() <= limit, name
        # Uniform, centred, elements drawn each for itself: Kolmogorov and Smirnov, one in a
        # million.
        every = np.concatenate([np.ravel(d.vector(name)) for d in drawn]) / limit
        assert kstest(every, "uniform", args=(-1.0, 2.0)).pvalue > 1e-6, name
        assert kstest(every**2, "uniform").pvalue < 1e-6, name
    none = draw(plane, np.random.default_rng(1), tolerances=False)
    assert all(np.all(value == 0.0) for value in none.values.values())


def test_one_switch_leaves_nominal_its_own_draws_and_no_others(calm: Card) -> None:
    every = replace(calm.sensors, tolerances=True, **dict.fromkeys(GROUPS, True))
    real = fly(replace(calm, sensors=every), seed=3).draws.values
    for group, names in GROUPS.items():
        sensors = replace(every, **{group: False})
        drawn = fly(replace(calm, sensors=sensors), seed=3).draws.values
        for name, value in drawn.items():
            if name in names:
                assert np.any(real[name] != 0.0), name
                assert np.all(value == 0.0), (group, name)
            else:
                assert np.array_equal(value, real[name]), (group, name)


def test_vane_is_a_second_order_system_with_the_stated_frequency_and_damping() -> None:
    t = np.arange(0.0, 1.0, 1e-3)
    speed = np.full(len(t), 17.0)
    target = np.full(len(t), 0.1)
    target[0] = 0.0
    out = vane(target, speed, 0.8, 0.35, 0.0, 17.0, 1e-3)
    w, z = 2 * np.pi * 0.8 * 17.0, 0.35
    wd = w * np.sqrt(1 - z * z)
    late = np.maximum(t - 1e-3, 0.0)
    phase = wd * late
    expected = 0.1 * (
        1 - np.exp(-z * w * late) * (np.cos(phase) + z / np.sqrt(1 - z * z) * np.sin(phase))
    )
    assert np.abs(out - expected).max() < 0.003
    slower = vane(target, speed, 0.6, 0.35, 0.0, 17.0, 1e-3)
    assert np.abs(slower - expected).max() > 0.01


def test_friction_leaves_a_standing_error_that_grows_as_speed_falls() -> None:
    t = np.arange(0.0, 20.0, 1e-3)
    target = 0.05 * np.sin(2 * np.pi * 0.05 * t)

    def stuck(speed_mps: float) -> float:
        speed = np.full(len(t), speed_mps)
        return float(
            np.abs(vane(target, speed, 0.8, 0.35, 0.0017, 17.0, 1e-3) - target)[5000:].max()
        )

    assert stuck(17.0) == pytest.approx(0.0017, rel=0.4)
    assert stuck(10.0) == pytest.approx(0.0017 * 2.89, rel=0.4)


def test_wing_tip_vane_sees_roll_rate_and_upwash(perfect: FlightRecord) -> None:
    card = replace(perfect.card, sensors=replace(IDEAL, position=True))
    record = replace(perfect, card=card)
    data = air_data(record)
    counts = analog(record, data).counts
    zero, slope = nominal()["alpha_a"]
    left, right = ((counts[:, k] - zero) * slope for k in (0, 1))
    rolling = np.abs(data.rates_radps[:, 0]) > 0.3
    # Right wing goes down: the right tip's alpha grows by p y / V, the left one's falls.
    expected = 1.1 * 2 * 0.60 * data.rates_radps[rolling, 0] / data.velocity_mps[rolling, 0]
    assert np.corrcoef((right - left)[rolling], expected)[0, 1] > 0.995
    assert np.polyfit(expected, (right - left)[rolling], 1)[0] == pytest.approx(1.0, abs=0.05)
    steady = (record.t_s > 6.0) & (record.t_s < 9.0)
    mean = 0.5 * (left + right)[steady].mean()
    assert mean / data.alpha_rad[steady].mean() == pytest.approx(1.10, abs=0.01)


def test_accelerometer_off_the_cg_feels_the_angular_motion(
    perfect: FlightRecord, perfect_data: AirData
) -> None:
    at = np.arange(6.0, perfect.t_s[-1] - 0.1, 0.005)
    rng = np.random.default_rng(0)
    centre = imu(perfect, perfect_data, at, 3, rng)
    card = replace(perfect.card, sensors=replace(IDEAL, position=True))
    moved = imu(replace(perfect, card=card), perfect_data, at, 3, rng)
    x, _, z = perfect.aircraft.vector("sensors.imu_m")
    pitch = np.interp(at, perfect.t_s, perfect.angular_acceleration_radps2[:, 1])
    assert np.abs(pitch).max() > 3.0
    difference = moved.force_mps2 - centre.force_mps2
    # a_z gains -q' x, a_x gains q' z; rates squared are small against them here.
    assert np.abs(difference[:, 2] + pitch * x).max() < 0.08
    assert np.abs(difference[:, 0] - pitch * z).max() < 0.08


def test_imu_filter_delays_by_its_data_sheet(perfect: FlightRecord, perfect_data: AirData) -> None:
    at = np.arange(6.0, perfect.t_s[-1] - 0.1, 0.001)
    card = replace(perfect.card, sensors=replace(IDEAL, imu_filter=True))
    for dlpf, (gyro, _) in FILTERS.items():
        sample = imu(replace(perfect, card=card), perfect_data, at, dlpf, np.random.default_rng(0))
        true_q = perfect.states[:, 4]
        error = [
            np.std(sample.rates_radps[:, 1] - delayed(perfect.t_s, true_q, late, at))
            for late in np.arange(0.0, 0.02, 0.0005)
        ]
        assert 0.0005 * int(np.argmin(error)) == pytest.approx(gyro[1], abs=0.0008)


def test_imu_noise_has_the_data_sheet_density(real: FlightRecord) -> None:
    data = air_data(real)
    at = np.arange(0.1, 4.9, 0.005)
    sample = imu(real, data, at, 3, np.random.default_rng(5))
    # 0.005 deg/s/sqrt(Hz) through a first-order 42 Hz filter: noise bandwidth 42 pi/2 = 66 Hz.
    expected = np.deg2rad(0.005) * np.sqrt(66.0)
    assert sample.rates_radps.std(axis=0) == pytest.approx(expected, rel=0.15)
    expected = 400e-6 * 9.80665 * np.sqrt(44.0 * np.pi / 2)
    assert sample.force_mps2.std(axis=0) == pytest.approx(expected, rel=0.15)


def test_attitude_filter_stays_within_a_few_degrees_and_is_not_perfect(real: FlightRecord) -> None:
    data = air_data(real)
    at = np.arange(0.1, real.t_s[-1] - 0.1, 0.005)
    sample = imu(real, data, at, 3, np.random.default_rng(5))
    phi, theta, _ = euler(real.states[:, 6:10])
    for k, truth in enumerate((phi, theta)):
        error = sample.attitude_rad[:, k] - np.interp(at, real.t_s, truth)
        assert np.deg2rad(0.2) < error.std() < np.deg2rad(4.0)


def test_pitot_reads_dynamic_pressure_and_drifts_by_its_draw(perfect: FlightRecord) -> None:
    data = air_data(perfect)
    zero, slope = nominal()["dp_a"]
    clean = (analog(perfect, data).counts[:, 4] - zero) * slope
    slow = first_order(data.qbar_pa, perfect.aircraft.scalar("sensors.pitot_lag_s"), 1e-3)
    assert np.abs(clean - slow).max() < 1e-9
    values = dict(perfect.draws.values)
    values["pitot_drift_count"] = np.array([1.0, -1.0])
    card = replace(perfect.card, sensors=replace(IDEAL, pitot_drift=True))
    drifted = replace(perfect, draws=type(perfect.draws)(values), card=card)
    shift = analog(drifted, data).counts[:, 4] - analog(perfect, data).counts[:, 4]
    assert shift[0] == 0.0
    assert shift[-1] == pytest.approx(1.0 - np.exp(-perfect.t_s[-1] / 60.0), abs=1e-6)


def test_converter_rounds_to_whole_counts_within_its_range(real: FlightRecord) -> None:
    source = analog(real, air_data(real))
    out = convert(source, real.t_s, np.array([1.0, 10.0, 15.0]), np.random.default_rng(0))
    assert np.array_equal(out, np.round(out))
    assert out.min() >= 0.0
    assert out.max() <= 1023.0


def ints(*values: int) -> bmp085.Integers:
    return np.array(values, dtype=np.int64)


def test_barometer_meets_the_published_vectors() -> None:
    t, p = bmp085.compensate(ints(27898), ints(23843), 0)
    assert (int(t[0]), int(p[0])) == (150, 69964)
    t, p = bmp085.compensate(ints(27898, 24342, 33315), ints(271097, 271097, 271097), 3)
    assert t.tolist() == [150, -201, 549]
    assert p.tolist() == [99998, 92251, 108922]


def test_raw_barometer_values_lead_back_to_the_pressure() -> None:
    rng = np.random.default_rng(2)
    warm, pressure = rng.uniform(-20, 60, 200), rng.uniform(70_000, 105_000, 200)
    ut = bmp085.raw_temperature(warm)
    t, p = bmp085.compensate(ut, bmp085.raw_pressure(pressure, ut, 3), 3)
    assert np.abs(t / 10.0 - warm).max() <= 0.11
    assert np.abs(p - pressure).max() <= 1.0


def test_gps_message_carries_the_published_checksum() -> None:
    # CFG-RATE 200 ms of the receiver description: B5 62 06 08 06 00 C8 00 01 00 01 00 DE 6A; here
    # the same sum over a NAV message, computed by hand for an empty payload of id 0x02.
    assert packet(0x02, b"") == bytes.fromhex("b56201020000030a")


def test_stimuli_are_ordered_and_on_the_recorders_clock(real: FlightRecord) -> None:
    given = stimuli(real, air_data(real))
    assert np.all(np.diff(given.edges["at"]) >= 0)
    assert np.all(np.diff(given.gps["at"]) >= 0)
    starts = np.array([p.start for p in given.packets])
    assert np.all(np.diff(starts) > 0)
    assert {p.address for p in given.packets} == {imu_packet("imu").address}
    assert {len(p.data) for p in given.packets} == {36}
    share = real.draws.scalar("clock_share")
    assert int(ticks(real, 10.0)) == pytest.approx(20e6 * (1.0 + share), abs=1.0)
    # Five pulses per frame, each with its own bit; widths come back from the edges.
    up = given.edges[given.edges["levels"] > 0]
    assert set(up["levels"].tolist()) == {1, 2, 4, 8, 16}
    widths = np.diff(given.edges["at"])[::2] / 2.0 / (1.0 + share)
    assert np.abs(widths - real.pulses_us.ravel()).max() < 1.0


def test_without_quantisation_switch_steps_vanish(
    perfect: FlightRecord, perfect_data: AirData
) -> None:
    at = np.arange(6.0, 8.0, 0.005)
    fine = imu(perfect, perfect_data, at, 3, np.random.default_rng(0)).rates_radps
    card = replace(perfect.card, sensors=replace(IDEAL, quantisation=True))
    coarse = imu(
        replace(perfect, card=card), perfect_data, at, 3, np.random.default_rng(0)
    ).rates_radps
    step = np.deg2rad(1 / 65.5)
    assert np.allclose(coarse / step, np.round(coarse / step))
    assert not np.allclose(fine / step, np.round(fine / step))
