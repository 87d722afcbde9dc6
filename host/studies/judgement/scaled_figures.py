"""Figures of one world with their sampling errors, flights drawn anew with replacement."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from host.arrays import Array, BoolArray
from host.constants import NORMAL_95

from studies.judgement.interval_score import Judged, interval_score

SCALES = Path(__file__).with_name("scales.csv")
SCALE_COLUMNS = ("world", "name", "estimates", "rms_error")
DRAWS, SEED = 400, 45
MOST = 1.0  # error and half-width that tell no more than +-100 %


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure and its 95 % interval by flights; NaN of a single flight."""

    value: float
    low: float = float("nan")
    high: float = float("nan")

    def __str__(self) -> str:
        """Return the figure and half of its interval."""
        half = round(0.5 * (self.high - self.low), 9)
        if np.isnan(self.value):
            return "-"
        return f"{self.value:.3g}" + ("" if np.isnan(half) else f" +- {half:.2g}")


def shares(own: Judged) -> dict[str, BoolArray]:
    """Return what each parameter is, one of these, as shares that sum to one."""
    right, relied = own.right, own.relied
    between = relied & ~right & ~own.wrong
    return {
        "right, trust": right & own.trusted,
        "right, care": right & own.careful,
        "right, refused": right & ~relied,
        "wrong, trust": own.wrong & own.trusted,
        "wrong, care": own.wrong & own.careful,
        "care, 10 to 30 % off": between,
        "refused": own.answered & ~relied & ~right,
        "missing": ~own.answered,
    }


def figures(own: Judged, scale: Mapping[str, float]) -> dict[str, Figure]:
    """Return every figure of a group of parameters of one world.

    Parameters
    ----------
    own : Judged
    scale : mapping
        Name to the rms error that its score is divided by.
    """
    flights = np.unique(own.flight)
    place = np.searchsorted(flights, own.flight)
    rng = np.random.default_rng(SEED)
    drawn = rng.integers(0, len(flights), (DRAWS, len(flights)))
    weights = np.array([np.bincount(one, minlength=len(flights)) for one in drawn], dtype=float)

    def figure(of: Callable[[Array], float]) -> Figure:
        value = of(np.ones(len(place)))
        if len(flights) < 2:
            return Figure(value)
        spread = [of(w[place]) for w in weights]
        low, high = np.percentile(spread, [2.5, 97.5]).tolist()
        return Figure(value, low, high)

    def share(part: BoolArray, of: BoolArray) -> Callable[[Array], float]:
        return lambda w: 100.0 * float(np.sum(w * (part & of))) / max(float(np.sum(w * of)), 1e-300)

    def share_figure(part: BoolArray, of: BoolArray) -> Figure:
        return _never_certain(figure(share(part, of)), len(np.unique(own.flight[of])))

    every = np.ones(len(place), dtype=bool)
    found = {name: share_figure(part, every) for name, part in shares(own).items()}
    found["relied on of right"] = share_figure(own.relied, own.right)
    found["coverage"] = share_figure(own.holds, own.answered)
    by = np.array([scale.get(n, np.nan) for n in own.name])
    score = own.score() / by
    found["score"] = figure(lambda w: float(np.sum(w * score) / np.sum(w)))
    found["honesty"] = figure(_honesty(own))
    return found


def _never_certain(share: Figure, flights: int) -> Figure:
    """Return a share whose interval is that of no exception in these flights, at least.

    Drawn anew, flights that all agree always agree: 1 - 0.05^(1/n) is as likely (rule of three).
    """
    least = 100.0 * (1.0 - 0.05 ** (1.0 / max(flights, 1)))
    low = min(share.low, 100.0 - least) if share.value >= 100.0 else share.low
    return Figure(share.value, low, max(share.high, least) if share.value <= 0.0 else share.high)


def _honesty(own: Judged) -> Callable[[Array], float]:
    """Return the score of the widths over that of 1.96 rms errors, mean over parameters."""
    parts = []
    for name in np.unique(own.name):
        mine = np.flatnonzero((own.name == name) & own.answered)
        error, width = (np.minimum(x[mine], MOST) for x in (own.error, own.width))
        parts.append((mine, error, width))

    def ratio(w: Array) -> float:
        found, count = 0.0, 0.0
        for mine, error, width in parts:
            weight = w[mine]
            if (total := float(np.sum(weight))) > 0.0:
                rms = float(np.sqrt(np.sum(weight * error**2) / total))
                ideal = interval_score(error, np.full(len(error), NORMAL_95 * rms))
                own = interval_score(error, width)
                found += float(np.sum(weight * own) / max(np.sum(weight * ideal), 1e-300))
                count += 1.0
        return found / count if count else float("nan")

    return ratio


def rms_errors(own: Judged) -> dict[str, float]:
    """Return the rms error of each parameter that was answered, +-100 % at most; else one."""
    found = {}
    for name in np.unique(own.name):
        error = np.minimum(own.error[(own.name == name) & own.answered], MOST)
        found[str(name)] = float(np.sqrt(np.mean(error**2))) if len(error) else MOST
    return found


def read_scales(path: Path = SCALES) -> dict[str, dict[str, float]]:
    """Return the rms error of each name by world."""
    found: dict[str, dict[str, float]] = {}
    if path.exists():
        with path.open(newline="") as file:
            for row in csv.DictReader(file):
                found.setdefault(row["world"], {})[row["name"]] = float(row["rms_error"])
    return found


def write_scales(worlds: Mapping[str, Judged], path: Path = SCALES) -> None:
    """Write the scales that these flights give."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(SCALE_COLUMNS)
        for world, own in worlds.items():
            for name, rms in rms_errors(own).items():
                answered = int(np.sum((own.name == name) & own.answered))
                writer.writerow((world, name, answered, f"{rms:.4g}"))
