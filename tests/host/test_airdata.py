"""Air data against published vectors and an independent solution."""

import numpy as np
import pytest
from host.physical import airdata
from host.physical.calibration import load_calibration


@pytest.mark.parametrize(
    ("counts", "speed_mps"), [(12.5436, 10.0), (28.2232, 15.0), (50.1744, 20.0)]
)
def test_counts_of_the_pitot_to_speed(counts: float, speed_mps: float) -> None:
    # Vectors of the MPXV7002DP chain: v = sqrt(2 q / 1.225), hardware reference 2.2.
    line = load_calibration().lines["channel.dp_a"]
    impact = np.array([(line.zero[0] + counts - line.zero[0]) * line.slope[0]])
    assert np.sqrt(2 * impact / 1.225) == pytest.approx(speed_mps, rel=1e-4)
    # Compressibility lowers it by M^2/8: 0.04 % at 20 m/s.
    mach = speed_mps / airdata.STANDARD_SOUND_MPS
    expected = speed_mps * (1 - mach**2 / 8)
    assert airdata.calibrated_airspeed_mps(impact) == pytest.approx(expected, rel=2e-5)


def test_speed_solves_the_compressible_equation() -> None:
    speed = np.linspace(-55.0, 55.0, 111)
    static, temperature = np.full(111, 90_000.0), np.full(111, 308.15)
    mach = speed / np.sqrt(1.4 * airdata.GAS_CONSTANT_JPKGK * temperature)
    impact = np.sign(speed) * static * ((1 + 0.2 * mach**2) ** 3.5 - 1)
    found = airdata.true_airspeed_mps(impact, static, temperature)
    np.testing.assert_allclose(found, speed, rtol=1e-7, atol=1e-9)
    density = airdata.density_kgpm3(static, temperature)
    qbar = airdata.dynamic_pressure_pa(found, density)
    np.testing.assert_allclose(qbar, 0.5 * density * speed * np.abs(speed), rtol=2e-7, atol=1e-9)


@pytest.mark.parametrize(
    ("static_pa", "altitude_m"), [(101325.0, 0.0), (69964.0, 3016.7), (89874.6, 1000.0)]
)
def test_pressure_altitude(static_pa: float, altitude_m: float) -> None:
    # 69964 Pa: the datasheet's example by its own 44330 (1 - (p/p0)^(1/5.255)), which is 0.5 m off
    # there; 1000 m: ICAO table.
    found = airdata.pressure_altitude_m(np.array([static_pa]))
    assert found == pytest.approx(altitude_m, abs=0.6 if altitude_m > 3000 else 0.02)


def test_density_of_a_hot_day() -> None:
    # 35 C, 990 hPa: 4.6 % more true airspeed than at sea-level density (hardware reference 1.2).
    rho = airdata.density_kgpm3(np.array([99_000.0]), np.array([308.15]))
    assert np.sqrt(1.225 / rho) == pytest.approx(1.046, abs=0.001)
