"""All devices at once: everything arrives, and two runs are the same to the cycle."""

from __future__ import annotations

import hashlib
from types import ModuleType

import numpy as np
from simavr_bench import cycles
from speed import everything


def test_every_device_is_heard_and_two_runs_are_equal(build: ModuleType) -> None:
    program = build.build_program("everything")
    digests = []
    for _ in range(2):
        with everything(program) as chip:
            chip.run_s(2.0)
            assert chip.read("edges") >= 2.0 * 50 * 10 - 2
            assert chip.read("packets") in (399, 400)
            assert chip.read("ticks") in (1999, 2000)
            assert chip.read("scans") > 1000
            assert chip.uart_lost(2) == 0
            assert chip.read("gps_bytes") > 1000
            assert chip.read("next_block") > 30
            assert len(chip.uart_sent(3)) > 10_000
            assert [fault for fault in chip.faults() if fault[1] != 6] == []
            digests.append(hashlib.sha256(chip.log().tobytes()).hexdigest())
    assert digests[0] == digests[1]


def test_slices_do_not_change_the_run(build: ModuleType) -> None:
    program = build.build_program("everything")
    logs = []
    rng = np.random.default_rng(11)
    for sliced in (False, True):
        with everything(program) as chip:
            end = cycles(0.5)
            while sliced and chip.cycle < end - 10_000:
                chip.run_until(chip.cycle + int(rng.integers(1, 9_000)))
            chip.run_until(end)
            log = chip.log()
            logs.append(log)
    # where a run is cut moves an asynchronous event by the rest of an instruction at most
    whole, cut = logs
    assert np.array_equal(whole[["kind", "source"]], cut[["kind", "source"]])
    assert np.abs(whole["cycle"].astype(np.int64) - cut["cycle"].astype(np.int64)).max() <= 8
