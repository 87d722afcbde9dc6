"""Who says it: sender, component, primary, source and definition belong to a channel."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from host.readers.autopilot_flight import read_autopilot

from tests.host.readers import changed_logs as logs
from tests.host.readers.test_clocks import assert_same

pytestmark = pytest.mark.costs(30, "the first of them flies the virtual flight, which is kept")


def test_what_a_gimbal_says_is_not_the_autopilots(tmp_path: Path) -> None:
    """Its attitude was mixed in, and 98.6 % of a link that lost none had never come."""
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    every = logs.frames()
    mixed = []
    for k, (stamp, message, frame) in enumerate(logs.decoded(every)):
        mixed.append((stamp, frame))
        if message.get_type() == "ATTITUDE":
            other = dialect.MAVLink_attitude_message(
                message.time_boot_ms + 4, 0.0, -0.5, 0.3, 0.0, 0.0, 0.0
            )
            mixed.append((stamp + 4000, logs.packed(other, 7 * k, component=154)))
    found = read_autopilot(logs.telemetry(tmp_path / "gimbal.tlog", mixed))
    control = read_autopilot(logs.telemetry(tmp_path / "same.tlog", every))
    assert_same(found, control)
    assert not found.log.damage
    assert any("component 154 of the vehicle sends ATTITUDE too" in n for n in found.notes())


def test_a_script_that_logs_a_kind_of_the_same_name(tmp_path: Path) -> None:
    """Bank was 0 all flight: the second definition replaced the first."""
    control = logs.ardupilot(tmp_path / "same.bin")

    def own(kinds: logs.Kinds) -> None:
        t = np.arange(0.0, float(kinds["ATT"][1]["TimeUS"][-1]), 2e5)
        zero = np.zeros(len(t))
        kinds.clear()
        kinds["ATT"] = "Qfff", {"TimeUS": t, "Roll": zero, "Pitch": zero, "Yaw": zero}

    script = bytearray(logs.ardupilot(tmp_path / "script.bin", own).read_bytes())
    sync, number = b"\xa3\x95", 200
    at = script.index(sync + b"\x80", 80)
    script[at + 3] = number
    found = tmp_path / "both.bin"
    other = bytes(script).replace(sync + b"\x20", sync + bytes([number]))
    found.write_bytes(control.read_bytes() + other)
    flight = read_autopilot(found)
    assert_same(flight, read_autopilot(control))
    assert any(n.startswith("ATT is defined twice: the ") for n in flight.notes())


def test_a_second_definition_in_a_ulog_or_in_text_is_told(tmp_path: Path) -> None:
    ulog = logs.px4(tmp_path / "same.ulg")
    body = b"vehicle_attitude:uint64_t timestamp;float q;"
    whole = ulog.read_bytes()
    again = tmp_path / "again.ulg"
    again.write_bytes(whole + struct.pack("<HB", len(body), ord("F")) + body)
    text = logs.as_text(tmp_path / "same.log", logs.ardupilot(tmp_path / "same.bin"))
    both = tmp_path / "again.log"
    both.write_text(text.read_text() + "FMT, 200, 23, ATT, Qf, TimeUS,Roll\nATT, 1000, 0.0\n")
    for control, changed, name in ((ulog, again, "vehicle_attitude"), (text, both, "ATT")):
        found = read_autopilot(changed)
        assert_same(found, read_autopilot(control))
        assert any(n.startswith(f"{name} is defined twice: ") for n in found.notes()), name


def test_an_airspeed_that_px4_computes_is_no_pitots(tmp_path: Path) -> None:
    """Cn_beta was 40 % and Cl_da 45 % off with narrow intervals."""

    def fails(topics: logs.Topics) -> None:
        air = topics["airspeed_validated", 0]
        late = np.arange(len(air["timestamp"])) > len(air["timestamp"]) // 3
        air["airspeed_source"] = np.where(late, 4, 1).astype(np.int8)

    flight = read_autopilot(logs.px4(tmp_path / "fails.ulg", fails))
    own = flight.channels.signals["airspeed_mps"]
    third = len(own.t_s) // 3
    assert np.isfinite(own.values[: third + 1]).all()
    assert np.isnan(own.values[third + 1 :]).all()
    (line,) = [n for n in flight.notes() if "no pitot's" in n]
    assert line.startswith(f"airspeed is no pitot's from {own.t_s[third + 1]:.1f} s on")
    control = read_autopilot(logs.px4(tmp_path / "same.ulg"))
    assert not [n for n in control.notes() if "no pitot's" in n]


def test_the_raw_airspeed_of_px4_gets_the_scale_of_its_pitot(tmp_path: Path) -> None:
    def raw(topics: logs.Topics) -> None:
        air = topics["airspeed_validated", 0]
        air["airspeed_source"] = np.full(len(air["timestamp"]), 2, dtype=np.int8)
        keys = ("timestamp", "indicated_airspeed_m_s", "true_airspeed_m_s")
        for instance, factor in ((0, 0.5), (1, 1.0)):
            own = {k: air[k] if k == "timestamp" else np.float32(factor) * air[k] for k in keys}
            topics["airspeed", instance] = own
        topics["airspeed_validated", 0] = {k: v[::4] for k, v in air.items()}

    scales = {"ASPD_SCALE_1": 9.0, "ASPD_SCALE_2": 1.1}
    found = read_autopilot(logs.px4(tmp_path / "raw.ulg", raw, scales))
    control = read_autopilot(logs.px4(tmp_path / "same.ulg"))
    own = found.channels.signals["airspeed_mps"]
    assert own.source == "airspeed[1].true_airspeed_m_s"
    true = control.channels.signals["airspeed_mps"].values
    np.testing.assert_allclose(own.values, 1.1 * true, rtol=1e-5)


def test_the_pitot_that_ardupilot_flies_by(tmp_path: Path) -> None:
    """The first of two was taken, though the second is primary, or the first is ill."""

    def two(kinds: logs.Kinds) -> None:
        fields = kinds["ARSP"][1]
        kept = {name: fields[name] for name in ("TimeUS", "Airspeed")}
        count = len(fields["TimeUS"])
        rows = {name: np.repeat(values, 2) for name, values in kept.items()}
        which = np.tile([0, 1], count)
        rows["Airspeed"] = np.where(which == 1, rows["Airspeed"], 0.5 * rows["Airspeed"])
        rest = {
            "I": which,
            "U": 0 * which + 1,
            "H": 0 * which + 1,
            "Pri": 0 * which + 1,
        }
        kinds["ARSP"] = "QfBBBB", {**rows, **rest}

    found = read_autopilot(logs.ardupilot(tmp_path / "two.bin", two))
    control = read_autopilot(logs.ardupilot(tmp_path / "same.bin"))
    own, other = (f.channels.signals["airspeed_mps"] for f in (found, control))
    assert own.source.startswith("ARSP[1]")
    np.testing.assert_allclose(own.values, other.values, rtol=2e-2)
    assert any("ARSP 1 of 2 is used" in n for n in found.notes())


def reversal(kinds: logs.Kinds, at_share: float) -> None:
    """Write SERVO2_REVERSED anew, at a share of the log."""
    letters, fields = kinds["PARM"]
    names = [bytes(n).decode().strip("\0") for n in fields["Name"]]
    row = names.index("SERVO2_REVERSED")
    later = {key: np.append(values, values[row : row + 1]) for key, values in fields.items()}
    later["TimeUS"][-1] = at_share * kinds["IMU"][1]["TimeUS"][-1]
    later["Value"][-1] = 1.0 - later["Value"][row]
    kinds["PARM"] = letters, later


@pytest.mark.parametrize("at_share", [0.95, 0.3])
def test_a_parameter_counts_from_when_it_was_written(at_share: float, tmp_path: Path) -> None:
    """A reversal that was changed after the landing turned the whole flight round."""
    path = logs.ardupilot(tmp_path / "late.bin", lambda kinds: reversal(kinds, at_share))
    found = read_autopilot(path)
    control = read_autopilot(logs.ardupilot(tmp_path / "same.bin"))
    own, other = (f.channels.signals["elevator"] for f in (found, control))
    at_s = at_share * control.channels.signals["q_radps"].t_s[-1]
    before = own.t_s < at_s - 0.1
    np.testing.assert_allclose(own.values[before], other.values[before])
    np.testing.assert_allclose(own.values[own.t_s > at_s], -other.values[own.t_s > at_s])
    (line,) = [n for n in found.notes() if n.startswith("SERVO2_REVERSED")]
    assert line.startswith(f"SERVO2_REVERSED changed from 1 to 0 at {at_s:.1f} s")
    assert not [n for n in control.notes() if "changed from" in n]


def test_a_parameter_of_px4_counts_from_when_it_was_written(tmp_path: Path) -> None:
    control = logs.px4(tmp_path / "same.ulg")
    key = b"int32_t CA_SV_CS2_TYPE"
    body = bytes([len(key)]) + key + struct.pack("<i", 0)
    changed = tmp_path / "late.ulg"
    changed.write_bytes(control.read_bytes() + struct.pack("<HB", len(body), ord("P")) + body)
    found, same = read_autopilot(changed), read_autopilot(control)
    own, other = (f.channels.signals["rudder"].values for f in (found, same))
    np.testing.assert_array_equal(own[:-1], other[:-1])
    (line,) = [n for n in found.notes() if "changed from" in n]
    end_s = max(s.t_s[-1] for s in same.channels.signals.values())
    assert line.startswith("CA_SV_CS2_TYPE changed from ")
    assert float(line.partition(" at ")[2].split()[0]) == pytest.approx(end_s, abs=0.1)


def test_a_restart_on_the_air_is_no_loss(tmp_path: Path) -> None:
    """The autopilot numbers its frames anew: up to 255 of them 'never came'."""
    every = logs.frames()
    first, later_us = every[: len(every) // 2], every[-1][0] - every[0][0] + 60_000_000
    again = [(stamp + later_us, frame) for stamp, frame in every]
    both = read_autopilot(logs.telemetry(tmp_path / "two.tlog", first + again))
    assert len(both.listed) == 2
    assert not both.log.damage
    lossy = first[:2000] + first[2100:] + again[:2000] + again[2050:]
    path = logs.telemetry(tmp_path / "lost.tlog", lossy)
    for number, many in ((1, 100), (2, 50)):
        (said,) = read_autopilot(path, flight=number).log.damage
        assert said.startswith(f"{many} frames (")


def test_integers_of_px4_come_as_the_bytes_of_a_float(tmp_path: Path) -> None:
    """Without what its outputs are no log of PX4's telemetry had surfaces."""
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    typed = {"CA_SV_CS_COUNT": 3, "CA_SV_CS0_TYPE": 15, "CA_SV_CS1_TYPE": 3, "CA_SV_CS2_TYPE": 4}
    typed |= {f"PWM_MAIN_FUNC{pin}": 201 + k for k, pin in enumerate((1, 2, 4))}
    typed |= {f"PWM_MAIN_MIN{pin}": 1100 for pin in (1, 2, 4)}
    typed |= {f"PWM_MAIN_MAX{pin}": 1900 for pin in (1, 2, 4)}
    control = read_autopilot(logs.telemetry(tmp_path / "same.tlog", logs.frames()))
    turned = {k: int(control.log.parameters[f"SERVO{k}_REVERSED"]) for k in (1, 2, 4)}
    # Nose up, roll right and nose right are positive for ArduPilot and PX4 alike, before a
    # reversal.
    typed["PWM_MAIN_REV"] = sum(1 << k - 1 for k, own in turned.items() if own)
    said = []
    number = stamp = 0
    for stamp, message, _ in logs.decoded(logs.frames()):
        if message.get_type() == "PARAM_VALUE":
            continue
        if message.get_type() == "HEARTBEAT":
            message.autopilot = 12
        said.append((stamp, logs.packed(message, number)))
        number += 1
    for name, value in typed.items():
        (raw,) = struct.unpack("<f", struct.pack("<i", value))
        one = dialect.MAVLink_param_value_message(name.encode(), raw, 6, len(typed), 0)
        said.append((stamp, logs.packed(one, number)))
        number += 1
    found = read_autopilot(logs.telemetry(tmp_path / "px4.tlog", said))
    assert found.log.parameters["CA_SV_CS0_TYPE"] == 15.0
    for name in ("elevator", "aileron", "rudder"):
        own, other = (f.channels.signals[name].values for f in (found, control))
        assert np.corrcoef(own, other)[0, 1] == pytest.approx(1.0, abs=5e-3), (
            name
        )  # its middle is no trim
