"""The status line of the real image, and what its self-test refuses."""

from __future__ import annotations

import importlib.util
import json
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from host.link.status_line import ANALOGUE, StatusLine, parse_status
from host.wire.framing import text_of

import host

if TYPE_CHECKING:
    from flight.rig import FlightRig

MakeRig = Callable[..., "FlightRig"]
TOOL = Path(__file__).resolve().parents[3] / "hw" / "calibration" / "reference_record.py"


def last_line(rig: FlightRig) -> StatusLine:
    """The newest whole status line."""
    text = text_of(rig.chip.uart_sent(0)).decode("ascii").split("\r\n")[-2]
    line = parse_status(text)
    assert line is not None, text
    return line


def test_line_shows_every_sensor(make_rig: MakeRig) -> None:
    rig = make_rig()
    rig.power_on()
    rig.chip.run_s(11.0)
    line = last_line(rig)
    assert line.complaints() == []
    volts = [0.8 + 0.33 * slot for slot in range(11)]
    counts = [count for key in ANALOGUE for count in line.counts(key)]
    assert counts == pytest.approx([v / 5.0 * 1024 for v in volts[:10]], abs=2)
    assert line.numbers("rail")[0] == pytest.approx(2000 * volts[10], abs=40)
    assert line.state("relay") == "released"
    assert not line.supply_calibrated
    rig.imu.silent = True
    rig.chip.run_s(3.0)
    assert last_line(rig).state("imu") == "stale"


@pytest.mark.parametrize("baud", [4800, 19200, 38400, 57600, 115200])
def test_gps_is_found_at_whatever_baud_it_speaks(make_rig: MakeRig, baud: int) -> None:
    """Every other test starts at 9600, as delivered."""
    rig = make_rig()
    rig.gps.baud = baud
    rig.power_on()
    rig.chip.run_s(11.0)  # six bauds of 1.45 s, and two seconds until the line shows it
    assert rig.gps.baud == 38400
    assert last_line(rig).state("gps") == "ok"
    assert last_line(rig).fields["gps"].startswith("fix 3")


def test_host_status_shows_the_line_of_the_real_image(make_rig: MakeRig) -> None:
    """The command as a user types it, on the image's USB port as a pseudo-terminal."""
    from simavr_bench.pty_bridge import PtyBridge

    rig = make_rig()
    rig.power_on()
    rig.chip.run_s(11.0)
    with PtyBridge(rig.chip, 0) as bridge:
        command = [sys.executable, "-m", "host", "status", bridge.path, "--once", "--json"]
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as running:
            try:
                bridge.serve(lambda: running.poll() is not None, limit_s=60.0)
            finally:
                running.kill()
            out, err = running.communicate()
    assert (running.returncode, err) == (0, "")
    shown = json.loads(out)
    assert (shown["board"], shown["imu"]["state"]) == ("mega2560", "ok")
    assert shown["card"] == {"state": "ready", "file_number": 1}
    assert shown["receiver"]["pulse_us"] == pytest.approx([1500, 1500, 1500, 1000, 1000], abs=4)
    assert shown["complaints"] == []


def test_host_live_hears_the_channels_of_the_real_image(make_rig: MakeRig, tmp_path: Path) -> None:
    """The same port: envelopes between the lines, 20 a second, decoded like any capture."""
    from simavr_bench.pty_bridge import PtyBridge

    rig = make_rig()
    rig.power_on()
    rig.chip.run_s(11.0)
    capture = tmp_path / "usb.radio"
    with PtyBridge(rig.chip, 0) as bridge:
        command = [sys.executable, "-m", "host", "live", bridge.path, "--no-page", "--baud",
                   "115200", "-o", str(capture)]  # fmt: skip
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as running:
            try:
                bridge.serve(
                    lambda: (
                        (capture.exists() and capture.stat().st_size > 5000)
                        or running.poll() is not None
                    ),
                    limit_s=120.0,
                )
                running.send_signal(signal.SIGINT)
                _, err = running.communicate(timeout=60)
            finally:
                running.kill()
    assert running.returncode == 0, err
    assert " 0 did not arrive" in err
    log = host.read_log(capture)
    assert not log.loss.any
    ident = log.frames["ident"]
    assert len(ident) > 45
    assert np.all(np.abs(np.diff(ident["t_us"].astype(float)) - 50_000) < 200)
    sums = [ident[name].mean() for name in ("alpha_a", "dp_b", "pot_rudder")]
    volts = [0.8 + 0.33 * slot for slot in (0, 5, 9)]
    assert sums == pytest.approx([v / 5.0 * 4096 for v in volts], abs=8)


def test_contact_closed_before_the_first_heartbeat_is_refused(make_rig: MakeRig) -> None:
    rig = make_rig()
    rig.power_on()
    rig.chip.drive("PH6", False)
    rig.chip.run_s(4.0)
    assert last_line(rig).state("relay") == "stuck"
    assert last_line(rig).fields["drive"] == "direct (self-test)"


def test_record_of_the_chips_reference_corrects_the_supply(
    make_rig: MakeRig, tmp_path: Path
) -> None:
    spec = importlib.util.spec_from_file_location("reference_record", TOOL)
    assert spec is not None
    assert spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    rig = make_rig()
    rig.chip.analog_supply(4.8, bandgap_volt=1.17)
    rig.power_on()
    rig.chip.run_s(4.0)
    line = last_line(rig)
    shown_mv = line.numbers("avcc")[0]
    assert shown_mv == pytest.approx(4800 * 1.1 / 1.17, abs=25)
    assert not line.supply_calibrated
    out = tmp_path / "reference.hex"
    assert tool.main(["--meter", "4.8", "--shown", str(shown_mv / 1000), str(out)]) == 0
    data = bytes.fromhex(out.read_text().splitlines()[0][1:])
    eeprom = bytearray(rig.chip.eeprom())
    eeprom[4088:] = data[4:12]
    rig.chip.set_eeprom(bytes(eeprom))
    rig.chip.run_s(7.0)
    rig.chip.reset()
    rig.chip.run_s(4.0)
    line = last_line(rig)
    assert line.supply_calibrated
    assert line.numbers("avcc")[0] == pytest.approx(4800, abs=25)
    assert line.complaints() == []
    assert tool.main(["--meter", "4.8", "--shown", "3.0", str(out)]) == 2
