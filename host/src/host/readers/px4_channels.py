"""PX4: its topics in our names, units and signs.

Its axes are ours (x forward, y right, z down), its accelerations specific force. Time is that of
the sample where a topic has one, else of its publication.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.arrays import Array, BoolArray
from host.physical.airdata import KELVIN, density_kgpm3
from host.readers.ardupilot_outputs import Outputs
from host.readers.autopilot_log import AutopilotLog, Messages
from host.readers.named_channels import (
    STANDARD_DENSITY_KGPM3,
    STANDARD_TEMPERATURE_DEGC,
    Channels,
    instance_of,
    numbers,
)
from host.readers.px4_outputs import (
    MOST_SURFACES,
    allocated_surfaces,
    axis_demands,
    surfaces_of_pulses,
)
from host.readers.px4_tailsitter import NOTE, forward_attitude, forward_flight, tailsitter
from host.readers.signals import Signal
from host.readers.written_parameters import made_of_outputs

FIXED_WING = 2  # vehicle_status.VEHICLE_TYPE_FIXED_WING
MOST_PINS = 16
RAW_AIRSPEED = "airspeed"  # before the scale that the autopilot knows
PITOTS = 3  # airspeed_validated.airspeed_source: 1 to 3 are sensors, 4 is computed, 0 and -1 none
USABLE_HZ = 18.0  # a topic that comes slower is used only if no other has the channel
RATES = ("p_radps", "q_radps", "r_radps")
FORCES = ("ax_mps2", "ay_mps2", "az_mps2")
# Topic, field and the parameter of its low-pass; raw before filtered.
RATE_TOPICS = (
    ("sensor_combined", "gyro_rad", ""),
    ("vehicle_angular_velocity", "xyz", "IMU_GYRO_CUTOFF"),
)
FORCE_TOPICS = (
    ("sensor_combined", "accelerometer_m_s2", ""),
    ("vehicle_acceleration", "xyz", "IMU_ACCEL_CUTOFF"),
)


def px4_channels(log: AutopilotLog, chosen: Mapping[str, int]) -> Channels:
    """Return the channels of a ULog; `chosen` names instances by topic."""
    found = Channels()
    if by := tailsitter(log):
        found.notes.append(NOTE.format(by))
    for name in chosen:
        instance_of(log, name, chosen, [])
    _inertial(log, chosen, found)
    _attitude(log, chosen, found)
    _air(log, chosen, found)
    _path(log, chosen, found)
    _outputs(log, chosen, found)
    status = instance_of(log, "vehicle_imu_status", chosen, [])
    if status is not None:
        fields = status[0].fields
        shaken = fields.get("accel_vibration_metric")
        if shaken is not None:
            found.vibration_mps2 = float(np.median(shaken))
        clips = [
            fields[f"accel_clipping[{k}]"] for k in range(3) if f"accel_clipping[{k}]" in fields
        ]
        many = sum(int(c[-1]) - int(c[0]) for c in clips if len(c))
        if many > 0:
            found.clipped["IMU"] = many
    return found


def not_flying_signals(log: AutopilotLog) -> list[Signal]:
    """Return where the autopilot says that it stands on the ground or, of a VTOL, on its rotors."""
    found = []
    messages = log.first("vehicle_land_detected")
    if messages is not None and "landed" in messages.fields:
        landed = numbers(messages.fields["landed"])
        found.append(Signal(messages.t_s, landed, "vehicle_land_detected.landed"))
    status = log.first("vehicle_status")
    if log.vehicle == "vtol" and status is not None and "vehicle_type" in status.fields:
        hovers = np.asarray(status.fields["vehicle_type"]) != FIXED_WING
        found.append(Signal(status.t_s, numbers(hovers), "vehicle_status.vehicle_type"))
    return found


def _vector(messages: Messages, field: str, size: int = 3) -> list[Array] | None:
    names = [f"{field}[{k}]" for k in range(size)]
    if not all(name in messages.fields for name in names):
        return None
    return [numbers(messages.fields[name]) for name in names]


def _body_vector(log: AutopilotLog, messages: Messages, field: str) -> list[Array] | None:
    """Return a vector in axes with x forward in flight."""
    values = _vector(messages, field)
    return forward_flight(values) if values is not None and tailsitter(log) else values


def _inertial(log: AutopilotLog, chosen: Mapping[str, int], found: Channels) -> None:
    _first_fast(log, chosen, found, RATES, RATE_TOPICS)
    _first_fast(log, chosen, found, FORCES, FORCE_TOPICS)


def _first_fast(
    log: AutopilotLog,
    chosen: Mapping[str, int],
    found: Channels,
    names: tuple[str, ...],
    topics: tuple[tuple[str, str, str], ...],
) -> None:
    """Add three channels from the first topic that has them often enough, else the fastest."""
    able = []
    for topic, field, cutoff in topics:
        one = instance_of(log, topic, chosen, found.notes)
        values = _body_vector(log, one[0], field) if one is not None else None
        if one is not None and values is not None and len(one[0]) > 1:
            able.append((_rate_hz(one[0]), *one, field, values, cutoff))
    if not able:
        return
    fast = [it for it in able if it[0] >= USABLE_HZ] or [max(able, key=lambda it: it[0])]
    _, messages, label, field, values, cutoff = fast[0]
    cutoff_hz = log.parameters.get(cutoff, 0.0)
    late_s = float(np.sqrt(2.0) / (2.0 * np.pi * cutoff_hz)) if cutoff_hz > 0.0 else 0.0
    for name, axis in zip(names, values, strict=True):
        found.add(name, messages.t_s, axis, f"{label}.{field}", late_s)


def _attitude(log: AutopilotLog, chosen: Mapping[str, int], found: Channels) -> None:
    att = instance_of(log, "vehicle_attitude", chosen, found.notes)
    q = _vector(att[0], "q", 4) if att is not None else None
    if att is None or q is None:
        return
    size = np.sqrt(sum(x * x for x in q))
    q = forward_attitude(q) if tailsitter(log) else q
    whole = np.abs(size - 1.0) < 0.05  # another length is a changed bit
    w, x, y, z = (np.where(whole, part, np.nan) for part in q)
    angles = {
        "phi_rad": np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        "theta_rad": np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0)),
        "psi_rad": np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    }
    for name, values in angles.items():
        found.add(name, att[0].t_s, values, f"{att[1]}.q")


def _air(log: AutopilotLog, chosen: Mapping[str, int], found: Channels) -> None:
    air = instance_of(log, "vehicle_air_data", chosen, found.notes)
    if air is not None:
        messages, label = air
        for ours, theirs in (
            ("static_pa", "baro_pressure_pa"), ("density_kgpm3", "rho"),
            ("altitude_m", "baro_alt_meter"),
        ):  # fmt: skip
            if theirs in messages.fields:
                values = numbers(messages.fields[theirs])
                found.add(ours, messages.t_s, values, f"{label}.{theirs}")
        if "density_kgpm3" not in found.signals and "static_pa" in found.signals:
            usual = np.full(len(messages), STANDARD_TEMPERATURE_DEGC)
            warm = messages.fields.get("baro_temp_celcius", usual)
            rho = density_kgpm3(
                numbers(messages.fields["baro_pressure_pa"]),
                numbers(warm) + KELVIN,
            )
            found.add("density_kgpm3", messages.t_s, rho, f"{label}.baro_pressure_pa")
    if log.parameters.get("SYS_HAS_NUM_ASPD", 1.0) == 0.0:
        return
    best: tuple[float, Messages, str] | None = None
    for topic in ("airspeed_validated", RAW_AIRSPEED):
        pitot = instance_of(log, topic, chosen, found.notes)
        if pitot is None or "true_airspeed_m_s" not in pitot[0].fields or len(pitot[0]) < 2:
            continue
        rate_hz = 1.0 / float(np.median(np.diff(pitot[0].t_s)))
        if best is None or rate_hz > 1.5 * best[0]:
            best = (rate_hz, *pitot)
    if best is None:
        return
    _, messages, label = best
    number = _sensor_number(log)
    scale = 1.0
    if label.startswith(RAW_AIRSPEED + "["):
        messages, label, scale = _raw_airspeed(log, chosen, messages, label, number)
    true = scale * numbers(messages.fields["true_airspeed_m_s"])
    measured = messages.fields.get("airspeed_sensor_measurement_valid")
    if measured is not None:
        true = np.where(np.asarray(measured) > 0, true, np.nan)
    if number is not None:
        row = np.searchsorted(number.t_s, messages.t_s, side="right") - 1
        true = np.where(_is_sensor(number.values)[np.maximum(row, 0)], true, np.nan)
        found.notes += _computed_airspeed(number)
    found.add("airspeed_mps", messages.t_s, true, f"{label}.true_airspeed_m_s")
    name = "calibrated_airspeed_m_s"
    name = name if name in messages.fields else "indicated_airspeed_m_s"
    if name in messages.fields and np.isfinite(true).any():
        speed = scale * numbers(messages.fields[name])
        pressure = 0.5 * STANDARD_DENSITY_KGPM3 * np.where(np.isfinite(true), speed, np.nan) ** 2
        found.add("qbar_pa", messages.t_s, pressure, f"{label}.{name}")


def _sensor_number(log: AutopilotLog) -> Signal | None:
    """Return which pitot the autopilot uses, from 1, over time; others are computed, or none."""
    said = log.first("airspeed_validated")
    for name in ("airspeed_source", "selected_airspeed_index"):
        if said is not None and name in said.fields:
            return Signal(said.t_s, numbers(said.fields[name]), f"airspeed_validated.{name}")
    return None


def _is_sensor(number: Array) -> BoolArray:
    return np.asarray((number >= 1) & (number <= PITOTS))


def _raw_airspeed(
    log: AutopilotLog,
    chosen: Mapping[str, int],
    messages: Messages,
    label: str,
    number: Signal | None,
) -> tuple[Messages, str, float]:
    """Return the raw topic of the pitot that the autopilot used most, and the scale of its own."""
    used = number.values[_is_sensor(number.values)] if number is not None else np.zeros(0)
    pitot = int(np.median(used)) if len(used) else 1
    every = log.messages[RAW_AIRSPEED]
    if RAW_AIRSPEED in chosen:
        pitot = chosen[RAW_AIRSPEED] + 1
    elif pitot - 1 in every:
        messages, label = every[pitot - 1], f"{RAW_AIRSPEED}[{pitot - 1}]"
    old = log.parameters.get("ASPD_SCALE", 1.0)  # until v1.12
    return messages, label, log.parameters.get(f"ASPD_SCALE_{pitot}", old)


def _computed_airspeed(number: Signal) -> list[str]:
    """Return a line on when the airspeed is no pitot's, or nothing."""
    sensor = _is_sensor(number.values)
    if sensor.all() or not sensor.any():
        return []
    first = int(np.argmax(~sensor & (np.arange(len(sensor)) > np.argmax(sensor))))
    first = first if not sensor[first] else int(np.argmin(sensor))
    until = "on" if not sensor[first:].any() else (
        f"to {number.t_s[first + int(np.argmax(sensor[first:]))]:.1f} s"
    )  # fmt: skip
    return [
        f"airspeed is no pitot's from {number.t_s[first]:.1f} s {until}"
        f" ({number.source.partition('.')[2]} {number.values[first]:.0f}): missing"
        f" for {100.0 * np.mean(~sensor):.0f} % of the log"
    ]


