"""Cut the power at random instants of flight, of preparing and of closing a file.

    make power-cuts                       300 instants of flight, all metadata, 30 reboots
    make power-cuts CUTS="--flight 30 --step 40 --reboots 6"

Simulation only. A cut takes everything that comes after it: so one run of the simulated chip, with
every block the card programmed and when, gives the card of any instant. In two of four flights a
row holds bank and pitch; no boot goes on with it. The next boot is judged as the pilot has it, with
nothing repaired. The reboots are true cuts: they check that this is so.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
from flight.cut_boots import CLUSTER_KILOBYTES, cut_everywhere, write_on_the_ground
from flight.cut_flight import PAYLOAD, Flight, FlightCuts, Plan, fly, make_base
from flight.cut_reboot import BOOTS, RebootBench, RebootResult, compare_with, spread
from flight.images import build_image
from simavr_bench import CardKind

# Cards of 4 to 32 GB come with clusters of 64 blocks; those of up to 2 GB are addressed in bytes.
LARGE = (CardKind.SDHC, 2100, 64)
SMALL = (CardKind.SDSC, 300, 8)
PLANS = (
    Plan("100 Hz, SDHC, a row holds", *LARGE, holds=True),
    Plan("200 Hz, SDSC", *SMALL, rate_hz=200),
    Plan("100 Hz, stalls of 500 ms", *LARGE, stall_s=0.5),
    Plan("200 Hz, stalls, holds", *SMALL, rate_hz=200, stall_s=0.25, holds=True),
)


def cut_flight(flight: Flight, count: int, folder: Path, seed: int) -> int:
    """Cut a flight, print a row for each state of the card; gives the number of wrong cuts."""
    cuts = FlightCuts(flight, folder, seed=seed)
    rng = np.random.default_rng(seed)
    number: Counter[str] = Counter()
    worst: Counter[str] = Counter()
    bad = 0
    for cycle in np.sort(rng.integers(flight.begin, flight.end, count)):
        result = cuts.judge(int(cycle))
        number[result.state] += 1
        worst[result.state] = max(worst[result.state], result.lost_bytes)
        bad += bool(result.wrong)
        for text in result.wrong:
            print(f"    cut at {cycle / 16e6:.6f} s: {text}")
    for state in sorted(number):
        blocks = worst[state] / PAYLOAD
        print(f"  {flight.plan.name:26} {state:8} {number[state]:5} {blocks:12.1f}", flush=True)
    return bad


def cut_metadata(
    elf: Path, kilobytes: int, folder: Path, *, every: int, on_chip: int, seed: int
) -> tuple[int, int, float]:
    """Cut closing and preparing, print a row; gives cuts, wrong ones, the lowest gate voltage."""
    run = write_on_the_ground(elf, kilobytes, folder)
    results = list(cut_everywhere(elf, run, folder, every=every, on_chip=on_chip, seed=seed))
    for result in results:
        for text in result.wrong:
            how = "within" if result.garbage else "before"
            print(f"    {kilobytes} kB, {how} write {result.write}: {text}")
    bad = sum(bool(result.wrong) for result in results)
    flown = [result.beats for result in results if result.beats is not None]
    gate_volt = min((beats.gate_volt for beats in flown), default=float("inf"))
    rest_ms = 1e3 * max((beats.rest_s for beats in flown), default=0.0)
    print(
        f"  {kilobytes:5} kB {len(run.writes):8} {len(results):6} {len(flown):8} "
        f"{rest_ms:12.2f} {gate_volt:8.2f} {bad:7}",
        flush=True,
    )
    return len(results), bad, gate_volt


def reboot(bench: RebootBench, count: int, seed: int) -> int:
    """Cut and boot again, print a row for each kind of boot; gives the number of wrong ones."""
    results: dict[str, list[RebootResult]] = {boot.name: [] for boot in BOOTS}
    for wait, boot in spread(count, seed):
        result = bench.cut(wait, boot)
        results[boot.name].append(result)
        for text in result.wrong:
            print(f"    {wait / 16e6:.6f} s, {boot.name}: {text}")
    for name, rows in results.items():
        if not rows:
            continue
        block_s = max(r.first_block_s for r in rows)
        metadata_s = min(r.first_metadata_s for r in rows)
        print(f"  {name:34} {len(rows):5} {block_s:10.2f} {metadata_s:10.2f}", flush=True)
    return sum(bool(r.wrong) for rows in results.values() for r in rows)


def share(count: int, parts: int) -> list[int]:
    """Split a number into nearly equal parts."""
    return [(count + k) // parts for k in range(parts)]


def run_flights(elf: Path, count: int, seed: int, folder: Path) -> tuple[int, list[Flight]]:
    """Fly every plan and cut it."""
    print("flight                     card      cuts  lost blocks (most)")
    bad, flights = 0, []
    for k, (plan, cuts) in enumerate(zip(PLANS, share(count, len(PLANS)), strict=True)):
        base = make_base(plan, folder / f"base{k}.img", seed + k)
        flight = fly(elf, plan, base, seed=seed + k)
        flights.append(flight)
        for text in flight.beats.wrong():
            print(f"    {plan.name}: {text}")
            bad += 1
        bad += cut_flight(flight, cuts, folder, seed + k)
    return bad, flights


def run_metadata(elf: Path, folder: Path, *, every: int, seed: int) -> tuple[int, int]:
    """Cut at every write of metadata, clusters of each size; gives cuts and wrong ones."""
    print("\nmetadata    writes   cuts  on chip  longest rest     gate   wrong   (ms, V)")
    cuts = bad = 0
    for kilobytes in CLUSTER_KILOBYTES:
        on_chip = 16 if kilobytes == 4 else 2
        more, wrong, _ = cut_metadata(
            elf, kilobytes, folder, every=every, on_chip=on_chip, seed=seed + kilobytes
        )
        cuts += more
        bad += wrong
    return cuts, bad


def run_reboots(elf: Path, flight: Flight, count: int, seed: int, folder: Path) -> int:
    """Cut truly, boot again."""
    print("\nnext boot                           cuts   block, s   metadata, s after power-on")
    bench = RebootBench.take_off(elf, flight.plan, flight.base, folder, seed=seed)
    differs = compare_with(flight, bench)
    if differs:
        print(f"    {differs}")
    return bool(differs) + reboot(bench, count, seed)


def main() -> int:
    """Print the tables; 0 if every cut left what it must, else 6."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--flight", type=int, default=300, help="cuts in flight (default 300)")
    parser.add_argument("--step", type=int, default=1, help="writes of metadata to the next cut")
    parser.add_argument("--reboots", type=int, default=30, help="true cuts (default 30)")
    parser.add_argument("--seed", type=int, default=1, help="default 1")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # Its own copy: a build meanwhile would make the reboots another program's.
        elf = Path(shutil.copy(build_image("mega2560"), folder / "firmware.elf"))
        bad, flights = run_flights(elf, options.flight, options.seed, folder)
        cuts, wrong = run_metadata(elf, folder, every=options.step, seed=options.seed)
        bad += wrong
        bad += run_reboots(elf, flights[0], options.reboots, options.seed, folder)
    total = options.flight + cuts + options.reboots
    print(f"\n{total} cuts, seed {options.seed}: {bad} left what they must not")
    return 6 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
