"""What a log says in our names, units and signs, against the truth of its flight."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from host.errors import UsageError
from host.readers.ardupilot_channels import ardupilot_channels
from host.readers.ardupilot_outputs import surfaces
from host.readers.autopilot_flight import log_choices, read_autopilot
from host.readers.autopilot_log import AutopilotLog, Messages
from host.readers.dataflash_binary import read_records
from host.readers.flown_tests import flown_tests
from host.readers.held_outputs import held_output
from host.readers.plausible_times import plausible_times
from host.readers.px4_channels import px4_channels
from host.readers.px4_outputs import allocated_surfaces
from host.readers.px4_pulses import controls_of_pulses
from host.readers.signals import Signal
from host.twin.outcome.ardupilot_log import ardupilot_parameters
from host.twin.outcome.autopilot_outputs import AIRFRAMES, ardupilot_pulses, px4_controls
from host.twin.outcome.px4_log import px4_parameters

from tests.host.readers.autopilot_flights import FORMATS, FULL_TRAVEL_RAD, truth, write

# Largest standard deviation of the error in flight: noise, lag and errors of the flight's sensors.
LIMITS = {
    "airspeed_mps": 0.25, "p_radps": 0.03, "q_radps": 0.03, "r_radps": 0.03,
    "ax_mps2": 0.15, "ay_mps2": 0.15, "az_mps2": 0.30, "phi_rad": 0.06, "theta_rad": 0.05,
    "static_pa": 6.0, "density_kgpm3": 0.004,
    "elevator_share": 0.012, "aileron_share": 0.012, "rudder_share": 0.016,
}  # fmt: skip


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("airframe", AIRFRAMES)
def test_columns_are_the_truth(kind: str, airframe: str, tmp_path: Path) -> None:
    """Every channel in our unit and sign, surfaces through three airframes' mixers."""
    flight = read_autopilot(write(kind, tmp_path, airframe))
    columns = flight.columns()
    true = truth()
    missing = {"rudder_share"} if airframe == "elevons" else set()
    for name, limit in LIMITS.items():
        if name in missing:
            assert name not in columns
            continue
        expected = true[name.replace("_share", "_rad")] / (
            FULL_TRAVEL_RAD if name.endswith("_share") else 1.0
        )
        seen = np.isfinite(columns[name]) & (columns["t_s"] > 5.0)
        seen &= columns["t_s"] < true["t_s"].iloc[-1] - 0.2
        error = columns[name][seen] - np.interp(columns["t_s"][seen], true["t_s"], expected)
        assert seen.sum() > 50, name
        assert float(error.std()) < limit, (name, float(error.std()))
        assert abs(float(error.mean())) < 0.5 * float(expected.abs().max()), name
    assert np.nanmedian(columns["az_mps2"]) < -8.0
    assert flight.flown.time_s == pytest.approx(true["t_s"].iloc[-1] - 3.0, abs=0.6)
    assert flight.judgement.refusal == ""


def _asked() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(7)
    return {axis: rng.uniform(-0.45, 0.45, 40) for axis in ("roll", "pitch", "yaw")} | {
        "throttle": rng.uniform(0.0, 1.0, 40)
    }


@pytest.mark.parametrize("airframe", AIRFRAMES)
def test_mixers_are_undone(airframe: str) -> None:
    """Random demands through each airframe's mixer, reversals, trims and uneven ends."""
    asked = _asked()
    pulses = ardupilot_pulses(asked, airframe)
    by_pin = {k + 1: p for k, p in enumerate(pulses)}
    ardupilot = surfaces(by_pin, ardupilot_parameters(airframe)).shares
    controls = dict(enumerate(px4_controls(asked, airframe)))
    px4 = allocated_surfaces(controls, px4_parameters(airframe)).shares
    expected = {"aileron": asked["roll"], "elevator": -asked["pitch"], "rudder": -asked["yaw"]}
    if airframe == "elevons":
        del expected["rudder"]
    for name, values in expected.items():
        np.testing.assert_allclose(ardupilot[name], values, atol=2.0 / 800.0)  # half a us
        np.testing.assert_allclose(px4[name], values, atol=1e-12)
    np.testing.assert_allclose(ardupilot["throttle"], asked["throttle"], atol=1e-3)


@pytest.mark.parametrize(
    ("parameter", "value", "name"),
    [("SERVO2_REVERSED", 0, "elevator"), ("SERVO4_TRIM", 1450, "rudder"),
     ("SERVO1_FUNCTION", 0, "aileron")],
)  # fmt: skip
def test_a_wrong_parameter_is_a_wrong_surface(parameter: str, value: int, name: str) -> None:
    """The log's parameters are what counts: each of them changes the surface."""
    pulses = dict(enumerate(ardupilot_pulses(_asked(), "conventional"), start=1))
    parameters = ardupilot_parameters("conventional")
    right = surfaces(pulses, parameters).shares[name]
    wrong = surfaces(pulses, {**parameters, parameter: value}).shares.get(name)
    assert wrong is None or float(np.max(np.abs(wrong - right))) > 0.05


