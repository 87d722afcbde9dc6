"""Core: reset, memory, interrupt entry, determinism. Values from the ATmega2560 datasheet."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from simavr_bench import Chip, ForkError, ResetCause, cycles, in_fork
from simavr_bench.log import LogKind, select
from simavr_bench.testing import MakeChip

PCINT0, INT0, INT1, INT2 = 9, 1, 2, 3


def test_interrupt_entry_costs_five_cycles_and_nine_from_sleep(make_chip: MakeChip) -> None:
    chip = make_chip("interrupt_cost")
    chip.drive("PA0", True)
    chip.drive("PD2", False)
    chip.run_s(1e-3)
    assert chip.state == "sleeping"
    chip.clear_statistics()
    for k in range(20):
        chip.drive("PD2", True, at_cycle=chip.cycle + 1000 + 500 * k)
        chip.drive("PD2", False, at_cycle=chip.cycle + 1200 + 500 * k)
    chip.run_s(1e-3)
    asleep = chip.interrupt(INT2)
    assert (asleep.count, asleep.latency_p50, asleep.latency_max) == (20, 9, 9)

    chip.drive("PA0", False)
    chip.drive("PD2", True)  # wakes it into the busy loop
    chip.run_s(1e-3)
    chip.drive("PD2", False)
    chip.clear_statistics()
    for k in range(100):
        chip.drive("PD2", True, at_cycle=chip.cycle + 1000 + 501 * k)
        chip.drive("PD2", False, at_cycle=chip.cycle + 1200 + 501 * k)
    chip.run_s(5e-3)
    awake = chip.interrupt(INT2)
    # 5 to enter, and what is left of the instruction under way (none here is longer than 3 cycles)
    assert awake.count == 100
    assert 5 <= awake.latency_p50 <= awake.latency_max <= 8


def test_lowest_vector_is_served_first(make_chip: MakeChip) -> None:
    chip = make_chip("interrupt_cost")
    chip.run_s(1e-3)
    # one instruction of the main program between two services, so all three still are served
    assert list(chip.read_array("order", "u1")[:3]) == [INT0, INT1, PCINT0]


def test_instruction_after_sei_comes_before_any_interrupt(make_chip: MakeChip) -> None:
    chip = make_chip("interrupt_cost")
    chip.run_s(1e-3)
    assert chip.read_array("result", "<u2")[1] == 0
    assert chip.interrupt(INT0).count == 1


def test_latency_grows_with_what_stands_before(make_chip: MakeChip) -> None:
    chip = make_chip("interrupt_cost")
    chip.run_s(1e-3)
    first, last = chip.interrupt(INT0), chip.interrupt(PCINT0)
    assert last.latency_max > first.latency_max + first.length_max


def test_power_on_leaves_sram_undefined_and_repeatable(make_chip: MakeChip) -> None:
    chip = make_chip("reset")
    other = make_chip("reset")
    third = make_chip("reset", seed=2)
    assert chip.data(0x1000, 64) == other.data(0x1000, 64) != third.data(0x1000, 64)
    assert len(set(chip.data(0x1000, 64))) > 20


@pytest.mark.parametrize(
    "cause", [ResetCause.EXTERNAL, ResetCause.BROWN_OUT, ResetCause.WATCHDOG], ids=lambda c: c.name
)
def test_reset_keeps_noinit_and_tells_its_cause(make_chip: MakeChip, cause: ResetCause) -> None:
    chip = make_chip("reset")
    chip.drive("PK0", True)
    chip.run_s(1e-3)
    assert chip.read("cause") == ResetCause.POWER_ON
    kept = chip.read("kept")
    chip.reset(cause)
    chip.run_s(1e-3)
    assert chip.read("cause") == cause
    assert chip.read("kept") == (kept + 1) & 0xFFFF
    assert chip.read("fresh") == 1


def test_power_cut_loses_noinit(make_chip: MakeChip) -> None:
    chip = make_chip("reset")
    chip.run_s(1e-3)
    kept = chip.read("kept")
    chip.power_off()
    chip.run_s(0.01)
    chip.power_on()
    chip.run_s(1e-3)
    assert chip.read("cause") == ResetCause.POWER_ON
    assert chip.read("kept") != (kept + 1) & 0xFFFF


def test_watchdog_resets_after_its_time(make_chip: MakeChip) -> None:
    chip = make_chip("reset", startup_s=0.01)
    chip.drive("PK0", False)
    chip.run_s(1.2)
    resets = select(chip.log(), LogKind.RESET)
    assert list(resets["value"][:2]) == [ResetCause.POWER_ON, ResetCause.WATCHDOG]
    started = select(chip.log(), LogKind.OUT_OF_RESET)["cycle"]
    # 32768 periods of 128 kHz are 256 ms
    assert int(resets["cycle"][1]) - int(started[0]) == pytest.approx(cycles(0.256), abs=1000)
    assert chip.read("cause") == ResetCause.WATCHDOG


def test_reset_shows_output_edges_and_keeps_inputs(make_chip: MakeChip) -> None:
    chip = make_chip("reset")
    chip.watch("PA5")
    chip.pull("PA5", False)
    chip.drive("PK0", True)
    chip.drive("PK3", True)
    chip.run_s(1e-3)
    chip.reset()
    at = chip.cycle
    chip.run_s(1e-3)
    when, level = chip.edges("PA5")
    assert list(level) == [1, 0, 1]
    assert when[1] == at
    assert chip.read_array("result", "<u2")[0] == 0b1001


def test_reset_from_a_listener_waits_for_the_instruction(make_chip: MakeChip) -> None:
    chip = make_chip("reset")
    times: list[int] = []

    def pull_the_plug(level: bool, cycle: int) -> None:
        if level and len(times) < 3:
            times.append(cycle)
            chip.reset(ResetCause.BROWN_OUT)

    chip.on_pin("PA5", pull_the_plug)
    chip.run_s(0.01)
    assert len(times) == 3
    assert len(set(np.diff(times))) == 1
    assert chip.read("finished") == 1
    assert chip.read("cause") == ResetCause.BROWN_OUT


def test_held_reset_and_startup_delay_take_time(make_chip: MakeChip) -> None:
    chip = make_chip("reset", startup_s=0.065)
    chip.watch("PA5")
    chip.run_s(0.1)
    assert int(chip.edges("PA5")[0][0]) == pytest.approx(cycles(0.065), abs=1000)
    chip.hold_reset(ResetCause.BROWN_OUT)
    chip.run_s(0.1)
    assert chip.state == "reset"
    assert not chip.level("PA5")
    chip.release_reset(ResetCause.BROWN_OUT)
    chip.run_s(0.1)
    assert chip.level("PA5")


def test_two_chips_in_one_process_do_not_touch_each_other(make_chip: MakeChip) -> None:
    one, two = make_chip("reset"), make_chip("reset")
    one.drive("PK0", True)
    two.drive("PK0", True)
    two.drive("PK5", True)
    for _ in range(10):
        one.run_s(1e-4)
        two.run_s(2e-4)
    assert one.read_array("result", "<u2")[0] == 1
    assert two.read_array("result", "<u2")[0] == 0x21
    assert one.cycle * 2 == two.cycle


def test_load_counts_running_and_sleeping(make_chip: MakeChip) -> None:
    chip = make_chip("interrupt_cost")
    chip.drive("PA0", True)
    chip.run_s(1e-3)
    chip.clear_statistics()
    chip.run_s(0.1)
    assert chip.load_now().busy_fraction == 0.0
    chip.drive("PD2", True)
    chip.drive("PA0", False)
    chip.run_s(0.1)
    assert chip.load_now().busy_fraction == pytest.approx(0.5, abs=0.001)


def test_callbacks_come_at_their_cycle_and_their_errors_come_out(make_chip: MakeChip) -> None:
    chip = make_chip("reset")
    seen: list[int] = []
    for at in (5000, 1000, 3000):
        chip.at(at, lambda: seen.append(chip.cycle))
    chip.run_until(4000)
    assert seen == [1000, 3000]
    order: list[int] = []
    for k in range(20):
        chip.at(4200, partial(order.append, k))
    chip.run_until(4300)
    assert order == list(range(20))

    def broken() -> None:
        raise ValueError("from the script")

    chip.at(4500, broken)
    with pytest.raises(ValueError, match="from the script"):
        chip.run_until(10_000)
    assert chip.cycle < 4600
    chip.run_until(10_000)
    assert seen == [1000, 3000, 5000]


def test_two_runs_are_the_same(make_chip: MakeChip) -> None:
    def run() -> bytes:
        chip = make_chip("interrupt_cost")
        chip.watch("PD0", "PD1", "PB0", "PD2")
        chip.log_interrupts()
        rng = np.random.default_rng(7)
        for at in np.sort(rng.integers(1000, 800_000, 500)):
            chip.drive("PD2", bool(rng.integers(2)), at_cycle=int(at))
        chip.run_s(0.1)
        return chip.log().tobytes()

    first = run()
    assert len(first) > 5000
    assert run() == first


def test_stack_use_is_seen(make_chip: MakeChip) -> None:
    chip = make_chip("interrupt_cost", power=False)
    chip.power_on()
    low = chip.symbols["_end"][0] & 0xFFFF
    before = chip.data(low, 0x2200 - low)
    chip.run_s(1e-3)
    free = chip.untouched_stack(low, before)
    # main's return address, one interrupt frame: tens of bytes, not hundreds
    assert 0 < len(before) - free < 64
    assert chip.lowest_sp >= low + free - 1


def test_stack_that_runs_into_the_registers_does_not_end_the_simulation(build: object) -> None:
    with Chip(startup_s=0.0) as chip:
        from simavr_bench import Image

        # rcall .+0 for ever: pushes three bytes each time, through SRAM and I/O down to 0
        chip.load(Image({0: bytes.fromhex("ffdf")}))
        chip.power_on()
        chip.run_s(0.01)
        assert chip.faults()
        assert chip.state == "running"


def test_marks_and_watched_functions_are_stamped(make_chip: MakeChip) -> None:
    chip = make_chip("marks")
    chip.log_marks()
    number = chip.watch_pc("tick")
    chip.run_s(0.01)
    marks, calls = chip.records(LogKind.MARK, 1), chip.records(LogKind.PC, number)
    assert list(marks["value"][:4]) == [1, 2, 3, 4]
    assert abs(len(calls) - len(marks)) <= 1
    assert set(np.diff(calls["cycle"])) == set(np.diff(marks["cycle"]))
    assert calls["cycle"][0] < marks["cycle"][0] < calls["cycle"][0] + 10


def test_every_cycle_is_counted_where_its_instruction_stands(make_chip: MakeChip) -> None:
    chip = make_chip("loops")
    chip.run_s(0.005)
    chip.count_cycles()
    before = chip.load_now().running
    chip.run_s(0.005)
    spent = chip.cycles_spent()
    # Entering interrupts counts where their vectors stand.
    assert int(spent.sum()) == chip.load_now().running - before
    first = chip.symbols["main"][0] // 2
    assert spent[first:].sum() > 0.9 * spent.sum()  # its work stands in main
    assert np.count_nonzero(spent[:first]) > 0


def test_fork_tries_an_ending_and_forgets_it(make_chip: MakeChip) -> None:
    chip = make_chip("marks")
    chip.run_s(0.001)

    def ending() -> int:
        chip.run_s(0.002)
        return chip.read("calls")

    first = in_fork(ending)
    assert in_fork(ending) == first > chip.read("calls")
    chip.run_s(0.002)
    assert chip.read("calls") == first

    def broken() -> None:
        raise ValueError("in the child")

    with pytest.raises(ForkError, match="in the child"):
        in_fork(broken)
