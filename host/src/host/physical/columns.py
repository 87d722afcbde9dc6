"""Every column of the synchronous table: name, unit, meaning."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Column:
    """Name, unit and meaning of a column."""

    name: str
    unit: str
    text: str


_C = Column
COLUMNS: tuple[Column, ...] = (
    _C("t_s", "s", "time since the first identification frame, by GPS where it is known"),
    _C("airspeed_mps", "m/s", "true airspeed from impact pressure, static pressure, temperature"),
    _C("alpha_rad", "rad", "angle of attack, mean of the vanes that are valid"),
    _C("beta_rad", "rad", "sideslip, mean of the vanes that are valid"),
    _C("p_radps", "rad/s", "roll rate, right wing down positive"),
    _C("q_radps", "rad/s", "pitch rate, nose up positive"),
    _C("r_radps", "rad/s", "yaw rate, nose right positive"),
    _C("ax_mps2", "m/s2", "specific force, forward"),
    _C("ay_mps2", "m/s2", "specific force, right"),
    _C("az_mps2", "m/s2", "specific force, down; level at rest -9.81"),
    _C("phi_rad", "rad", "roll angle, unwrapped"),
    _C("theta_rad", "rad", "pitch angle"),
    _C("psi_rad", "rad", "heading, unwrapped"),
    _C("elevator_rad", "rad", "trailing edge down positive; measured or commanded: see inputs"),
    _C("aileron_rad", "rad", "(left - right)/2, each trailing edge down positive"),
    _C("rudder_rad", "rad", "trailing edge left positive"),
    _C("throttle", "", "0 idle, 1 full, commanded"),
    _C("qbar_pa", "Pa", "dynamic pressure rho V^2/2, sign of the speed"),
    _C("alpha_a_rad", "rad", "left vane"),
    _C("alpha_b_rad", "rad", "right vane"),
    _C("beta_a_rad", "rad", "left vane"),
    _C("beta_b_rad", "rad", "right vane"),
    _C("differential_a_pa", "Pa", "left pitot"),
    _C("differential_b_pa", "Pa", "right pitot"),
    _C("cas_mps", "m/s", "calibrated airspeed"),
    _C("static_pa", "Pa", "static pressure"),
    _C("temperature_k", "K", "temperature at the static pressure sensor"),
    _C("density_kgpm3", "kg/m3", "air density from static pressure and temperature"),
    _C("altitude_m", "m", "pressure altitude above 101325 Pa"),
    _C("elevator_pot_rad", "rad", "measured position"),
    _C("aileron_left_rad", "rad", "measured position, trailing edge down positive"),
    _C("aileron_right_rad", "rad", "measured position, trailing edge down positive"),
    _C("rudder_pot_rad", "rad", "measured position"),
    _C("servo_aileron_us", "us", "pulse the Mega sends"),
    _C("servo_elevator_us", "us", "pulse the Mega sends"),
    _C("servo_rudder_us", "us", "pulse the Mega sends"),
    _C("servo_throttle_us", "us", "pulse the Mega sends"),
    _C("rc_aileron_us", "us", "last accepted receiver pulse"),
    _C("rc_elevator_us", "us", "last accepted receiver pulse"),
    _C("rc_rudder_us", "us", "last accepted receiver pulse"),
    _C("rc_throttle_us", "us", "last accepted receiver pulse"),
    _C("rc_switch_us", "us", "last accepted receiver pulse of the direct/Mega switch"),
    _C("latitude_deg", "deg", "GPS"),
    _C("longitude_deg", "deg", "GPS"),
    _C("gps_height_m", "m", "GPS, above mean sea level"),
    _C("v_north_mps", "m/s", "GPS"),
    _C("v_east_mps", "m/s", "GPS"),
    _C("v_down_mps", "m/s", "GPS"),
    _C("ground_speed_mps", "m/s", "GPS"),
    _C("session", "", "recording session"),
    _C("mega_drives", "", "1 while the servos get the Mega's pulses, 0 while the receiver's"),
)
UNITS = {column.name: column.unit for column in COLUMNS}

# Columns of a channel of the identification frame: field -> (column, line of the calibration, axis)
ANALOGUE = {
    "alpha_a": ("alpha_a_rad", "channel.alpha_a"),
    "alpha_b": ("alpha_b_rad", "channel.alpha_b"),
    "beta_a": ("beta_a_rad", "channel.beta_a"),
    "beta_b": ("beta_b_rad", "channel.beta_b"),
    "dp_a": ("differential_a_pa", "channel.dp_a"),
    "dp_b": ("differential_b_pa", "channel.dp_b"),
    "pot_elevator": ("elevator_pot_rad", "channel.pot_elevator"),
    "pot_aileron_left": ("aileron_left_rad", "channel.pot_aileron_left"),
    "pot_aileron_right": ("aileron_right_rad", "channel.pot_aileron_right"),
    "pot_rudder": ("rudder_pot_rad", "channel.pot_rudder"),
}
INERTIAL = {
    "p": ("p_radps", "gyro", 0),
    "q": ("q_radps", "gyro", 1),
    "r": ("r_radps", "gyro", 2),
    "ax": ("ax_mps2", "accel", 0),
    "ay": ("ay_mps2", "accel", 1),
    "az": ("az_mps2", "accel", 2),
}
ATTITUDE = {"phi": "phi_rad", "theta": "theta_rad", "psi": "psi_rad"}
PULSES = {
    name: f"{name}_us"
    for name in (
        "servo_aileron",
        "servo_elevator",
        "servo_rudder",
        "servo_throttle",
        "rc_aileron",
        "rc_elevator",
        "rc_rudder",
        "rc_throttle",
        "rc_switch",
    )
}
# Measured columns of the identification frame, nothing derived.
CHANNELS = (
    "t_s",
    *(column for column, _ in ANALOGUE.values()),
    *(column for column, _, _ in INERTIAL.values()),
    *ATTITUDE.values(),
    *PULSES.values(),
)
# Derived columns -> lines of the calibration that they depend on.
RESTS_ON = {
    "alpha_rad": ("channel.alpha_a", "channel.alpha_b"),
    "beta_rad": ("channel.beta_a", "channel.beta_b"),
    "airspeed_mps": ("channel.dp_a", "channel.dp_b"),
    "qbar_pa": ("channel.dp_a", "channel.dp_b"),
    "cas_mps": ("channel.dp_a", "channel.dp_b"),
}