def test_flaperons_and_two_motors() -> None:
    """Aileron is half the difference of flaperons, flap half their sum; throttle the mean."""
    both = {"MIN": 1000.0, "MAX": 2000.0, "TRIM": 1500.0, "REVERSED": 0.0}
    parameters = {f"SERVO{n}_{k}": v for n in range(1, 5) for k, v in both.items()}
    parameters |= {f"SERVO{n}_FUNCTION": f for n, f in ((1, 24), (2, 25), (3, 73), (4, 74))}
    roll, flap = np.array([0.2, -0.1]), np.array([0.1, 0.3])
    left_us, right_us = 1500 + 500 * (roll + flap), 1500 + 500 * (roll - flap)
    out = surfaces(
        {1: left_us, 2: right_us, 3: np.array([1400.0, 1500.0]), 4: np.array([1600.0, 1500.0])},
        parameters,
    ).shares
    np.testing.assert_allclose(out["aileron"], roll)
    np.testing.assert_allclose(out["flap"], flap)
    np.testing.assert_allclose(out["throttle"], [0.5, 0.5])
    np.testing.assert_allclose(out["throttle_difference"], [-0.2, 0.0])


def test_flaperons_of_px4() -> None:
    """Both ailerons down by the flap: what they share is no aileron (CA_SV_CSn_FLAP)."""
    roll, flap = np.array([0.2, -0.1, 0.0]), np.array([0.3, 0.3, 0.1])
    out = allocated_surfaces(
        {0: -roll - flap, 1: roll - flap},
        {"CA_SV_CS_COUNT": 2.0, "CA_SV_CS0_TYPE": 1.0, "CA_SV_CS1_TYPE": 2.0},
    )
    np.testing.assert_allclose(out.shares["aileron"], roll)


def test_an_output_stands_until_the_next_pulse() -> None:
    """Each second pulse of 50 Hz is on the curve between its neighbours, and each one stands."""
    t = np.arange(0.0, 1.0, 0.04)
    rows, values = held_output(Signal(t, np.where(t < 0.5, 0.0, 1.0), "C2"), 0.02)
    assert values[rows < 0.48 + 0.0199].max() == 0.0
    assert values[(rows > 0.5001) & (rows < 0.5199)] == pytest.approx(0.5)
    assert values[rows > 0.5201].min() == 1.0


def test_pulses_between_records_keep_a_motion_of_3_hz() -> None:
    """A line for every second pulse would be 7 % of it too small at its top."""
    t = np.arange(0.0, 2.0, 0.04)
    rows, values = held_output(Signal(t, np.sin(6.0 * np.pi * t), "C2"), 0.02)
    between = (np.round(rows / 0.005) % 8 == 4) & (rows > 0.1) & (rows < 1.9)
    assert between.sum() > 40
    np.testing.assert_allclose(values[between], np.sin(6.0 * np.pi * rows[between]), atol=0.02)


def test_times_that_cannot_be() -> None:
    """A flipped bit in a time costs its own record, not those around it."""
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.01, 0.03, 400))
    wrong = t.copy()
    wrong[[50, 51, 200]] = [9e9, t[51] + 1e4, t[200] - 3.0]
    kept, many = plausible_times(wrong)
    assert many == 3
    assert not kept[[50, 51, 200]].any()


def test_another_instance_is_chosen_by_name() -> None:
    assert log_choices(["IMU=1", "ARSP=0"]) == {"IMU": 1, "ARSP": 0}
    for word in ("IMU", "IMU=x", "=1"):
        with pytest.raises(UsageError, match="expected MESSAGE=N"):
            log_choices([word])


PINS = {
    2: (201, 1000.0, 1900.0, 0.0),
    5: (203, 1100.0, 2000.0, 1500.0),
    6: (101, 1000.0, 2000.0, 0.0),
}
PWM = {
    f"PWM_AUX_{key}{pin}": value
    for pin, every in PINS.items()
    for key, value in zip(("FUNC", "MIN", "MAX", "CENT"), every, strict=True)
} | {"PWM_AUX_REV": float(1 << 4)}  # of pin 5


def _pulses(asked: dict[int, np.ndarray]) -> dict[int, np.ndarray]:
    """PX4's own way there (mixer_module): pin 2 linear, pin 5 turned and by way of its centre."""
    third = np.interp(-asked[2], [-1.0, 0.0, 1.0], [1100.0, 1500.0, 2000.0])
    return {2: np.round(1450.0 + 450.0 * asked[0]), 5: np.round(third), 6: np.full(40, 1000.0)}


def test_px4_pulses_are_undone() -> None:
    """FUNC names the surface; MIN, MAX, CENT and REV take the pulse back to its control."""
    rng = np.random.default_rng(2)
    asked = {0: rng.uniform(-1.0, 1.0, 40), 2: rng.uniform(-1.0, 1.0, 40)}
    found = controls_of_pulses(_pulses(asked), PWM, "PWM_AUX")
    assert found.keys() == asked.keys()
    for surface, values in asked.items():
        np.testing.assert_allclose(found[surface], values, atol=0.5 / 400.0)
    assert not controls_of_pulses(_pulses(asked), PWM, "PWM_MAIN")
    none = {2: np.zeros(40), 5: np.zeros(40)}  # pins of another board: no servo pulse at all
    assert not controls_of_pulses(none, PWM, "PWM_AUX")


