"""Data compatibility: flight-path reconstruction and corrections of the sensors.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.reconstruction.inverse_sensor_model import Record, Spectrum, apply_sensor_errors
    from host.sysid.reconstruction.path_preparation import density_share, prior
    from host.sysid.reconstruction.reconstruction import (
        Compatibility,
        NoAgreementError,
        SensorErrorEstimate,
        reconstruct,
    )
    from host.sysid.reconstruction.sensor_corrections import INSTANTANEOUS_ERRORS
    from host.sysid.reconstruction.sensor_dynamics import SERVO_DELAY
    from host.sysid.reconstruction.servo_response import behind_servos

__all__ = [
    "INSTANTANEOUS_ERRORS",
    "SERVO_DELAY",
    "Compatibility",
    "NoAgreementError",
    "Record",
    "SensorErrorEstimate",
    "Spectrum",
    "apply_sensor_errors",
    "behind_servos",
    "density_share",
    "prior",
    "reconstruct",
]

__getattr__ = lazily(
    __name__,
    {
        "Compatibility": "reconstruction",
        "INSTANTANEOUS_ERRORS": "sensor_corrections",
        "NoAgreementError": "reconstruction",
        "Record": "inverse_sensor_model",
        "SERVO_DELAY": "sensor_dynamics",
        "SensorErrorEstimate": "reconstruction",
        "Spectrum": "inverse_sensor_model",
        "apply_sensor_errors": "inverse_sensor_model",
        "behind_servos": "servo_response",
        "density_share": "path_preparation",
        "prior": "path_preparation",
        "reconstruct": "reconstruction",
    },
)
