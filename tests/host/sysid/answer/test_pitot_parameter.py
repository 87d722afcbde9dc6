"""The parameter of an autopilot's pitot: ratio by the square, scale by itself."""

from math import sqrt

import pytest
from host.physical.recording import AUTOPILOT, FOREIGN
from host.sysid.answer.pitot_parameter import pitot_lines
from host.sysid.flight import ReconstructedFlight
from host.sysid.reconstruction import Compatibility, SensorErrorEstimate


def flown(source: str, maker: str = AUTOPILOT) -> ReconstructedFlight:
    return ReconstructedFlight(source, {}, {}, (), None, False, maker=maker)


def agreement(share: float, *, told: bool = True) -> Compatibility:
    # So wide a prior that nearly all of it is the pitot's, and not density's.
    pitot = SensorErrorEstimate("pitot_scale", share, 0.01, 2.0, told, "")
    return Compatibility((pitot,), {}, (), gps=True)


def numbers(line: str, behind: str) -> list[float]:
    words = line.partition(behind)[2].split()
    return [float(words[k].strip(",;")) for k in (0, 2)]


@pytest.mark.parametrize(("name", "power"), [("a.bin", 2), ("a.bin#2", 2), ("a.ulg", 1)])
def test_a_pitot_that_reads_high_gets_a_smaller_parameter_with_its_interval(
    name: str, power: int
) -> None:
    (line,) = pitot_lines([flown(name)], [agreement(0.44)])
    k = 1.0 / sqrt(1.44)  # pressure 44 % high: airspeed 20 % high
    assert ("ARSPD_RATIO" in line) == (power == 2) and ("ASPD_SCALE_n" in line) == (power == 1)
    value, half = numbers(line, "value times ")
    assert value == pytest.approx(k**power, abs=0.002)
    own = numbers(line, "airspeed is ")
    assert own[0] == pytest.approx(k, abs=0.002)
    # d(k^2) = 2 k dk; half-widths are printed to two digits
    assert half == pytest.approx(own[1] * (2.0 * k if power == 2 else 1.0), rel=0.06)
    assert own[1] > 0.5 * 0.01 * k**3  # density is in it


def test_a_tlog_names_both_and_what_is_not_told_is_not_said() -> None:
    both = "\n".join(pitot_lines([flown("a.tlog")], [agreement(-0.2)]))
    assert "ARSPD_RATIO" in both and "ASPD_SCALE_n" in both
    for flight, found in (
        (flown("a.bin"), agreement(0.2, told=False)),
        (flown("a.bin"), agreement(0.005)),  # within its interval
        (flown("a.csv", FOREIGN), agreement(0.2)),
        (flown("a.bin"), None),
    ):
        assert pitot_lines([flight], [found]) == []