def _path(log: AutopilotLog, chosen: Mapping[str, int], found: Channels) -> None:
    path = instance_of(log, "vehicle_local_position", chosen, found.notes)
    if path is None:
        return
    messages, label = path
    valid = np.asarray(messages.fields.get("v_xy_valid", np.ones(len(messages)))) > 0
    for ours, theirs in (("v_north_mps", "vx"), ("v_east_mps", "vy"), ("v_down_mps", "vz")):
        if theirs in messages.fields:
            values = np.where(valid, messages.fields[theirs], np.nan)
            found.add(ours, messages.t_s, values, f"{label}.{theirs}")


def _outputs(log: AutopilotLog, chosen: Mapping[str, int], found: Channels) -> None:
    made: tuple[Messages, Outputs] | None = None
    servos = instance_of(log, "actuator_servos", chosen, found.notes)
    if servos is not None:
        controls = {
            k: numbers(servos[0].fields[f"control[{k}]"])
            for k in range(MOST_SURFACES)
            if f"control[{k}]" in servos[0].fields
        }
        out = made_of_outputs(
            servos[0].t_s,
            log.parameters,
            lambda rows, stood: allocated_surfaces(_rows(controls, rows), stood),
        )
        if out.shares:
            made = servos[0], out
    for other in (_pulses, _axes):  # the pins' pulses, then the demand in front of the mixer
        slow = made is None or _rate_hz(made[0]) < USABLE_HZ
        more = other(log, chosen) if slow else None
        if more is not None and (made is None or _rate_hz(more[0]) > _rate_hz(made[0])):
            made = more
    if made is not None:
        messages, out = made
        for name, share in out.shares.items():
            found.add(name, messages.t_s, share, out.made_of[name])
        found.clipped |= {name: many for name, many in out.clipped.items() if many}
        found.notes.append(
            "surfaces by the log's own parameters: "
            + "; ".join(f"{name} of {how}" for name, how in out.made_of.items())
            + "; what a servo's pulse adds to it (up to 20 ms) is not in the log"
        )
    elif "actuator_servos" in log.messages or "actuator_outputs" in log.messages:
        found.unknown_outputs = "no CA_SV_CSn_TYPE in the log is of a surface"
    _throttle(log, chosen, found)


