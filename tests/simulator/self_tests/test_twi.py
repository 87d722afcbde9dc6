"""The TWI slave: status codes, two addresses, stretching, stuck lines, a master that dies."""

from __future__ import annotations

import pytest
from simavr_bench import Chip, cycles
from simavr_bench.log import LogKind, TwiNote, select
from simavr_bench.testing import MakeChip

PACKET = bytes(range(32))


def status(chip: Chip, code: int) -> int:
    return int(chip.read_array("status_seen", "u1")[code >> 3])


def test_slave_receives_a_packet_with_every_status(make_chip: MakeChip) -> None:
    chip = make_chip("twi_slave")
    number = chip.twi_send(42, PACKET, at_cycle=cycles(1e-3))
    chip.run_s(0.01)
    assert bytes(chip.read_array("bytes", "u1")[:32]) == PACKET
    assert (status(chip, 0x60), status(chip, 0x80), status(chip, 0xA0)) == (1, 32, 1)
    assert chip.twi_results() == {number: 32}
    assert chip.read("packets") == 1


def test_packet_takes_its_bits_and_the_stretch(make_chip: MakeChip) -> None:
    chip = make_chip("twi_slave")
    chip.twi_send(42, PACKET, at_cycle=cycles(1e-3))
    chip.run_s(0.01)
    done = select(chip.log(), LogKind.TWI, TwiNote.DONE)
    stretch = int(chip.twi_stretch_cycles()[0])
    # START, 33 times 9 bits, STOP at 100 kHz: 2.99 ms
    bits = 1 + 33 * 9 + 1
    assert int(done["cycle"][0]) - cycles(1e-3) - stretch == pytest.approx(bits * 160, abs=5)
    assert 33 * 20 < stretch < 33 * 120
    chip.poke(chip.symbols["dawdle"][0], bytes([200]))
    chip.twi_send(42, PACKET)
    chip.run_s(0.01)
    assert int(chip.twi_stretch_cycles()[1]) > stretch + 33 * 600


@pytest.mark.parametrize(
    ("address", "answers"),
    [(42, True), (27, True), (43, True), (10, True), (0x77, False), (0x1E, False)],
)
def test_address_mask_answers_two_addresses(
    make_chip: MakeChip, address: int, answers: bool
) -> None:
    chip = make_chip("twi_slave")
    number = chip.twi_send(address, b"abc", at_cycle=cycles(1e-3))
    chip.run_s(0.01)
    assert chip.twi_results() == {number: 3 if answers else 0}
    assert chip.read("packets") == int(answers)
    if answers:
        assert chip.read("last_sla") == address


def test_packets_queue_for_the_bus_in_order(make_chip: MakeChip) -> None:
    chip = make_chip("twi_slave")
    for k in range(5):
        chip.twi_send(42, bytes([k] * 4), at_cycle=cycles(1e-3))
    chip.run_s(0.01)
    assert chip.read("packets") == 5
    assert bytes(chip.read_array("bytes", "u1")[:4]) == bytes([4] * 4)


def test_refused_byte_ends_the_packet(make_chip: MakeChip) -> None:
    chip = make_chip("twi_slave")
    chip.poke(chip.symbols["limit"][0], bytes([5]))
    chip.run_s(1e-3)
    chip.poke(chip.symbols["limit"][0], bytes([5]))
    number = chip.twi_send(42, PACKET)
    chip.run_s(0.01)
    assert chip.twi_results() == {number: 5}
    assert status(chip, 0x88) == 1
    assert status(chip, 0xA0) == 0
    chip.poke(chip.symbols["limit"][0], bytes([255]))
    again = chip.twi_send(42, PACKET)
    chip.run_s(0.01)
    assert chip.twi_results()[again] == 32


def test_stuck_lines_silence_the_bus_and_nothing_else(make_chip: MakeChip) -> None:
    chip = make_chip("twi_slave")
    chip.watch("PA0")
    chip.run_s(1e-3)
    for sda, scl in ((True, False), (False, True)):
        chip.twi_hold(sda=sda, scl=scl)
        assert chip.level("PD1") is not sda
        assert chip.level("PD0") is not scl
        before = chip.read("packets")
        chip.twi_send(42, PACKET)
        edges = len(chip.edges("PA0")[0])
        chip.run_s(0.02)
        assert chip.read("packets") == before
        assert len(chip.edges("PA0")[0]) > edges + 1000
        chip.twi_hold(sda=False, scl=False)
        chip.run_s(0.01)
        assert chip.read("packets") == before + 1


@pytest.mark.parametrize("dies", [1, 2, 3], ids=["lets go", "holds SDA", "holds SCL"])
def test_master_that_dies_in_a_packet(make_chip: MakeChip, dies: int) -> None:
    chip = make_chip("twi_slave")
    chip.twi_send(42, PACKET, at_cycle=cycles(1e-3), dies=dies, dies_after=7)
    chip.run_s(0.01)
    assert chip.read("length") == 7
    assert chip.read("packets") == 0
    assert chip.read("bus_errors") == 0
    chip.twi_hold(sda=False, scl=False)
    chip.run_s(1e-3)
    # SDA let go while SCL is high is a STOP in the middle of a byte
    assert chip.read("bus_errors") == int(dies == 2)
    whole = chip.twi_send(27, PACKET)
    chip.run_s(0.01)
    # and so is the next START
    assert chip.read("bus_errors") == 1
    assert chip.twi_results()[whole] == 32
    assert chip.read("packets") == 1


def test_slave_that_resets_lets_the_bus_go(make_chip: MakeChip) -> None:
    chip = make_chip("twi_slave")
    chip.run_s(0.5e-3)
    chip.poke(chip.symbols["dawdle"][0], bytes([250]))
    chip.twi_send(42, PACKET, at_cycle=cycles(1e-3))
    chip.twi_send(27, PACKET, at_cycle=cycles(8e-3))
    while chip.data(0xBC, 1)[0] & 0x80 == 0:  # until TWINT holds the clock
        chip.run_until(chip.cycle + 10)
    chip.hold_reset()
    chip.run_s(0.006)
    assert 1 in chip.twi_results()  # the master found nobody and went on
    chip.release_reset()
    chip.run_s(0.015)
    assert list(chip.twi_results().values())[1] == 32
    assert chip.read("packets") == 1
