"""The shared library of shim/bench.h through ctypes: signatures, nothing else."""

from __future__ import annotations

import ctypes as ct
from functools import cache
from pathlib import Path

LATENCY_BINS = 4096
VECTOR_COUNT = 57

Callback = ct.CFUNCTYPE(None, ct.c_uint32, ct.c_uint32, ct.c_uint64, ct.c_uint32)


class VectorRecord(ct.Structure):
    """``vector_stats`` of shim/chip.h."""

    _fields_ = (
        ("count", ct.c_uint64),
        ("latency_sum", ct.c_uint64),
        ("latency_max", ct.c_uint64),
        ("length_sum", ct.c_uint64),
        ("length_max", ct.c_uint64),
        ("nested_max", ct.c_uint32),
        ("latency", ct.c_uint32 * LATENCY_BINS),
        ("length", ct.c_uint32 * LATENCY_BINS),
    )


class MpuSettings(ct.Structure):
    """``mpu_settings`` of shim/bench.h."""

    _fields_ = tuple(
        (name, ct.c_double)
        for name in ("clock_rate", "jitter_cycles", "gyro_noise_lsb", "accel_noise_lsb")
    )


class SdSettings(ct.Structure):
    """``sd_settings`` of shim/bench.h."""

    _fields_ = tuple(
        (name, ct.c_uint32)
        for name in (
            *("blocks", "high_capacity", "version_1", "busy_cycles"),
            *("read_cycles", "init_cycles", "erase_cycles", "response_bytes"),
        )
    )


class SdCounters(ct.Structure):
    """``sd_counters`` of shim/bench.h."""

    _fields_ = tuple(
        (name, ct.c_uint64)
        for name in ("commands", "written", "read", "rejected", "lost", "bytes_ignored", "erased")
    )


_u32, _u64, _f64, _bool, _ptr, _bytes = (
    ct.c_uint32,
    ct.c_uint64,
    ct.c_double,
    ct.c_bool,
    ct.c_void_p,
    ct.c_char_p,
)
_doubles = ct.POINTER(_f64)

# name: (result, arguments after the handle)
_SIGNATURES: dict[str, tuple[object, tuple[object, ...]]] = {
    "destroy": (None, ()),
    "on_event": (None, (Callback,)),
    "set_startup": (None, (_u32, _u32)),
    "run": (None, (_u64,)),
    "stop": (None, ()),
    "cycle": (_u64, ()),
    "timer": (None, (_u64, _u32)),
    "power_on": (None, ()),
    "power_off": (None, ()),
    "assert_reset": (None, (_u32,)),
    "release_reset": (None, (_u32,)),
    "state": (ct.c_int, ()),
    "flash": (_ptr, ()),
    "data": (_ptr, ()),
    "eeprom": (_ptr, ()),
    "pc": (_u32, ()),
    "sp": (_u32, ()),
    "lowest_sp": (_u32, ()),
    "poke_pc": (None, (_u32,)),
    "load": (None, (_u64 * 3,)),
    "vector": (ct.POINTER(VectorRecord), (_u32,)),
    "clear_statistics": (None, ()),
    "log_interrupts": (None, (_bool,)),
    "log_marks": (None, (_bool,)),
    "watch_pc": (None, (_u32, _u32)),
    "count_cycles": (None, ()),
    "spent": (ct.POINTER(_u64), ()),
    "log_count": (ct.c_size_t, ()),
    "log": (_ptr, ()),
    "clear_log": (None, ()),
    "pin_watch": (None, (_u32, _bool, _bool)),
    "pin_level": (_bool, (_u32,)),
    "pin_driven": (_bool, (_u32,)),
    "pin_strong": (None, (_u32, _u32)),
    "pin_weak": (None, (_u32, _u32)),
    "pin_strong_at": (None, (_u64, _u32, _u32)),
    "pin_pull_low": (None, (_u32, _bool)),
    "analog_set": (None, (_u32, _doubles, _doubles, _u32)),
    "analog_noise": (None, (_u32, _f64)),
    "analog_supply": (None, (_f64, _f64, _f64)),
    "analog_stick": (None, (_u64,)),
    "adc_conversions": (_u64, ()),
    "uart_send": (None, (_u32, _bytes, _u32, _f64, _u64)),
    "uart_notify": (None, (_u32, _bool)),
    "uart_lost": (_u64, (_u32,)),
    "twi_send": (None, (_u64, _u32, _u32, _bytes, _u32, _u32, _u32, _u32)),
    "twi_hold": (None, (_bool, _bool)),
    "i2c_device": (_ptr, (_u32, _u32, _u32, _u32)),
    "i2c_registers": (ct.POINTER(ct.c_uint8), ()),
    "i2c_present": (None, (_bool,)),
    "i2c_fastest": (_u32, ()),
    "bus": (_ptr, (_ptr, _f64)),
    "bus_hold": (None, (_bool, _bool, _bool, _bool)),
    "bus_hang": (None, (_u32,)),
    "bus_stretch": (None, (_f64,)),
    "bus_log_bytes": (None, (_bool,)),
    "bus_listen": (None, (_u32,)),
    "bus_time": (_f64, (_ptr, _u64)),
    "mpu_spi": (_ptr, (_u32, _u32, _u32)),
    "mpu_i2c": (_ptr, (_ptr, _u32, _u32)),
    "mpu_set": (None, (ct.POINTER(MpuSettings),)),
    "mpu_fault": (None, (_u32,)),
    "mpu_reset": (None, ()),
    "mpu_write": (None, (_u32, _u32)),
    "mpu_motion": (None, (_doubles, _doubles, _u32)),
    "mpu_count": (ct.c_size_t, ()),
    "mpu_samples": (_ptr, ()),
    "mpu_registers": (ct.POINTER(ct.c_uint8), ()),
    "magnetometer": (_ptr, (_ptr, _bool)),
    "magnetometer_fault": (None, (_bool, _bool)),
    "magnetometer_count": (_u64, ()),
    "magnetometer_field": (None, (_doubles, _doubles, _u32)),
    "sd_card": (_ptr, (_u32, _ptr, ct.POINTER(SdSettings), _u64)),
    "sd_insert": (None, (_bool,)),
    "sd_stall": (None, (_u64, _u32)),
    "sd_reject": (None, (_u64, _u32, _u32)),
    "sd_power_cut": (None, ()),
    "sd_busy": (_bool, ()),
    "sd_fail_reads": (None, (_bool,)),
    "sd_hold_line": (None, (_bool,)),
    "sd_delays": (None, (_u32, _u32)),
    "sd_journal": (None, (_ptr, _u64)),
    "sd_journal_count": (_u64, ()),
    "sd_counters": (None, (ct.POINTER(SdCounters),)),
}


@cache
def load_library(path: Path) -> ct.CDLL:
    """Load the shim and declare its functions.

    Parameters
    ----------
    path : Path
        The shared library that ``build.py`` made.

    Returns
    -------
    ctypes.CDLL
        Functions named ``bench_*``.

    Raises
    ------
    OSError
        If the library or libsimavr cannot be loaded.
    """
    library = ct.CDLL(str(path))
    library.bench_create.restype = _ptr
    library.bench_create.argtypes = (_u64, _u32)
    for name, (result, arguments) in _SIGNATURES.items():
        function = getattr(library, f"bench_{name}")
        function.restype = result
        function.argtypes = (_ptr, *arguments)
    return library