def _pulses(log: AutopilotLog, chosen: Mapping[str, int]) -> tuple[Messages, Outputs] | None:
    """Return the surfaces behind the pulses of the first `actuator_outputs` that has some."""
    every = log.messages.get("actuator_outputs", {})
    wanted = [chosen["actuator_outputs"]] if "actuator_outputs" in chosen else sorted(every)
    for instance in wanted:
        messages = every[instance]
        pulses = {
            k + 1: numbers(messages.fields[f"output[{k}]"])
            for k in range(MOST_PINS)
            if f"output[{k}]" in messages.fields
        }
        out = made_of_outputs(
            messages.t_s,
            log.parameters,
            lambda rows, stood, pulses=pulses: surfaces_of_pulses(_rows(pulses, rows), stood),  # type: ignore[misc]
        )
        if len(messages) > 1 and out.shares:
            by = f" of actuator_outputs[{instance}]"
            made_of = {name: f"{how}{by}" for name, how in out.made_of.items()}
            return messages, Outputs(out.shares, made_of, out.clipped)
    return None


def _rows(outputs: Mapping[int, Array], rows: slice) -> dict[int, Array]:
    return {number: values[rows] for number, values in outputs.items()}


def _axes(log: AutopilotLog, _chosen: Mapping[str, int]) -> tuple[Messages, Outputs] | None:
    """Return the surfaces as the demand of roll, pitch and yaw has them."""
    asked = _axis_demand(log)
    return None if asked is None else (asked[0], axis_demands(*asked[1:]))


