"""An IMU that is mounted with a tilt turns the attitude that it says, as it turns its rates."""

import numpy as np
import pytest
from host.sysid.reconstruction.sensor_corrections import correct_columns
from scipy.spatial.transform import Rotation


@pytest.mark.parametrize("axis", range(3))
def test_attitude_of_a_tilted_imu_is_that_of_the_aircraft(axis: int) -> None:
    rng = np.random.default_rng(1)
    psi, theta, phi = rng.uniform(-0.7, 0.7, (3, 50))
    tilt = 0.01 * np.eye(3)[axis]
    aircraft = Rotation.from_euler("ZYX", np.stack([psi, theta, phi], axis=1))
    yaw, pitch, roll = (aircraft * Rotation.from_rotvec(tilt)).as_euler("ZYX").T
    columns = {"phi_rad": roll, "theta_rad": pitch, "psi_rad": yaw}
    found = correct_columns(columns, {f"imu_tilt_{'xyz'[axis]}_rad": 0.01})
    # To first order: the square of a tilt is left.
    assert found["phi_rad"] == pytest.approx(phi, abs=3e-4)
    assert found["theta_rad"] == pytest.approx(theta, abs=3e-4)
    assert np.max(np.abs(roll - phi) + np.abs(pitch - theta)) > 5e-3
