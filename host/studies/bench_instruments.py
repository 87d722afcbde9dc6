"""Virtual instruments on a virtual bench: truth, hand, and the faults that must be found.

Every reading comes through sensor (hysteresis, friction, a wave, noise, quantisation, a supply that
drifts) and hand (tool as it is, placing, reading), each drawn with the deviation that
`bench.toml` states, the hand's own care by a third more or less.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from host.bench_calibration.bench_plan import Subject, Tool, hand_worth, subjects
from host.bench_calibration.held_position import Held
from host.bench_calibration.six_faces import AXES, FACES, FORCES, face_held
from host.bench_calibration.turned_gyro import Rest, Turn
from host.constants import GRAVITY_MPS2, RAD_PER_DEG
from host.physical.calibration import Line, load_calibration
from numpy.typing import NDArray

Array = NDArray[np.float64]
LINES = ("vanes", "pots", "servos", "throttle", "pitots")
# Raw units: largest hysteresis, friction, wave over the range, noise rms, step of a reading.
SENSORS = {
    "vanes": (0.8, 0.3, 0.3, 0.34, 0.25),
    "pots": (1.5, 0.4, 0.4, 0.4, 0.25),
    "servos": (8.0, 2.0, 2.0, 1.0, 0.5),
    "throttle": (0.0, 1.0, 0.0, 1.0, 0.5),
    "pitots": (0.4, 0.1, 0.2, 0.4, 0.25),
}
# Half-width of the slope's share: by data sheet and hw/calibration.
SLOPES = {"vanes": 0.03, "pots": 0.12, "servos": 0.10, "throttle": 0.10, "pitots": 0.04}
SAMPLES = 200  # 2 s at 100 Hz
SUPPLY = 0.01  # rms of a supply's drift from repeat to repeat; a tenth is not ratiometric
FAULTS = ("worn_pot", "noisy_pot", "slipped_vane", "swapped_pair", "leaking_tube")


@dataclass(frozen=True, slots=True)
class Truth:
    """What a channel is: raw = zero + value / slope; the zero it stands at in flight."""

    zero: float
    slope: float
    zero_in_flight: float


@dataclass(frozen=True, slots=True)
class BenchChannel:
    """A channel's truth and what was read of it."""

    subject: Subject
    channel: str
    truth: Truth
    held: tuple[Held, ...]


def bench_channels(rng: np.random.Generator, careless: float = 1.0) -> list[BenchChannel]:
    """Return every line channel of one instrument, calibrated by one person, whose hand scatters
    `careless` times as much as the tools' file says."""
    known, defaults = subjects(), load_calibration().lines
    care = careless * float(np.sqrt(hand_worth() / rng.chisquare(hand_worth())))
    found = []
    for name in LINES:
        subject = known[name]
        assert subject.tool is not None
        hand = replace(
            subject.tool,
            placing=care * subject.tool.placing,
            reading=care * subject.tool.reading,
        )
        for channel in subject.channels:
            line = defaults[f"{subject.table}.{channel}"]
            found.append(_channel(subject, hand, channel, line, rng))
    return found


