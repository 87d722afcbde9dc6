"""What the host reads of format version 1: frame -> field -> type, and words of its tables.

A released field keeps name and type for ever (protocol/frames.toml, "Changing it"): a schema
without one of these, or with another type, was not written by a logger of this format.
"""

from __future__ import annotations

_RATES = ("p", "q", "r")
_INERTIAL = (*_RATES, "ax", "ay", "az", "phi", "theta", "psi")
_VANES = ("alpha_a", "alpha_b", "beta_a", "beta_b", "dp_a", "dp_b")
_POTS = ("pot_elevator", "pot_aileron_left", "pot_aileron_right", "pot_rudder")
_SURFACES = ("aileron", "elevator", "rudder", "throttle")
_PULSES = (*(f"servo_{name}" for name in _SURFACES), *(f"rc_{name}" for name in _SURFACES))

READ_FIELDS: dict[str, dict[str, str]] = {
    "ident": {
        "t_us": "u32",
        **dict.fromkeys(("count", "imu_age"), "u16"),
        **dict.fromkeys(_INERTIAL, "i16"),
        **dict.fromkeys((*_VANES, *_POTS, *_PULSES, "rc_switch", "valid"), "u16"),
    },
    "attitude": {"dlpf": "u8"},
    "baro": {"static_pressure": "u32", "temperature": "i16"},
    "gps": {
        "itow_ms": "u32",
        "week": "u16",
        **dict.fromkeys(("latitude", "longitude", "height"), "i32"),
        **dict.fromkeys(("v_north", "v_east", "v_down"), "i16"),
        "ground_speed": "u16",
        **dict.fromkeys(("fix", "satellites"), "u8"),
    },
    "system": {"uptime_s": "u32", "sensors": "u8"},
    "event": {"code": "u8", "arg": "u32"},
    "config": {"rate_hz": "u16", "aircraft": "char[16]"},
    "identity": {"board": "char[12]", "firmware": "char[20]"},
    "baro_coefficients": {"sensor": "u8"},
}
# Frames that came later: read where a log has them.
READ_IF_THERE = {
    "file": {"preallocated": "u32"},
    "card": {"part": "u8", "bytes": "u8[48]"},
}
READ_WORDS: dict[str, tuple[str, ...]] = {
    "gps_fix": ("fix_2d", "fix_3d"),
    "event": ("session_end", "block_skipped"),
}
# Bits that the field of a table has room for.
READ_BITS = {"valid": 16, "sensors": 8}
