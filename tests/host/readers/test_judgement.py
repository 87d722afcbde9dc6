"""A log is judged first: what it is of, what it is good for, which setting to change."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.cli import main
from host.readers.airborne import airborne
from host.readers.autopilot_flight import read_autopilot
from host.readers.autopilot_log import AutopilotLog, Messages
from host.readers.judgement import Judgement, judge
from host.readers.log_formats import read_messages
from host.readers.named_channels import Channels
from host.readers.px4_channels import not_flying_signals, px4_channels
from scipy.spatial.transform import Rotation

from tests.host.readers.autopilot_flights import write

BENCH = Path(__file__).parents[2] / "data" / "px4"
REFUSED = {
    "sample_log_small.ulg": "PX4 ULog of a VTOL that never flew (airspeed at most 0.0 m/s)",
    "sample_appended_multiple.ulg": "PX4 ULog of a copter, which does not fly on a wing",
}


@pytest.mark.parametrize("name", sorted(REFUSED))
@pytest.mark.parametrize("verb", ["identify", "maneuvers"])
def test_bench_logs_are_refused_in_one_sentence(
    name: str, verb: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([verb, str(BENCH / name)]) == 6
    out, err = capsys.readouterr()
    assert out == ""
    (line,) = err.strip().splitlines()
    assert REFUSED[name] in line


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_bench_logs_are_described_and_decoded(
    name: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["info", str(BENCH / name), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert REFUSED[name] in told["judgement"]["refusal"]
    assert told["airborne_s"] == 0.0
    assert main(["decode", str(BENCH / name), "-o", "table.csv"]) in (0, 3)
    assert (tmp_path / "table.csv").read_text().startswith("t_s,p_radps,")


def judged(log: AutopilotLog) -> Judgement:
    """Judge messages of PX4."""
    found: Channels = px4_channels(log, {})
    return judge(log, found, airborne(found, not_flying_signals(log)))


def slower(messages: Messages, every: int) -> dict[int, Messages]:
    """Return every n-th message of a topic."""
    return {0: Messages(messages.t_s[::every], {k: v[::every] for k, v in messages.fields.items()})}


@pytest.fixture(scope="module")
def px4(tmp_path_factory: pytest.TempPathFactory) -> AutopilotLog:
    return read_messages(write("ulog", tmp_path_factory.mktemp("px4")))[0]


def test_outputs_at_10_hz_name_the_parameter(px4: AutopilotLog) -> None:
    messages = {**px4.messages, "actuator_servos": slower(px4.messages["actuator_servos"][0], 20)}
    bad = judged(replace(px4, messages=messages, parameters={**px4.parameters, "SDLOG_PROFILE": 1}))
    assert "comes at 10 Hz, 20 are needed (surfaces). Mend it so: SDLOG_PROFILE = 17" in bad.refusal
    assert any("SDLOG_PROFILE = 17 (it is 1)" in one for one in bad.settings)
    assert judged(px4).settings == []
    assert judged(px4).refusal == ""


def test_without_airspeed_roll_stays_identifiable(px4: AutopilotLog) -> None:
    messages = {k: v for k, v in px4.messages.items() if k != "airspeed_validated"}
    found = judged(replace(px4, messages=messages))
    answers = dict(found.answers)
    assert answers["roll: L_p, L_da"] == "identifiable, no vanes: without GPS never under trust"
    short = next(v for k, v in answers.items() if k.startswith("short period"))
    assert short == "not identifiable: airspeed not in the log"
    assert any("SYS_HAS_NUM_ASPD" in one for one in found.settings)


def test_synthetic_airspeed_is_no_sensor(px4: AutopilotLog) -> None:
    """What PX4 makes of ground speed and wind is not taken for a pitot."""
    air = px4.messages["airspeed_validated"][0]
    made = Messages(air.t_s, {**air.fields, "airspeed_source": np.zeros(len(air), dtype=np.int8)})
    log = replace(px4, messages={**px4.messages, "airspeed_validated": {0: made}})
    assert "airspeed_mps" not in px4_channels(log, {}).signals


def test_an_answer_without_vanes_says_so(px4: AutopilotLog) -> None:
    answers = dict(judged(px4).answers)
    drag = next(v for k, v in answers.items() if k.startswith("speed, drag"))
    assert drag == "not identifiable without vanes: no angle of attack was measured"
    short = next(v for k, v in answers.items() if k.startswith("short"))
    assert short == "identifiable, no vanes: flow angles from the GPS path"


def test_a_plane_that_stays_on_the_ground(px4: AutopilotLog) -> None:
    """Its own land detector says that it stands: wind on the pitot is no flight."""
    stands = px4.messages["vehicle_land_detected"][0]
    fields = {**stands.fields, "landed": np.ones(len(stands), dtype=bool)}
    messages = {**px4.messages, "vehicle_land_detected": {0: Messages(stands.t_s, fields)}}
    assert "plane that never flew" in judged(replace(px4, messages=messages)).refusal


def test_a_vtol_on_its_rotors_does_not_fly(px4: AutopilotLog) -> None:
    status = px4.messages["vehicle_status"][0]
    for kind, refused in ((1, True), (2, False)):
        fields = {**status.fields, "vehicle_type": np.full(len(status), kind)}
        messages = {**px4.messages, "vehicle_status": {0: Messages(status.t_s, fields)}}
        found = judged(replace(px4, vehicle="vtol", messages=messages))
        assert ("a VTOL that never flew" in found.refusal) is refused


def test_a_tailsitter_is_turned_to_forward_flight(px4: AutopilotLog) -> None:
    """Its log has the axes of hover: x down and z back in flight, so that roll was yaw."""
    messages = dict(px4.messages)
    for topic, field in (("vehicle_angular_velocity", "xyz"), ("vehicle_acceleration", "xyz"),
                         ("sensor_combined", "gyro_rad"),
                         ("sensor_combined", "accelerometer_m_s2")):  # fmt: skip
        if topic not in messages:
            continue
        one = messages[topic][0]
        x, y, z = (one.fields[f"{field}[{k}]"] for k in range(3))
        hover = {f"{field}[0]": z, f"{field}[1]": y, f"{field}[2]": -x}
        messages[topic] = {0: Messages(one.t_s, {**one.fields, **hover})}
    attitude = messages["vehicle_attitude"][0]
    q = np.array([attitude.fields[f"q[{k}]"] for k in range(4)])
    turn = Rotation.from_euler("y", -90.0, degrees=True)
    turned = (Rotation.from_quat(q[[1, 2, 3, 0]].T) * turn).as_quat().T[[3, 0, 1, 2]]
    fields = {f"q[{k}]": turned[k] for k in range(4)}
    messages["vehicle_attitude"] = {0: Messages(attitude.t_s, fields)}
    status = messages["vehicle_status"][0]
    fields = {**status.fields, "is_vtol_tailsitter": np.ones(len(status))}
    messages["vehicle_status"] = {0: Messages(status.t_s, fields)}
    log = replace(px4, vehicle="vtol", messages=messages)
    found, right = px4_channels(log, {}), px4_channels(px4, {})
    for name, signal in right.signals.items():
        np.testing.assert_allclose(found.signals[name].values, signal.values, atol=2e-6)
    assert any("is_vtol_tailsitter" in note for note in found.notes)


def test_demands_of_a_tailsitter_are_turned_too(px4: AutopilotLog) -> None:
    t, kept = np.arange(0.0, 5.0, 0.01), ("vehicle_status", "vehicle_attitude")
    roll, pitch, yaw = (0.3 * np.sin((k + 1) * t) for k in range(3))
    status = Messages(np.array([0.0, 5.0]), {"is_vtol_tailsitter": np.ones(2)})
    hover = {"xyz[0]": yaw, "xyz[1]": pitch, "xyz[2]": -roll}
    messages = {k: px4.messages[k] for k in kept} | {"vehicle_status": {0: status}}
    messages["vehicle_torque_setpoint"] = {1: Messages(t, hover)}
    found = px4_channels(replace(px4, vehicle="vtol", messages=messages), {}).signals
    for name, right in (("aileron", roll), ("elevator", -pitch), ("rudder", -yaw)):
        np.testing.assert_allclose(found[name].values, right, atol=1e-9)


def test_telemetry_of_a_tailsitter_is_refused_by_that_name(px4: AutopilotLog) -> None:
    found = judged(replace(px4, format="tlog", vehicle="tailsitter"))
    assert "of a tailsitter: it does not say" in found.refusal


def test_a_sensor_that_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write("dataflash", tmp_path)
    assert main(["info", str(path), "--sensor", "IMU=3"]) == 2
    assert "no IMU 3; the log has 0" in capsys.readouterr().err
    assert read_autopilot(path, {"IMU": 0}).channels.signals["q_radps"].source == "IMU[0].GyrY"