def _channel(
    subject: Subject, hand: Tool, channel: str, line: Line, rng: np.random.Generator
) -> BenchChannel:
    band, friction, wave, noise, step = SENSORS[subject.name]
    slope = line.slope[0] * (1.0 + SLOPES[subject.name] * rng.uniform(-1.0, 1.0))
    zero = line.zero[0] + 8.0 * rng.standard_normal()
    half = 0.5 * band * rng.random()
    own, scale = hand.own * rng.standard_normal(), hand.scale * rng.standard_normal()
    phase, family = rng.uniform(0.0, 6.0), subject.channels
    settings = np.array(subject.positions, dtype=float)
    span = np.abs(settings).max()
    shape = wave * np.sin(np.pi * settings / span + phase)
    # The true line is the one through the true curve at these settings.
    trend = np.polyfit(settings, shape, 1)
    shape = shape - np.polyval(trend, settings)
    held = []
    for repeat in range(1, subject.repeats + 1):
        placing = hand.placing * rng.standard_normal()
        drift = 0.1 * SUPPLY * rng.standard_normal()
        last = float(settings[0])
        for index, setting in enumerate(settings):
            true = setting * (1.0 + scale) + own + placing + hand.reading * rng.standard_normal()
            side = float(np.sign(setting - last)) or float(rng.choice([-1.0, 1.0]))
            last = setting
            at = zero + hand.value(true) / slope + half * side
            at += shape[index] + friction * rng.uniform(-1.0, 1.0)
            at += drift * (at - 512.0) * (subject.table == "channel")
            samples = step * np.round((at + noise * rng.standard_normal(SAMPLES)) / step)
            readings = {c: float(line.zero[0] + rng.normal(0.0, 0.05)) for c in family}
            readings[channel] = float(samples.mean())
            held.append(
                Held(channel, repeat, float(setting), readings, {channel: float(samples.std())})
            )
    if subject.name == "pitots":
        held.insert(0, _leak_test(channel, zero, slope, hand, 0.0, rng))
    truth = Truth(zero, slope, zero + half * rng.uniform(-1.0, 1.0))
    return BenchChannel(subject, channel, truth, tuple(held))


@dataclass(frozen=True, slots=True)
class BenchImu:
    """An IMU's truth, (3,) each, SI, and what its six faces, rests and turns read."""

    accel_zero: Array
    accel_slope: Array
    gyro_zero: Array
    gyro_slope: Array
    faces: tuple[Held, ...]
    rests: tuple[Rest, ...]
    turns: tuple[Turn, ...]


def bench_imu(rng: np.random.Generator, careless: float = 1.0) -> BenchImu:
    """Return one IMU, calibrated by one person on a cube and on a table that turns by hand."""
    care = careless * float(np.sqrt(hand_worth() / rng.chisquare(hand_worth())))
    known = subjects()
    cube, rest = known["accelerometers"].tool, known["gyros"].tool
    table = known["gyros"].turntable
    assert cube is not None and rest is not None and table is not None
    zero, slope = rng.uniform(-0.5, 0.5, 3), 1.0 + rng.uniform(-0.02, 0.02, 3)
    gyro_zero, gyro_slope = rng.uniform(-0.01, 0.01, 3), 1.0 + rng.uniform(-0.02, 0.02, 3)
    now = zero + cube.own * rng.standard_normal(3)
    scale = 1.0 + cube.scale * rng.standard_normal(3)
    faces = []
    for repeat in range(1, known["accelerometers"].repeats + 1):
        warm = now + care * cube.placing * rng.standard_normal(3)
        for face in FACES:
            axis, sign = AXES.index(face[1]), 1.0 if face[0] == "+" else -1.0
            lean = 0.2 * RAD_PER_DEG * rng.standard_normal(3)
            force = GRAVITY_MPS2 * lean
            force[axis] = sign * GRAVITY_MPS2 * np.sqrt(1.0 - float(np.sum(lean**2)))
            error = care * cube.reading * rng.standard_normal(3)
            raw = warm + force * scale / slope + error
            noise = (0.05,) * len(FORCES)
            faces.append(face_held(face, repeat, raw.tolist(), GRAVITY_MPS2, noise))
    rests, turns = _turned(rng, care, (gyro_zero, gyro_slope))
    return BenchImu(zero, slope, gyro_zero, gyro_slope, tuple(faces), rests, turns)


