"""Who says it: sender, component, primary, source and definition belong to a channel."""

from __future__ import annotations

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