def torque_setpoints(log: AutopilotLog) -> dict[str, Signal]:
    """Return the normalised torque setpoint about the axis of each body rate."""
    asked = _axis_demand(log)
    if asked is None:
        return {}
    messages, values, topic = asked
    return {n: Signal(messages.t_s, v, topic) for n, v in zip(RATES, values, strict=True)}


def _axis_demand(log: AutopilotLog) -> tuple[Messages, list[Array], str] | None:
    """Return the demand of roll, pitch and yaw and its topic: of a VTOL that of its wing."""
    topics = (("vehicle_torque_setpoint", "xyz"), ("actuator_controls_1", "control"),
              ("actuator_controls_0", "control"))  # fmt: skip
    for topic, field in topics:
        every = log.messages.get(topic, {})
        if topic == "actuator_controls_1" and log.vehicle != "vtol":
            continue
        wing = every.get(1) if log.vehicle == "vtol" and topic.startswith("vehicle") else None
        messages = wing or (every[min(every)] if every else None)
        if messages is None or len(messages) < 2:
            continue
        hover = topic == "vehicle_torque_setpoint"  # what the mixer's groups hold is the wing's own
        values = _body_vector(log, messages, field) if hover else _vector(messages, field)
        if values is not None:
            return messages, values, topic
    return None


def _throttle(log: AutopilotLog, chosen: Mapping[str, int], found: Channels) -> None:
    motors = instance_of(log, "actuator_motors", chosen, [])
    if motors is not None:
        every = [
            numbers(v)
            for name, v in motors[0].fields.items()
            if name.startswith("control[") and np.isfinite(numbers(v)).any()
        ]
        if every:
            found.add("throttle", motors[0].t_s, np.mean(every, axis=0), f"{motors[1]}.control")
            if len(every) == 2:
                difference = every[0] - every[1]
                found.add("throttle_difference", motors[0].t_s, difference, f"{motors[1]}.control")
        return
    for topic, field in (
        ("vehicle_thrust_setpoint", "xyz[0]"),
        ("actuator_controls_0", "control[3]"),
    ):
        messages = log.first(topic)
        if messages is not None and field in messages.fields:
            values = numbers(messages.fields[field])
            found.add("throttle", messages.t_s, values, f"{topic}.{field}")
            return


def _rate_hz(messages: Messages) -> float:
    return 1.0 / float(np.median(np.diff(messages.t_s))) if len(messages) > 1 else 0.0
