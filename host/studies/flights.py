"""Virtual flights through the whole chain: are maneuvers found, and do derivatives hold the truth?

Every flight is flown by `host simulate` with its own seed, all tolerances drawn; windows and
derivatives are compared with the truth file of the log. Seeds below 200 were looked at while
the finder was written; the study starts at 200.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from host.errors import IdentificationError
from host.sysid.answer import read_truth, true_coefficients
from host.sysid.flight import read_columns
from host.sysid.maneuvers import DetectedManeuver, detect_maneuvers
from host.sysid.pipeline import at_hand, identify_columns

FIRST_SEED = 200
OVERLAP = 0.8
CARDS = ("demo", "multisine", "survey", "sweep", "calm")
PRINCIPAL = (
    "CL_alpha", "CL_de", "Cm_alpha", "Cm_q", "Cm_de", "CD_0", "CY_beta", "CY_dr", "Cl_beta", "Cl_p",
    "Cl_r", "Cl_da", "Cn_beta", "Cn_p", "Cn_r", "Cn_dr",
)  # fmt: skip


@dataclass(slots=True)
class Tally:
    """Counts over flights; relative errors, half-widths and coverage per coefficient."""

    maneuvers: int = 0
    found: int = 0
    false: int = 0
    minutes: float = 0.0
    failed: int = 0
    error: dict[str, list[float]] = field(default_factory=dict)
    half: dict[str, list[float]] = field(default_factory=dict)
    covered: dict[str, list[bool]] = field(default_factory=dict)
    flagged: dict[str, list[bool]] = field(default_factory=dict)

    def add(
        self,
        name: str,
        truth: float,
        value: float,
        half: float,
        *,
        flagged: bool,
        size: float | None = None,
    ) -> None:
        """Count one coefficient of one flight; `size` is what its error is relative to."""
        size, miss = abs(truth) if size is None else size, value - truth
        self.error.setdefault(name, []).append(miss / size)
        self.half.setdefault(name, []).append(half / size)
        self.covered.setdefault(name, []).append(abs(miss) <= half)
        self.flagged.setdefault(name, []).append(flagged)

    def lines(self) -> list[str]:
        """Return the table, and below it what the whole of it comes to."""
        lines = []
        for name in self.error:
            error, half = np.array(self.error[name]), np.array(self.half[name])
            lines.append(
                f"  {name:9s} median error {100.0 * np.median(np.abs(error)):5.1f} %"
                f"  mean {100.0 * error.mean():+6.1f} %  worst {100.0 * np.abs(error).max():5.1f} %"
                f"  median half-width {100.0 * np.median(half):5.1f} %"
                f"  covered {100.0 * np.mean(self.covered[name]):5.1f} %"
                f"  flagged {100.0 * np.mean(self.flagged[name]):5.1f} %"
            )
        if not lines:
            return lines
        close = sum(float(np.median(np.abs(e))) <= 0.05 for e in self.error.values())
        narrow = sum(float(np.median(h)) <= 0.10 for h in self.half.values())
        cases = [
            (abs(e), c, g)
            for n in self.error
            for e, c, g in zip(self.error[n], self.covered[n], self.flagged[n], strict=True)
        ]
        wild = sum(e > 0.15 and not g for e, _, g in cases)
        lines.append(
            f"  {close} of {len(self.error)} medians within 5 %, {narrow} half-widths within 10 %;"
            f" of {len(cases)} cases {100.0 * np.mean([c for _, c, _ in cases]):.1f} % covered,"
            f" {100.0 * np.mean([g for _, _, g in cases]):.1f} % flagged,"
            f" {wild} beyond 15 % without a flag"
        )
        return lines


def overlap(found: DetectedManeuver, maneuver: dict[str, Any], clock: float) -> float:
    """Return intersection over union of a found window and a true one, 0 on another axis."""
    if not any(found.axis.startswith(axis) for axis in maneuver["axes"]):
        return 0.0
    first, last = maneuver["start_s"] * clock, maneuver["end_s"] * clock
    both = min(found.end_s, last) - max(found.start_s, first)
    union = max(found.end_s, last) - min(found.start_s, first)
    return float(max(both, 0.0) / union)


def add_flight(tally: Tally, folder: Path, *, fit: bool, aircraft: str = "ultrastick25e") -> None:
    """Judge one flight in a folder of `host simulate --firmware none`."""
    truth = read_truth(folder / "flight.truth.toml")
    columns, _ = read_columns(folder / "flight.csv")
    clock = 1.0 + float(truth["drawn"]["clock_share"])
    found = detect_maneuvers(columns)
    best = np.array([[overlap(f, m, clock) for f in found] for m in truth["maneuver"]])
    tally.maneuvers += len(best)
    tally.found += int(np.sum(best.max(axis=1, initial=0.0) >= OVERLAP))
    tally.false += int(np.sum(best.max(axis=0, initial=0.0) == 0.0))
    tally.minutes += float(truth["duration_s"]) / 60.0
    if not fit:
        return
    try:
        answers = identify_columns(at_hand(columns, aircraft=aircraft)).linear
    except IdentificationError:
        tally.failed += 1
        return
    for answer in answers:
        expected = true_coefficients(truth, answer.template)
        for c in answer.coefficients:
            if c.name in PRINCIPAL:
                tally.add(c.name, expected[c.name], c.value, c.half_width, flagged=False)


def main(arguments: list[str] | None = None) -> int:
    """Fly, judge, print."""
    from host.cli import main as host

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=3, help="seeds per card")
    parser.add_argument("--card", choices=CARDS, action="append")
    parser.add_argument("--no-fit", action="store_true", help="only find maneuvers")
    options = parser.parse_args(arguments)
    write = sys.stdout.write
    for card in options.card or CARDS[:2]:
        tally = Tally()
        for seed in range(FIRST_SEED, FIRST_SEED + options.flights):
            with tempfile.TemporaryDirectory() as folder:
                flags = ["--seed", str(seed), "--firmware", "none", "--no-picture", "-o", folder]
                with contextlib.redirect_stdout(io.StringIO()):
                    status = host(["simulate", card, *flags])
                if status:
                    raise IdentificationError(f"host simulate {card} ended with {status}")
                add_flight(tally, Path(folder), fit=not options.no_fit)
        write(
            f"{card}: {tally.found} of {tally.maneuvers} windows overlap by {OVERLAP} or more,"
            f" {tally.false} false in {tally.minutes:.1f} min; {tally.failed} fits failed\n"
        )
        write("".join(f"{line}\n" for line in tally.lines()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
