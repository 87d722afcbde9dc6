"""ArduPilot DataFlash: its messages in our names, units and signs.

Its axes are ours (x forward, y right, z down), its accelerations specific force.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.arrays import Array, BoolArray
from host.constants import RAD_PER_DEG
from host.physical.airdata import KELVIN, density_kgpm3
from host.readers.ardupilot_outputs import SURFACES, moves_a_surface, surfaces, unknown_outputs
from host.readers.autopilot_log import AutopilotLog, Messages
from host.readers.named_channels import (
    SERVO_HZ,
    STANDARD_DENSITY_KGPM3,
    STANDARD_TEMPERATURE_DEGC,
    Channels,
    instance_of,
    numbers,
)
from host.readers.written_parameters import made_of_outputs

FIX_3D = 3
OUTPUTS = ("RCOU", "RCO2", "RCO3")  # outputs 1 to 14, 15 to 18, 19 to 32
SAME_SET_S = 2e-3


def ardupilot_channels(log: AutopilotLog, chosen: Mapping[str, int]) -> Channels:
    """Return the channels of a DataFlash log; `chosen` names instances by message."""
    found = Channels()
    for name in chosen:
        instance_of(log, name, chosen, [])
    _inertial(log, chosen, found)
    _attitude(log, found)
    _air(log, chosen, found)
    _gps(log, chosen, found)
    _outputs(log, found)
    vibration = instance_of(log, "VIBE", {}, [])
    if vibration is not None:
        shaken = vibration[0].fields
        axes = [numbers(shaken[k]) for k in ("VibeX", "VibeY", "VibeZ") if k in shaken]
        found.vibration_mps2 = max((float(np.median(a)) for a in axes), default=float("nan"))
        clip = shaken.get("Clip", shaken.get("Clip0"))
        if clip is not None and len(clip):
            found.clipped |= {"IMU": many} if (many := int(clip[-1]) - int(clip[0])) > 0 else {}
    return found


def _inertial(log: AutopilotLog, chosen: Mapping[str, int], found: Channels) -> None:
    imu = instance_of(log, "IMU", chosen, found.notes)
    if imu is None:
        return
    messages, label = imu
    cutoff = {"gyro": "INS_GYRO_FILTER", "force": "INS_ACCEL_FILTER"}
    late = {k: _butterworth_s(log.parameters.get(name, 0.0)) for k, name in cutoff.items()}
    for ours, theirs in (("p_radps", "GyrX"), ("q_radps", "GyrY"), ("r_radps", "GyrZ")):
        _take(found, ours, messages, label, theirs, late_s=late["gyro"])
    for ours, theirs in (("ax_mps2", "AccX"), ("ay_mps2", "AccY"), ("az_mps2", "AccZ")):
        _take(found, ours, messages, label, theirs, late_s=late["force"])


def _butterworth_s(cutoff_hz: float) -> float:
    """Return the delay of a second-order low-pass, as ArduPilot filters its IMUs."""
    return float(np.sqrt(2.0) / (2.0 * np.pi * cutoff_hz)) if cutoff_hz > 0.0 else 0.0


def _attitude(log: AutopilotLog, found: Channels) -> None:
    att = log.first("ATT")
    if att is None:
        return
    for ours, theirs in (("phi_rad", "Roll"), ("theta_rad", "Pitch"), ("psi_rad", "Yaw")):
        _take(found, ours, att, "ATT", theirs, RAD_PER_DEG)


def _air(log: AutopilotLog, chosen: Mapping[str, int], found: Channels) -> None:
    baro = instance_of(log, "BARO", chosen, found.notes)
    pitot = _pitot(log, chosen, found.notes)
    if baro is not None and "Press" in baro[0].fields:
        messages, label = baro
        warm = STANDARD_TEMPERATURE_DEGC
        if "GndTemp" in messages.fields:
            warm = float(np.median(messages.fields["GndTemp"]))
        elif pitot is not None and "Temp" in pitot[0].fields:
            warm = float(np.median(pitot[0].fields["Temp"]))
        pressure = numbers(messages.fields["Press"])
        found.add("static_pa", messages.t_s, pressure, f"{label}.Press")
        rho = density_kgpm3(pressure, np.full(len(pressure), warm + KELVIN))
        found.add("density_kgpm3", messages.t_s, rho, f"{label}.Press at {warm:.0f} degC")
        if "Alt" in messages.fields:
            _take(found, "altitude_m", messages, label, "Alt")
    if pitot is None or "Airspeed" not in pitot[0].fields:
        return
    messages, label = pitot
    indicated = numbers(messages.fields["Airspeed"])
    indicated = np.where(_healthy(messages), indicated, np.nan)
    share = found.true_over_indicated(messages.t_s)
    found.add("airspeed_mps", messages.t_s, indicated * share, f"{label}.Airspeed, true")
    qbar = 0.5 * STANDARD_DENSITY_KGPM3 * indicated**2
    found.add("qbar_pa", messages.t_s, qbar, f"{label}.Airspeed")


def _pitot(
    log: AutopilotLog, chosen: Mapping[str, int], notes: list[str]
) -> tuple[Messages, str] | None:
    """Return the pitot asked for, else the autopilot's primary one if it was well and used."""
    every = log.messages.get("ARSP", {})
    said = [numbers(m.fields["Pri"]) for m in every.values() if "Pri" in m.fields]
    if "ARSP" in chosen or len(every) < 2 or not said:
        return instance_of(log, "ARSP", chosen, notes)
    primary = int(np.median(np.concatenate(said)))

    def worth(number: int) -> tuple[float, float, bool, int]:
        one = every[number]
        well = float(np.mean(_healthy(one)))
        used = float(np.mean(numbers(one.fields.get("U", np.ones(len(one)))) > 0))
        return round(well, 1), round(used, 1), number == primary, len(one)

    best = max(sorted(every, reverse=True), key=worth)
    notes.append(
        f"ARSP {best} of {len(every)} is used, by its health, its use and the primary"
        f" ({primary}); others: "
        + ", ".join(f"--sensor ARSP={k}" for k in sorted(every) if k != best)
    )
    return every[best], f"ARSP[{best}]"


