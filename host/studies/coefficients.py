"""Coefficients straight from virtual flights through the recorder: errors, intervals, flags.

Every flight is flown with its own seed, all tolerances drawn, light turbulence; maneuvers as the
host finds them. The truth is local to the maneuvers. The same flights as the thesis's logger saw
them (20 rows a second), fitted by its network, are compared. Seeds below 1000 were looked at while
the fit was written; the study starts there.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from host.arrays import Array
from host.constants import NORMAL_95
from host.errors import IdentificationError
from host.readers.even_grid import even_columns
from host.sysid.answer import true_coefficients
from host.sysid.coefficients import CoefficientAnswer
from host.sysid.maneuvers import DetectedManeuver
from host.sysid.pipeline import at_hand, identify_columns
from host.twin.sensors.sensor_delays import dlpf_for, sensor_delays
from host.twin.testcard.cards import load
from host.twin.virtual import VirtualFlight, virtual_flight

from studies.flights import PRINCIPAL, Tally

FIRST_SEED = 1000
AIRCRAFT = "ultrastick25e"
THESIS_HZ = 20.0  # rows of its second flight
NETWORK = {
    "hopfield": "its network, 200 000 steps",
    "equation-error": "where its network would end",
}
MODES = {"short_period": "elevator", "dutch_roll": "rudder"}
Numbers = list[tuple[float, float]]


@dataclass(slots=True)
class CoefficientTally:
    """Coefficients of many flights, modes and delays as error and half-width; the thesis too."""

    coefficients: Tally = field(default_factory=Tally)
    frequency: dict[str, Numbers] = field(default_factory=dict)  # relative
    damping: dict[str, Numbers] = field(default_factory=dict)
    delay: dict[str, Numbers] = field(default_factory=dict)  # s
    thesis: dict[str, Tally] = field(default_factory=dict)

    def add(self, answer: CoefficientAnswer, flight: VirtualFlight) -> None:
        """Count one flight."""
        maneuvers: list[dict[str, Any]] = list(flight.maneuvers)
        expected = truths(maneuvers)
        for d in answer.fit.derivatives:
            if d.name in expected:
                self.coefficients.add(
                    d.name, expected[d.name], d.value, d.half_width, flagged=d.flagged
                )
        for name, axis in MODES.items():
            true = [m["modes"][name] for m in maneuvers if axis in m["axes"] and name in m["modes"]]
            own = [m for m in answer.modes if m.name.replace(" ", "_") == name]
            if true and own:
                frequency, damping = np.mean(true, axis=0).tolist()
                mode = own[0]
                self.frequency.setdefault(name, []).append(
                    (
                        mode.frequency_radps / frequency - 1.0,
                        NORMAL_95 * mode.frequency_sd_radps / frequency,
                    )
                )
                self.damping.setdefault(name, []).append(
                    (mode.damping - damping, NORMAL_95 * mode.damping_sd)
                )
        late = true_delays(flight)
        for name, (value, half) in answer.delays.items():
            self.delay.setdefault(name, []).append((value - late[name], half))

    def lines(self) -> list[str]:
        """Return all tables as text."""
        lines = self.coefficients.lines()
        for title, unit, scale, table in (
            ("frequency", "%", 100.0, self.frequency),
            ("damping", "", 1.0, self.damping),
            ("residual delay", "ms", 1e3, self.delay),
        ):
            for name, pairs in table.items():
                miss, half = scale * np.array(pairs).T
                lines.append(
                    f"  {title} {name}: median error {np.median(np.abs(miss)):.3f} {unit}, median"
                    f" half-width {np.median(half):.3f} {unit}, covered"
                    f" {100.0 * np.mean(np.abs(miss) <= half):.0f} %"
                )
        for method, tally in self.thesis.items():
            lines.append(f"the thesis's logger, {NETWORK[method]}; {tally.failed} fits failed")
            for name, errors in tally.error.items():
                lines.append(
                    f"  {name:9s} median error {100.0 * np.median(np.abs(errors)):8.1f} %"
                    f"  mean {100.0 * np.mean(errors):+8.1f} %"
                )
        return lines


def truths(maneuvers: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Return the principal derivatives, mean over the maneuvers of their axis."""
    document = {"maneuver": list(maneuvers)}
    along = true_coefficients(document, "longitudinal")
    across = true_coefficients(document, "lateral")
    return {n: (along if n[:2] in ("CL", "CD", "Cm") else across)[n] for n in PRINCIPAL}


