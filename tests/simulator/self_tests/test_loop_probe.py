"""The probe of the main loop sees turns of known lengths."""

from __future__ import annotations

import pytest
from simavr_bench.loop_probe import LoopProbe
from simavr_bench.testing import MakeChip


def test_turns_of_known_length(make_chip: MakeChip) -> None:
    chip = make_chip("loops", power=False)
    probe = LoopProbe(chip)
    chip.power_on()
    chip.run_s(1.0)
    seen = probe.times()
    assert seen.turns == pytest.approx(1000, abs=2)
    assert seen.period_p50_us == pytest.approx(1000, abs=2)
    assert seen.period_max_us == pytest.approx(1000, abs=3)
    assert seen.work_p50_us == pytest.approx(100, abs=4)
    assert seen.work_p99_us == pytest.approx(300, abs=4)
    assert seen.work_max_us == pytest.approx(300, abs=4)
    probe.clear()
    chip.run_s(0.1)
    assert probe.times().turns == pytest.approx(100, abs=2)
