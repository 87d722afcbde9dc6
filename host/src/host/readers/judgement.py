"""Judge from rates and channels what can be identified from an autopilot's log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from host.readers.airborne import Airborne
from host.readers.autopilot_log import FORMATS, AutopilotLog
from host.readers.logging_advice import advice
from host.readers.named_channels import Channels
from host.terminal import command_line

WINGED = ("", "plane", "vtol")
# Rates in Hz from which a channel serves: below the first it does not, below the second poorly.
# A short period of 3 Hz wants ten samples a period; a surface's edge is known to half its step.
WANTED_HZ = {
    "rates": (20.0, 40.0), "accelerations": (20.0, 40.0), "attitude": (5.0, 20.0),
    "surfaces": (20.0, 40.0), "airspeed": (2.0, 5.0),
}  # fmt: skip
GROUPS = {
    "rates": ("p_radps", "q_radps", "r_radps"),
    "accelerations": ("ax_mps2", "ay_mps2", "az_mps2"),
    "attitude": ("phi_rad", "theta_rad", "psi_rad"),
    "surfaces": ("elevator", "aileron", "rudder"),
    "airspeed": ("airspeed_mps",),
}
# Records of each format from which a group comes.
_DATAFLASH: dict[str, tuple[str, ...]] = {"rates": ("IMU",), "surfaces": ("RCOU",)}
RECORDS: dict[str, dict[str, tuple[str, ...]]] = {
    "dataflash": _DATAFLASH,
    "dataflash-text": _DATAFLASH,
    "ulog": {
        "rates": ("vehicle_angular_velocity", "sensor_combined"),
        "surfaces": ("actuator_servos", "actuator_outputs", "vehicle_torque_setpoint"),
    },
    "tlog": {"rates": ("ATTITUDE", "RAW_IMU"), "surfaces": ("SERVO_OUTPUT_RAW",)},
}
# Groups of derivatives, and the channels that each needs.
ANSWERS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("roll: L_p, L_da", ("p_radps", "phi_rad", "aileron")),
    ("short period: Z_alpha, M_alpha, M_q, M_de, by q and az",
     ("q_radps", "az_mps2", "airspeed_mps", "elevator")),
    ("lateral: Y_beta, L_beta, N_beta, N_r, N_dr, by r, p and ay",
     ("p_radps", "r_radps", "ay_mps2", "airspeed_mps", "rudder")),
    ("speed, drag and lift curve: D_*, Z_V, M_V, coefficients", ("alpha_rad", "airspeed_mps")),
)  # fmt: skip
VIBRATION_MPS2 = 30.0  # ArduPilot's own limit, documentation "Measuring Vibration"
ANGLES = {"alpha_rad": "angle of attack", "beta_rad": "sideslip"}


@dataclass(frozen=True, slots=True)
class Judgement:
    """What can be identified from a log, and the settings to change.

    Attributes
    ----------
    refusal : str
        Sentence with the reason why nothing can be identified; empty if something can.
    lines : list of str
        For people: vehicle, time in the air, rates, what is wrong.
    answers : list of (what, verdict)
        What can and what cannot be identified.
    settings : list of str
        What to change for the next flight, by the autopilot's parameters.
    rates_hz : dict of str to float
        Rate of each channel.
    """

    refusal: str
    lines: list[str]
    answers: list[tuple[str, str]]
    settings: list[str]
    rates_hz: dict[str, float]

    def document(self) -> dict[str, Any]:
        """Return the judgement as plain data."""
        return {
            "refusal": self.refusal or None,
            "rates_hz": self.rates_hz,
            "answers": [{"what": what, "verdict": verdict} for what, verdict in self.answers],
            "settings": self.settings,
        }

    def table(self) -> list[str]:
        """Return lines: what can be identified, and the settings to change."""
        rows = [f"{what:<61}{verdict}" for what, verdict in self.answers]
        rows += advice_lines(self.settings)
        return rows


def advice_lines(settings: Sequence[str]) -> list[str]:
    """Return options of the command to run, and settings for the next flight, as lines."""
    return [f"{'now' if one.startswith('--') else 'next flight'}: {one}" for one in settings]


def judge(log: AutopilotLog, found: Channels, flown: Airborne) -> Judgement:
    """Judge a log."""
    rates = {name: round(signal.rate_hz, 1) for name, signal in found.signals.items()}
    missing, poor = _groups(rates)
    lines = [_vehicle_line(log, flown)]
    lines += [f"{group}: {_rate_words(names, rates)}" for group, names in GROUPS.items()]
    lines += _trouble(found, log)
    option = given_outputs(log, found)
    slow = [group for group in missing if group != "surfaces" or not option]
    settings = [*option, *advice(log, slow, poor)]
    return Judgement(
        refusal=_refusal(log, found, flown, missing, rates, settings),
        lines=lines,
        answers=[(what, _verdict(needs, rates, poor)) for what, needs in ANSWERS],
        settings=settings,
        rates_hz=rates,
    )


def _groups(rates: Mapping[str, float]) -> tuple[list[str], list[str]]:
    """Return which groups are missing or useless, and which are slow."""
    missing, poor = [], []
    for group, names in GROUPS.items():
        usable, good = WANTED_HZ[group]
        best = max((rates[n] for n in names if n in rates), default=0.0)
        if best < 0.9 * usable:
            missing.append(group)
        elif best < 0.9 * good:
            poor.append(group)
    return missing, poor


def _rate_words(names: Sequence[str], rates: Mapping[str, float]) -> str:
    said = [f"{n.rsplit('_', 1)[0]} {rates[n]:g} Hz" for n in names if n in rates]
    gone = [n.rsplit("_", 1)[0] for n in names if n not in rates]
    return ", ".join([*said, *(f"{n} not in the log" for n in gone)])


def _vehicle_line(log: AutopilotLog, flown: Airborne) -> str:
    kind = log.vehicle or "vehicle of unknown kind"
    firmware = f" ({log.firmware})" if log.firmware else ""
    if not flown.by:
        return f"{kind}{firmware}; no airspeed and no GPS say whether it flew"
    return (
        f"{kind}{firmware}; {flown.time_s:.0f} s in the air, {flown.by} up to"
        f" {flown.fastest_mps:.1f} m/s"
    )


def given_outputs(log: AutopilotLog, found: Channels) -> list[str]:
    """Return the option that says what the outputs move, where the log does not."""
    if not found.unknown_outputs:
        return []
    plain = log.autopilot == "ardupilot" and log.vehicle != "vtol"
    example = "1=aileron --output 2=elevator --output 4=rudder" if plain else "2=elevator"
    return [
        f"--output {example}, the numbers and surfaces as yours are connected (a minus before the"
        " surface turns it round)"
    ]


def _gone(group: str, log: AutopilotLog, found: Channels, rates: Mapping[str, float]) -> str:
    """Return what of a group of channels the log does not have, by its own word."""
    words = " or ".join(RECORDS[log.format][group])
    best = max((rates[name] for name in GROUPS[group] if name in rates), default=0.0)
    if best:
        return f"{words} comes at {best:g} Hz, {WANTED_HZ[group][0]:g} are needed ({group})"
    if group == "surfaces" and found.unknown_outputs:
        return f"{found.unknown_outputs}: no output is known to move a surface"
    if any(name in log.messages for name in RECORDS[log.format][group]):
        return f"nothing of {words} is usable ({group})"
    return f"there is no {words} in it ({group})"


def _refusal(
    log: AutopilotLog,
    found: Channels,
    flown: Airborne,
    missing: Sequence[str],
    rates: Mapping[str, float],
    settings: Sequence[str],
) -> str:
    where = f"{log.path}: {FORMATS[log.format]}"
    if log.vehicle == "tailsitter":
        return (
            f"{where} of a tailsitter: it does not say whether attitude and rates are those of"
            " hover or of forward flight, so nothing of it can be identified; its ULog says it"
        )
    if log.vehicle not in WINGED:
        return (
            f"{where} of a {log.vehicle}, which does not fly on a wing: nothing of it can be"
            " identified here"
        )
    kind = {"vtol": "VTOL", "plane": "plane"}.get(log.vehicle, "vehicle")
    if flown.by and flown.time_s == 0.0:
        return (
            f"{where} of a {kind} that never flew ({flown.by} at most {flown.fastest_mps:.1f} m/s):"
            " nothing of it can be identified"
        )
    gone = [_gone(group, log, found, rates) for group in ("rates", "surfaces") if group in missing]
    if gone:
        mend = settings[0] if settings else f"`{command_line('host', 'info', log.path)}` says more"
        return (
            f"{where} of a {kind} from which nothing can be identified: {'; '.join(gone)}. Mend it"
            f" so: {mend}"
        )
    return ""


def _verdict(needs: Sequence[str], rates: Mapping[str, float], poor: Sequence[str]) -> str:
    angles = [ANGLES[n] for n in needs if n in ANGLES and n not in rates]
    if angles:
        return f"not identifiable without vanes: no {' and no '.join(angles)} was measured"
    gone = [n for n in needs if n not in rates]
    if gone:
        return f"not identifiable: {', '.join(n.rsplit('_', 1)[0] for n in gone)} not in the log"
    slow = [g for g in poor if set(GROUPS[g]) & set(needs)]
    path = {"v_north_mps", "airspeed_mps"} <= rates.keys()
    how = "flow angles from the GPS path" if path else "without GPS never under trust"
    possible = "identifiable" + ("" if "alpha_rad" in rates else f", no vanes: {how}")
    return f"poorly: {', '.join(slow)} too slow" if slow else possible


def _trouble(found: Channels, log: AutopilotLog) -> list[str]:
    said = [
        f"{name}: {many} samples at an end of its range" for name, many in found.clipped.items()
    ]
    if found.vibration_mps2 > VIBRATION_MPS2:
        said.append(
            f"vibration {found.vibration_mps2:.0f} m/s2, above {VIBRATION_MPS2:g}: mount the"
            " autopilot softer"
        )
    late = {s.late_s for n, s in found.signals.items() if n.endswith("_radps")} - {0.0}
    if late:
        said.append(f"rates are {1e3 * max(late):.1f} ms late by the autopilot's own filter")
    return said + [f"damage: {one}" for one in log.damage]