def true_delays(flight: VirtualFlight) -> dict[str, float]:
    """Return the remainder of each delay after the nominal one is removed (s)."""
    record = flight.record
    dlpf = dlpf_for(record.card.flight.rate_hz)
    nominal_draws = replace(
        record.draws, values={k: 0.0 * v for k, v in record.draws.values.items()}
    )
    own, nominal = (sensor_delays(record.aircraft, d, dlpf) for d in (record.draws, nominal_draws))
    rest = {k: own[k] - nominal[k] for k in own}
    return {
        "delay_imu_s": 0.5 * (rest["gyro"] + rest["accelerometer"]),
        "delay_alpha_s": 0.5 * (rest["alpha_a"] + rest["alpha_b"]),
        "delay_beta_s": 0.5 * (rest["beta_a"] + rest["beta_b"]),
    }


def study(card: str, seeds: range, *, thesis: bool) -> CoefficientTally:
    """Fly, fit and compare.

    Parameters
    ----------
    card : str
    seeds : range
    thesis : bool
        Also as the thesis's logger and method saw the flights.
    """
    result = CoefficientTally()
    if thesis:
        result.thesis = {name: Tally() for name in NETWORK}
    for seed in seeds:
        flight = virtual_flight(card, seed)
        columns, _ = even_columns(flight.table)
        try:
            result.add(direct_answer(columns), flight)
        except IdentificationError:
            result.coefficients.failed += 1
        for method, tally in result.thesis.items():
            add_thesis(tally, card, seed, method)
    return result


def direct_answer(columns: Mapping[str, Array]) -> CoefficientAnswer:
    """Return the coefficients of `host identify --model coefficients`.

    Raises
    ------
    IdentificationError
        If they cannot be estimated.
    """
    found = identify_columns(at_hand(columns, aircraft=AIRCRAFT), models="coefficients")
    assert found.coefficients is not None
    return found.coefficients


def add_thesis(tally: Tally, card: str, seed: int, method: str) -> None:
    """Fit the same flight from the thesis's rows, windows as they were flown."""
    plan = load(card)
    slow = replace(plan, flight=replace(plan.flight, rate_hz=THESIS_HZ))
    flight = virtual_flight(slow, seed, chain="thesis")
    maneuvers: list[dict[str, Any]] = list(flight.maneuvers)
    expected = truths(maneuvers)
    columns, _ = even_columns(flight.table)
    windows = [
        DetectedManeuver(
            f"{axis}_rad", str(m["kind"]), m["start_s"], m["input_end_s"], m["end_s"], 0.1, 9
        )
        for m in maneuvers
        for axis in m["axes"][:1]
    ]
    for name in ("longitudinal", "lateral"):
        try:
            flown = at_hand(
                columns, aircraft=AIRCRAFT, windows=windows, corrections=False, delays=False
            )
            answers = identify_columns(flown, models=name, methods=method).linear
        except IdentificationError:
            tally.failed += 1
            continue
        for c in answers[0].coefficients:
            if c.name in expected:
                tally.add(c.name, expected[c.name], c.value, c.half_width, flagged=False)


def main(arguments: list[str] | None = None) -> int:
    """Fly, judge, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=24)
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed")
    parser.add_argument("--card", default="survey")
    parser.add_argument("--no-thesis", action="store_true")
    options = parser.parse_args(arguments)
    seeds = range(options.first, options.first + options.flights)
    tally = study(options.card, seeds, thesis=not options.no_thesis)
    sys.stdout.write(
        f"{options.card}: seeds {seeds.start} to {seeds.stop - 1},"
        f" {tally.coefficients.failed} fits failed\n" + "\n".join(tally.lines()) + "\n"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