def _turned(
    rng: np.random.Generator, care: float, truth: tuple[Array, Array]
) -> tuple[tuple[Rest, ...], tuple[Turn, ...]]:
    subject = subjects()["gyros"]
    rest, table = subject.tool, subject.turntable
    assert rest is not None and table is not None
    zero = truth[0] + rest.own * RAD_PER_DEG * rng.standard_normal(3)
    scale = 1.0 + table.scale * rng.standard_normal(3)
    rests, turns = [], []
    for repeat in range(1, subject.repeats + 1):
        now = zero + care * rest.placing * RAD_PER_DEG * rng.standard_normal(3)
        for axis in range(3):
            for sign in (1.0, -1.0):
                still = now + care * rest.reading * RAD_PER_DEG * rng.standard_normal(3)
                rests.append(Rest(repeat, _three(still)))
                angle = sign * 3600.0 * RAD_PER_DEG
                seconds = float(rng.uniform(18.0, 30.0))
                turned = angle + care * table.reading * RAD_PER_DEG * rng.standard_normal()
                rates = now + care * rest.reading * RAD_PER_DEG * rng.standard_normal(3)
                rates[axis] += turned * scale[axis] / truth[1][axis] / seconds
                turns.append(Turn(repeat, axis, angle, seconds, _three(rates)))
    return tuple(rests), tuple(turns)


def _three(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _leak_test(
    channel: str, zero: float, slope: float, tool: Tool, rate: float, rng: np.random.Generator
) -> Held:
    """Return 40 mm held for 60 s; rate: share that leaks per second."""
    rise = tool.value(40.0) / slope
    change = -rate * rise + 2e-3 * rng.standard_normal()  # the sensor warms: 0.1 counts a minute
    return Held(
        channel, 1, 40.0, {channel: zero + rise}, {}, change={channel: change}, duration_s=60.0
    )


def broken(
    channels: Sequence[BenchChannel], fault: str, rng: np.random.Generator
) -> tuple[list[BenchChannel], str]:
    """Return the same bench with one fault, and the channel that has it."""
    out = list(channels)
    index = int(rng.choice([i for i, c in enumerate(out) if c.subject.name == _FAMILY[fault]]))
    one = out[index]
    name, slope = one.channel, one.truth.slope
    if fault == "worn_pot":
        bad = float(rng.choice([p for p in set(one.subject.positions) if abs(p) < 20]))
        off = float(rng.uniform(15.0, 60.0)) * rng.choice([-1.0, 1.0])
        held = [_moved(p, name, off + rng.normal(0.0, 3.0), p.position == bad) for p in one.held]
    elif fault == "noisy_pot":
        bad = float(rng.choice(list(set(one.subject.positions))))
        loud = float(rng.uniform(5.0, 20.0))
        held = [
            replace(p, noise={name: loud * rng.uniform(0.7, 1.3)}) if p.position == bad else p
            for p in one.held
        ]
    elif fault == "slipped_vane":
        slip = float(rng.uniform(3.0, 8.0)) * RAD_PER_DEG / slope * rng.choice([-1.0, 1.0])
        held = [_moved(p, name, slip, p.repeat > 1) for p in one.held]
    elif fault == "swapped_pair":
        other = one.subject.channels[one.subject.channels.index(name) ^ 1]
        held = [replace(p, readings=_swapped(p.readings, name, other), noise={}) for p in one.held]
    else:
        rate = float(rng.uniform(2.0, 10.0)) * one.subject.limits["leak"]
        tool = one.subject.tool
        assert tool is not None
        held = [_leak_test(name, one.truth.zero, slope, tool, rate, rng), *one.held[1:]]
    out[index] = replace(one, held=tuple(held))
    return out, name


_FAMILY = {
    "worn_pot": "pots",
    "noisy_pot": "pots",
    "slipped_vane": "vanes",
    "swapped_pair": "vanes",
    "leaking_tube": "pitots",
}


def _moved(point: Held, channel: str, counts: float, here: bool) -> Held:
    if not here:
        return point
    return replace(point, readings={**point.readings, channel: point.readings[channel] + counts})


def _swapped(readings: object, one: str, other: str) -> dict[str, float]:
    assert isinstance(readings, dict)
    return {**readings, one: readings[other], other: readings[one]}
