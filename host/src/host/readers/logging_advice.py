"""Parameters of the autopilot to change so that the next flight can be identified.

PX4: src/modules/logger/logged_topics.cpp gives each profile's topics and intervals. ArduPilot:
ArduPlane Plane.cpp and Log.cpp, and the bits of LOG_BITMASK in defines.h.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from host.readers.autopilot_log import AutopilotLog

TELEMETRY = (
    "give the log of the autopilot's own card (.bin, .ulg) in place of the telemetry; or, over USB"
    " or WiFi, SRn_RAW_SENS, SRn_EXTRA1 and SRn_RC_CHAN = 50 (n: the link)"
)
# ArduPlane LOG_BITMASK.
IMU_BIT, RC_BIT, FULL_ATTITUDE_BIT = 1 << 7, 1 << 13, 1 << 20
# PX4 SDLOG_PROFILE: default set, estimator replay (airspeed and air data), high rate.
PX4_DEFAULT, PX4_REPLAY, PX4_HIGH_RATE = 1 << 0, 1 << 1, 1 << 4


def advice(log: AutopilotLog, missing: Sequence[str], poor: Sequence[str]) -> list[str]:
    """Return settings, most important first; vanes last, for no autopilot logs them.

    Parameters
    ----------
    log : AutopilotLog
        Its parameters say what was set.
    missing, poor : sequence of str
        Groups of channels (`judgement.GROUPS`) that are missing or slow.
    """
    weak = [*missing, *poor]
    if log.format == "tlog":
        said = [TELEMETRY] if weak else []
    elif log.autopilot == "px4":
        said = _px4(log.parameters, weak)
    else:
        said = _ardupilot(log.parameters, weak)
    if "airspeed" in missing:
        said.append("fit an airspeed sensor" + _airspeed_setting(log.autopilot))
    return said


def _px4(parameters: Mapping[str, float], weak: Sequence[str]) -> list[str]:
    if not weak:
        return []
    now = int(parameters.get("SDLOG_PROFILE", 1))
    wanted = now | PX4_DEFAULT | PX4_HIGH_RATE
    if "airspeed" in weak:
        wanted |= PX4_REPLAY
    if wanted == now:
        return []
    return [
        f"SDLOG_PROFILE = {wanted} (it is {now}): high rate logs rates, attitude and"
        " actuator_servos at every sample, by default surfaces come at 10 Hz"
        + (", estimator replay logs airspeed at its own rate" if "airspeed" in weak else "")
    ]


def _ardupilot(parameters: Mapping[str, float], weak: Sequence[str]) -> list[str]:
    said = []
    now = int(parameters.get("LOG_BITMASK", 0))
    wanted = now
    if "rates" in weak or "accelerations" in weak:
        wanted |= IMU_BIT
    if "surfaces" in weak:
        wanted |= RC_BIT
    if "attitude" in weak:
        wanted |= FULL_ATTITUDE_BIT
    if wanted != now:
        said.append(
            f"LOG_BITMASK = {wanted} (it is {now}): IMU at every loop, ATT at every loop, RC"
            " outputs at 25 Hz"
        )
    loop_hz = parameters.get("SCHED_LOOP_RATE", 50.0)
    if loop_hz < 50.0 and ("rates" in weak or "accelerations" in weak):
        said.append(f"SCHED_LOOP_RATE = 50 or more (it is {loop_hz:g})")
    if "surfaces" in weak and now & RC_BIT:
        said.append(
            "nothing for the surfaces: ArduPlane writes RCOU at 25 Hz at most, so their edges are"
            " known to 20 ms; longer steps suffer less"
        )
    return said


def _airspeed_setting(autopilot: str) -> str:
    if autopilot == "px4":
        return " and set SYS_HAS_NUM_ASPD = 1"
    return " and set ARSPD_TYPE to its kind, ARSPD_USE = 1"