def _healthy(messages: Messages) -> BoolArray:
    """Return where the autopilot held a pitot for healthy."""
    said = messages.fields.get("H", messages.fields.get("Health"))
    return np.ones(len(messages), dtype=bool) if said is None else np.asarray(said) > 0


def _gps(log: AutopilotLog, chosen: Mapping[str, int], found: Channels) -> None:
    gps = instance_of(log, "GPS", chosen, found.notes)
    if gps is None or not {"Spd", "GCrs"} <= gps[0].fields.keys():
        return
    messages, label = gps
    fixed = np.asarray(messages.fields.get("Status", np.full(len(messages), FIX_3D))) >= FIX_3D
    speed = np.where(fixed, messages.fields["Spd"], np.nan)
    course = numbers(messages.fields["GCrs"]) * RAD_PER_DEG
    found.add("v_north_mps", messages.t_s, speed * np.cos(course), f"{label}.Spd, GCrs")
    found.add("v_east_mps", messages.t_s, speed * np.sin(course), f"{label}.Spd, GCrs")
    if "VZ" in messages.fields:
        down = np.where(fixed, messages.fields["VZ"], np.nan)
        found.add("v_down_mps", messages.t_s, down, f"{label}.VZ")


def _outputs(log: AutopilotLog, found: Channels) -> None:
    out = next(
        (m for n in OUTPUTS if (m := log.first(n)) is not None and _moves(m, log.parameters)), None
    )
    out = out or log.first(*OUTPUTS)
    if out is None:
        return
    made = made_of_outputs(
        out.t_s,
        log.parameters,
        lambda rows, stood: surfaces(_pulses(log, out.t_s[rows], stood), stood),
    )
    found.output_period_s = 1.0 / max(log.parameters.get("SERVO_RATE", SERVO_HZ), 1.0)
    for name, share in made.shares.items():
        found.add(name, out.t_s, share, made.made_of[name])
    found.clipped |= {name: many for name, many in made.clipped.items() if many}
    if made.made_of:
        found.notes.append(
            "surfaces by SERVOn_ parameters: "
            + "; ".join(f"{name} of {how}" for name, how in made.made_of.items())
        )
    if not SURFACES & made.shares.keys():
        numbers = {int(f[1:]) for f in out.fields if f[:1] == "C" and f[1:].isdigit()}
        found.unknown_outputs = unknown_outputs(numbers, log.parameters)


def _moves(messages: Messages, parameters: Mapping[str, float]) -> list[tuple[str, int]]:
    """Return the fields that move a surface or a motor, and the number of each output."""
    named = [(f, int(f[1:])) for f in messages.fields if f[:1] == "C" and f[1:].isdigit()]
    return [(field, number) for field, number in named if moves_a_surface(number, parameters)]


def _pulses(log: AutopilotLog, t_s: Array, parameters: Mapping[str, float]) -> dict[int, Array]:
    """Return the pulses of all outputs that move something, at the instants of one message.

    The autopilot writes the messages of a set one behind the other.
    """
    pulses: dict[int, Array] = {}
    for name in OUTPUTS:
        messages = log.first(name)
        moved = _moves(messages, parameters) if messages is not None else []
        if messages is None or not moved:
            continue
        row = np.searchsorted(messages.t_s, t_s + SAME_SET_S, side="right") - 1
        before = row < 0
        for field, number in moved:
            values = numbers(messages.fields[field])[np.maximum(row, 0)]
            pulses[number] = np.where(before, np.nan, values)
    return pulses


def _take(
    found: Channels,
    ours: str,
    messages: Messages,
    label: str,
    theirs: str,
    gain: float = 1.0,
    late_s: float = 0.0,
) -> None:
    values = messages.fields.get(theirs)
    if values is not None:
        scaled = values if gain == 1.0 else numbers(values) * gain
        found.add(ours, messages.t_s, scaled, f"{label}.{theirs}", late_s)
