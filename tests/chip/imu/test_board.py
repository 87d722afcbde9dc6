"""The IMU's own image on its simulated chip: samples, sensors, offsets, console, attitude."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from host.wire.schema_text import packed_schema
from simavr_bench import MpuFault, ResetCause

if TYPE_CHECKING:
    from imu.conftest import MakeBoard
    from imu.rig import ImuBoard

G0_MPS2 = 9.80665
OFFSETS_VALID, RESTARTED, ATTITUDE_VALID, MAG_VALID = (
    packed_schema().bit("imu_flags", name)
    for name in ("offsets_valid", "restarted", "attitude_valid", "mag_valid")
)


def ask(board: ImuBoard, line: str) -> str:
    """Send a line to the console until it answers: the port looks for a GPS now and then."""
    for _ in range(20):
        before = len(board.chip.uart_sent(0))
        board.chip.uart_send(0, line.encode() + b"\n", baud=38400)
        board.chip.run_s(0.1)
        said = board.chip.uart_sent(0)[before:]
        if b"imu" in said:
            return said[said.index(b"imu") :].decode("ascii", "replace")
    raise AssertionError(f"no answer to {line!r}")


def test_every_sample_becomes_a_packet_that_states_its_age(make_board: MakeBoard) -> None:
    from imu.motion import fly
    from imu.packets import GYRO_BIAS, MAGNETOMETER, STATUS, imu_packets

    board = make_board()
    fly(board.mpu, board.magnetometer, 5.0)
    board.chip.run_s(4.0)
    packets = imu_packets(board.bus)
    samples = board.mpu.samples()
    assert len(packets) > 740
    assert set(np.diff([p.seq for p in packets]) % 256) == {1}
    turn = np.array([1, -1, -1])
    ready = samples["cycle"].astype(np.float64)
    for p in packets:
        sample = samples[np.argmin(np.abs(ready - (p.start - 16 * p.age_us)))]
        assert tuple(sample["rates"] * turn) == p.rates
        assert tuple(sample["force"] * turn) == p.force
        # 2 us of the step of 4, and the loop that waits for START
        assert abs((p.start - int(sample["cycle"])) / 16 - p.age_us) <= 15
    assert {p.aux_kind for p in packets} == {MAGNETOMETER, GYRO_BIAS, STATUS}
    status = next(p.aux for p in packets if p.aux_kind == STATUS)
    assert abs(status[0] - 3100) < 30  # 31 degC
    assert status[1] == 0x58 | 2 << 8  # product id, low-pass
    assert all(p.flags & RESTARTED for p in packets[:380])
    assert not any(p.flags & (RESTARTED | OFFSETS_VALID) for p in packets[420:])
    assert board.chip.faults() == []
    assert board.chip.interrupt(6).count == 0  # watchdog


def test_a_packet_takes_its_bits_at_400_khz(make_board: MakeBoard) -> None:
    from devices.ardu_imu import SEQUENCED
    from simavr_bench.log import LogKind, TwiNote

    board = make_board()
    board.chip.run_s(0.6)
    writes = [w for w in board.bus.writes() if w.address == SEQUENCED.address]
    records = board.chip.records(LogKind.TWI)
    done = records[records["source"] == TwiNote.DONE]["cycle"].astype(np.int64)
    for write in writes:
        took = int(done[np.searchsorted(done, write.start)]) - write.start
        # address, 36 bytes, STOP; then 38 interrupts of at most 130 cycles each
        bits = (37 * 9 + 1) * 40
        assert bits + 38 * 40 < took < bits + 38 * 130


@pytest.mark.parametrize(("product_id", "factor"), [(0x54, 2), (0x58, 1)])
def test_revision_c_is_told_and_its_counts_doubled(
    make_board: MakeBoard, product_id: int, factor: int
) -> None:
    from imu.packets import STATUS, imu_packets

    board = make_board(product_id=product_id)
    board.chip.run_s(1.0)
    packets = imu_packets(board.bus)
    assert board.mpu.samples()["force"][-1][2] * factor == pytest.approx(8192, abs=100)
    assert packets[-1].force[2] == pytest.approx(-8192, abs=100)
    assert {p.aux[1] & 0xFF for p in packets if p.aux_kind == STATUS} == {product_id}


@pytest.mark.parametrize("qmc", [False, True])
def test_mpu6050_and_either_magnetometer_on_one_bus(make_board: MakeBoard, qmc: bool) -> None:
    from imu.packets import MAGNETOMETER, imu_packets

    board = make_board(over_i2c=True, qmc=qmc)
    board.chip.run_s(1.5)
    board.chip.clear_statistics()
    board.chip.run_s(3.0)
    packets = imu_packets(board.bus)[-500:]
    assert set(np.diff([p.seq for p in packets]) % 256) == {1}
    fields = [p.aux for p in packets if p.aux_kind == MAGNETOMETER]
    assert len(fields) > 30
    assert fields[-1] == pytest.approx((273, 0, 414), abs=8)  # 0.25, 0, 0.38 gauss
    assert board.chip.load_now().busy_fraction <= 0.60
    assert board.chip.faults() == []


def test_offsets_are_set_at_rest_by_command_and_outlive_a_reset_in_flight(
    make_board: MakeBoard,
) -> None:
    from imu.motion import swaying
    from imu.packets import imu_packets
    from imu.record import read_record

    board = make_board()
    board.gps.silent = True
    bias = np.deg2rad([1.5, -0.8, 0.6])
    board.mpu.motion([0.0], [bias], [[0.4, -0.3, -G0_MPS2]])
    board.chip.run_s(4.0)
    assert "kept" in ask(board, "imu zero")
    assert "kept" in ask(board, "imu level")
    assert "kept" in ask(board, "imu declination -250")
    assert "kept" in ask(board, "imu iron 120 -45 30")
    board.chip.run_s(0.3)
    record = read_record(board.chip)
    assert record is not None
    assert record.offsets_valid == 1
    assert record.declination_cdeg == -250
    assert record.field_offset == (120, -45, 30)
    assert record.rate_offset == pytest.approx(np.rad2deg(bias) * 65.5, abs=2)
    assert record.force_offset == pytest.approx(
        (0.4 / G0_MPS2 * 8192, -0.3 / G0_MPS2 * 8192, 0), abs=6
    )
    shown = [int(word) for word in ask(board, "imu show").split()[1:11]]
    assert tuple(shown[:3]) == record.rate_offset
    # In motion: refused, and a reset changes nothing.
    at_s, rates, force = swaying(20.0)
    board.mpu.motion(at_s, rates, force)
    board.chip.run_s(1.0)
    assert "not at rest" in ask(board, "imu zero")
    assert "not at rest" in ask(board, "imu level")
    assert "not at rest" in ask(board, "imu iron 0 0 0")
    board.chip.reset(ResetCause.BROWN_OUT)
    board.chip.run_s(4.0)
    assert read_record(board.chip) == record
    last = imu_packets(board.bus)[-1]
    assert last.flags & OFFSETS_VALID
    made = board.mpu.samples()
    sample = made[np.argmin(np.abs(made["cycle"].astype(np.int64) - last.start + 16 * last.age_us))]
    assert np.array(last.rates) + record.rate_offset == pytest.approx(
        sample["rates"] * np.array([1, -1, -1])
    )


def test_declination_turns_the_heading(make_board: MakeBoard) -> None:
    from imu.packets import imu_packets
    from imu.record import ImuRecord

    headings = []
    for declination in (0, 1000):
        board = make_board(record=ImuRecord(declination_cdeg=declination))
        board.magnetometer.field([0.0], [[0.25e-4, 0.0, 0.38e-4]])
        board.chip.run_s(6.0)
        last = imu_packets(board.bus)[-1]
        assert last.flags & MAG_VALID
        headings.append(last.angles_cdeg[2])
    assert headings[0] == pytest.approx(0, abs=100)
    assert headings[1] - headings[0] == pytest.approx(1000, abs=100)


@pytest.mark.parametrize("speed_known", [True, False])
def test_gps_speed_takes_the_turn_off_the_vertical(
    make_board: MakeBoard, speed_known: bool
) -> None:
    from imu.packets import imu_packets

    bank, speed_mps = np.deg2rad(20.0), 15.0
    turn = G0_MPS2 * np.tan(bank) / speed_mps
    board = make_board()
    board.gps.velocity_cmps = (1500, 0, 0)
    board.gps.silent = not speed_known
    # A second to roll in, then a steady turn of 1.06 g, which no look at the size of g can tell.
    level, steady = [0.0, 0.0, 0.0], [0.0, turn * np.sin(bank), turn * np.cos(bank)]
    roll = [bank / 0.999, 0.0, 0.0]
    at_s = [0.0, 6.0, 6.001, 6.999, 7.0, 40.0]
    rates = [level, level, roll, roll, steady, steady]
    force = [[0.0, 0.0, -G0_MPS2]] * 4 + [[0.0, 0.0, -G0_MPS2 / np.cos(bank)]] * 2
    board.mpu.motion(at_s, rates, force)
    board.magnetometer.fail(absent=True)
    board.chip.run_s(35.0)
    assert (len(board.gps.epochs) > 100) is speed_known
    last = imu_packets(board.bus)[-1]
    assert last.flags & ATTITUDE_VALID
    error_deg = abs(last.angles_cdeg[0] / 100 - 20.0)
    assert error_deg < 3.0 if speed_known else error_deg > 6.0


def test_gps_that_another_board_configures_is_heard(make_board: MakeBoard) -> None:
    board = make_board()
    # The GPS's output wired to both boards: configured by the other one, at its baud, deaf to us.
    board.gps.baud = 38400
    board.gps.period_ms = 200
    board.gps.nmea = False
    board.gps.enabled = {(1, 2), (1, 6), (1, 18), (1, 7)}
    board.gps.deaf = True
    board.gps.velocity_cmps = (900, 0, 0)
    board.chip.run_s(6.0)
    # At rest by its sensors, but the GPS says that it moves.
    assert "not at rest" in ask_beside_gps(board, "imu zero")


def ask_beside_gps(board: ImuBoard, line: str) -> str:
    """Send a line between two epochs of the GPS."""
    for _ in range(40):
        before = len(board.chip.uart_sent(0))
        board.chip.uart_send(0, b"\n" + line.encode() + b"\n", baud=38400)
        board.chip.run_s(0.13)
        said = board.chip.uart_sent(0)[before:]
        if b"imu:" in said:
            return said[said.index(b"imu:") :].decode("ascii", "replace")
    raise AssertionError(f"no answer to {line!r}")


def test_no_sample_is_made_up_when_the_sensor_garbles(make_board: MakeBoard) -> None:
    from imu.packets import imu_packets

    board = make_board()
    board.chip.run_s(1.0)
    before = len(imu_packets(board.bus))
    board.mpu.fail(MpuFault.GARBAGE)
    board.chip.run_s(2.0)
    assert len(imu_packets(board.bus)) <= before + 1
    board.mpu.fail(MpuFault.NONE)
    board.chip.run_s(1.0)
    assert len(imu_packets(board.bus)) > before + 50


def test_a_mega_that_is_absent_costs_nothing(make_board: MakeBoard) -> None:
    board = make_board(mega=False)
    board.chip.run_s(1.0)
    board.chip.clear_statistics()
    made = len(board.mpu.samples())
    board.chip.run_s(5.0)
    served = board.chip.interrupt(1).count
    assert served == len(board.mpu.samples()) - made
    assert board.chip.load_now().busy_fraction < 0.6
    assert board.chip.interrupt(6).count == 0


def test_compat_sends_the_original_packets_with_their_meaning(make_board: MakeBoard) -> None:
    from imu.packets import imu_packets, original_packets
    from imu.record import ImuRecord

    board = make_board(record=ImuRecord(compat=1))
    rates = np.deg2rad([10.0, -20.0, 30.0])
    board.chip.run_s(1.0)
    board.mpu.motion([0.0], [rates], [[1.0, -2.0, -G0_MPS2]])
    board.chip.run_s(4.0)
    pairs = original_packets(board.bus)
    assert imu_packets(board.bus) == []
    assert len(pairs) == pytest.approx(4.75 * 50, abs=5)
    mean = np.mean(pairs[-100:], axis=0)
    # 16.4 LSB per deg/s; minus specific force at 8192 LSB per g
    assert mean[3:6] == pytest.approx([164.0, -328.0, 492.0], abs=1.0)
    assert mean[6:9] == pytest.approx(np.array([-1.0, 2.0, G0_MPS2]) / G0_MPS2 * 8192, abs=8)
    latitude, longitude, altitude, _, speed, fix, satellites = mean[9:]
    assert (latitude, longitude) == pytest.approx((25.05, 121.5), abs=1e-5)
    assert altitude == pytest.approx(30.0)
    assert speed == pytest.approx(np.hypot(12.0, 3.0), abs=0.02)
    assert (fix, satellites) == (1.0, 9.0)


@pytest.mark.parametrize("bootloader", [False, True])
def test_hang_with_interrupts_off_ends_in_a_reset(imu_elf: Path, bootloader: bool) -> None:
    """`cli` and a jump to itself: the watchdog's interrupt cannot run, its reset can."""
    from imu.packets import ADDRESSES, imu_packets
    from imu.rig import ImuBoard
    from simavr_bench import Image
    from simavr_bench.log import LogKind

    board = ImuBoard(imu_elf, bootloader=bootloader)
    board.bus.listen(*ADDRESSES)
    board.bus.log_bytes()
    board.power_on()
    board.chip.run_s(5.0)

    def resets() -> int:
        return len(board.chip.records(LogKind.OUT_OF_RESET))

    before, hung = resets(), board.chip.cycle
    address, size = board.chip.symbols["_ZN3hal13poll_transferEv"]
    code = board.chip.flash(address, size)
    board.chip.load(Image({address: b"\xf8\x94\xff\xcf"}))
    # In short steps towards the end: a program that came to the jump again before that is taken out
    # would go on in the middle of the function, one register short on its stack.
    while resets() == before and board.chip.cycle - hung < 2 * 16_000_000:
        board.chip.run_s(0.02 if board.chip.cycle - hung < 0.9 * 16e6 else 50e-6)
    assert 0.5 * 16e6 < board.chip.cycle - hung < 1.2 * 16e6
    board.chip.load(Image({address: code}))  # what hung it was no fault of the program
    board.chip.run_s(4.0)
    count = resets() - before
    packets = [p for p in imu_packets(board.bus) if p.start > hung + 16e6]
    board.chip.close()
    if bootloader:
        assert count > 20  # ATmegaBOOT leaves the watchdog on (boards/arduimu/README.md)
        return
    assert count == 1
    assert len(packets) > 200
    assert packets[0].start - hung < 2.5 * 16e6
    assert packets[0].flags & RESTARTED