def _log(
    autopilot: str, messages: dict[str, Messages], parameters: dict[str, float]
) -> AutopilotLog:
    each = {name: {0: one} for name, one in messages.items()}
    return AutopilotLog(Path("x"), "ulog", autopilot, "plane", "", each, parameters)


def test_px4_pulses_stand_in_for_slow_servos() -> None:
    """actuator_servos at 10 Hz, actuator_outputs at 50 Hz: the faster one is taken, and named."""
    t, slow = np.arange(40) / 50.0, np.arange(8) / 10.0
    asked = {0: np.sin(t), 2: np.cos(3.0 * t)}
    fields = {f"output[{pin - 1}]": p for pin, p in _pulses(asked).items()}
    servos = {f"control[{k}]": np.zeros(8) for k in range(3)}
    messages = {"actuator_outputs": Messages(t, fields), "actuator_servos": Messages(slow, servos)}
    parameters = {**PWM, "CA_SV_CS0_TYPE": 15.0, "CA_SV_CS2_TYPE": 3.0, "CA_SV_CS_COUNT": 3.0}
    found = px4_channels(_log("px4", messages, parameters), {})
    np.testing.assert_allclose(found.signals["aileron"].values, asked[0], atol=2e-3)
    np.testing.assert_allclose(found.signals["elevator"].values, -asked[2], atol=2e-3)
    assert "PWM_AUX of actuator_outputs[0]" in found.signals["elevator"].source


def test_outputs_beyond_the_fourteenth() -> None:
    """RCO2 and RCO3 carry outputs 15 to 18 and 19 to 32, a moment behind RCOU."""
    t = np.arange(50) / 25.0
    both = {"MIN": 1000.0, "MAX": 2000.0, "TRIM": 1500.0, "REVERSED": 0.0}
    parameters = {f"SERVO{n}_{k}": v for n in (2, 16, 20) for k, v in both.items()}
    parameters |= {"SERVO2_FUNCTION": 4.0, "SERVO16_FUNCTION": 19.0, "SERVO20_FUNCTION": 21.0}
    wave = {n: 0.3 * np.sin(n * t) for n in (2, 16, 20)}
    of = {"RCOU": 2, "RCO2": 16, "RCO3": 20}
    messages = {
        name: Messages(t + 1e-4 * k, {f"C{n}": 1500.0 + 500.0 * wave[n]})
        for k, (name, n) in enumerate(of.items())
    }
    found = ardupilot_channels(_log("ardupilot", messages, parameters), {}).signals
    np.testing.assert_allclose(found["aileron"].values, wave[2])
    np.testing.assert_allclose(found["elevator"].values, -wave[16])
    np.testing.assert_allclose(found["rudder"].values, -wave[20])
    del messages["RCOU"]
    alone = ardupilot_channels(_log("ardupilot", messages, parameters), {}).signals
    np.testing.assert_allclose(alone["rudder"].values, -wave[20])


def test_tests_of_the_autopilot_are_named() -> None:
    """A chirp's messages, autotune's, a mode, a script's text: each with its time."""
    t = np.r_[np.arange(10.0, 20.0, 0.1), np.arange(40.0, 45.0, 0.1)]
    messages = {
        "SIDD": Messages(t, {}),
        "ATRP": Messages(np.arange(60.0, 70.0, 0.5), {}),
        "MODE": Messages(np.array([0.0, 58.0, 80.0]), {"ModeNum": np.array([0, 8, 0])}),
        "MSG": Messages(np.array([90.0, 95.0]), {"Message": np.array([b"STARTING DOUBLET", b"x"])}),
    }
    found = flown_tests(_log("ardupilot", messages, {}))
    said = [(one.name, round(one.from_s), round(one.to_s)) for one in found]
    assert said == [
        ("system-identification chirp", 10, 20), ("system-identification chirp", 40, 45),
        ("mode AUTOTUNE", 58, 80), ("autotune", 60, 70), ("doublet of a script", 90, 95),
    ]  # fmt: skip
    state = np.where((t > 12.0) & (t < 15.0), 4, 0)
    px4 = {"autotune_attitude_control_status": Messages(t, {"state": state})}
    (one,) = flown_tests(_log("px4", px4, {}))
    assert (one.name, round(one.from_s), round(one.to_s)) == ("autotune", 12, 15)


def test_a_log_is_in_memory_once(tmp_path: Path) -> None:
    """A gigabyte: single precision stays, offsets take four bytes, stamps and idle outputs go."""
    path = write("dataflash", tmp_path)
    flight = read_autopilot(path)
    imu = flight.log.messages["IMU"][0]
    assert np.shares_memory(flight.channels.signals["q_radps"].values, imu.fields["GyrY"])
    assert "TimeUS" not in imu.fields
    assert "C14" not in flight.log.messages["RCOU"][0].fields
    places = read_records(path).places
    assert {at.dtype for at in places.values()} == {np.dtype(np.uint32)}
