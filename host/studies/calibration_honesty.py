"""Two hundred virtual instruments calibrated on the bench: do stated deviations hold the truth?

In host/, `python -m studies.calibration_honesty` prints the tables of calibration.md: coverage of
zero and slope pooled over all channels, faults that were named, healthy instruments accused.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from host.bench_calibration.bench_plan import subjects
from host.bench_calibration.calibrated_lines import Calibrated, calibrated_lines
from host.bench_calibration.calibration_file import Made, lines_of
from host.bench_calibration.six_faces import crooked_deg, crooked_doubt
from host.bench_calibration.turned_gyro import gyro_lines
from host.constants import NORMAL_95

from studies.bench_instruments import (
    FAULTS,
    LINES,
    BenchChannel,
    BenchImu,
    bench_channels,
    bench_imu,
    broken,
)

FIRST_SEED = 6000  # 1-400 were looked at while this was written, 5000-5199 before curves
INSTRUMENTS = 200
# Words that name a fault; the sentence must also name the channel.
NAMED = {
    "worn_pot": "worn",
    "noisy_pot": "worn",
    "slipped_vane": "slipped",
    "swapped_pair": "swapped",
    "leaking_tube": "leaking tube",
}


@dataclass
class Tally:
    """Errors over stated deviations by subject; faults named; healthy instruments accused."""

    zero: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    slope: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    named: Counter[str] = field(default_factory=Counter)
    instruments: int = 0
    accused: int = 0
    sentences: list[str] = field(default_factory=list)

    def covered(self, *names: str) -> tuple[int, int]:
        """Return how many of the truths are inside the stated 95 %, and of how many."""
        every = [e for n in names for e in (*self.zero[n], *self.slope[n])]
        return sum(abs(e) <= NORMAL_95 for e in every), len(every)


def study(seeds: Iterable[int], careless: float = 1.0) -> Tally:
    """Calibrate an instrument for each seed, healthy and with each fault."""
    tally = Tally()
    for seed in seeds:
        rng = np.random.default_rng(seed)
        channels, imu = bench_channels(rng, careless), bench_imu(rng, careless)
        healthy = [_count_line(tally, one) for one in channels] + _count_imu(tally, imu)
        doubts = [text for text in healthy if text]
        tally.instruments += 1
        tally.accused += bool(doubts)
        tally.sentences += doubts
        for fault in FAULTS:
            bench, name = broken(channels, fault, rng)
            (sick,) = [one for one in bench if one.channel == name]
            text = _one(sick).doubt or ""
            found = NAMED[fault] in text and text.startswith(name)
            tally.named[fault] += found
            if not found:
                tally.sentences.append(f"seed {seed}: {fault} of {name}: {text or 'not noticed'}")
    return tally


def _one(channel: BenchChannel) -> Calibrated:
    (found,) = calibrated_lines(channel.subject, channel.held)
    return found


def _count_line(tally: Tally, channel: BenchChannel) -> str | None:
    found, truth, name = _one(channel), channel.truth, channel.subject.name
    if found.fit is not None:
        fit = found.fit
        tally.zero[name].append((fit.zero - truth.zero_in_flight) / fit.zero_sigma)
        tally.slope[name].append((fit.slope / truth.slope - 1.0) / fit.slope_sigma)
    return found.doubt


def _count_imu(tally: Tally, imu: BenchImu) -> list[str | None]:
    """Count the two lines of an IMU as its file states them: one deviation for three axes."""
    known, made = subjects(), Made("virtual", "2026-11-23")
    faces = calibrated_lines(known["accelerometers"], imu.faces)
    turned = gyro_lines(known["gyros"], imu.rests, imu.turns)
    for name, key, lines, zero, slope in (
        ("accelerometers", "accel", faces, imu.accel_zero, imu.accel_slope),
        ("gyros", "gyro", turned, imu.gyro_zero, imu.gyro_slope),
    ):
        entry = lines_of(known[name], lines, made).get(key)
        if entry is None:
            continue
        errors = (np.array(entry["zero"]) - zero) / entry["zero_sigma"]
        tally.zero[name] += errors.tolist()
        shares = (np.array(entry["slope"]) / slope - 1.0) / entry["slope_sigma"]
        tally.slope[name] += shares.tolist()
    crooked = crooked_doubt(known["accelerometers"], crooked_deg(imu.faces, faces))
    return [*(c.doubt for c in (*faces, *turned)), crooked]


def report(tally: Tally) -> list[str]:
    """Return the tables of the page."""
    names = (*LINES, "accelerometers", "gyros")
    said = [
        "| subject | lines | zero inside % | slope inside % | rms of zero | rms of slope |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name in names:
        zero, slope = np.array(tally.zero[name]), np.array(tally.slope[name])
        said.append(
            f"| {name} | {len(zero)} | {_inside(zero):.1f} | {_inside(slope):.1f}"
            f" | {_rms(zero):.2f} | {_rms(slope):.2f} |"
        )
    inside, count = tally.covered(*names)
    said.append(f"\npooled: {inside} of {count}, {100.0 * inside / count:.2f} %")
    said.append(f"healthy instruments accused: {tally.accused} of {tally.instruments}")
    said += [f"{f}: named in {tally.named[f]} of {tally.instruments}" for f in FAULTS]
    return said + tally.sentences[:20]


def _inside(errors: np.ndarray) -> float:
    return 100.0 * float(np.mean(np.abs(errors) <= NORMAL_95))


def _rms(errors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    parser.add_argument("--instruments", type=int, default=INSTRUMENTS)
    parser.add_argument("--careless", type=float, default=1.0, help="times the tools' word")
    options = parser.parse_args(arguments)
    seeds = range(options.first, options.first + options.instruments)
    sys.stdout.write("\n".join(report(study(seeds, options.careless))) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
