"""`make live-bench`: redraws, latency, load and memory of `host live`, and slow viewers.

    python tests/bench/live_bench.py            # all of it, on a quiet machine: about five minutes
    python tests/bench/live_bench.py --only page --seconds 10

A table of figure and limit; exit code 6 if a limit is missed.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import aiohttp
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "host")]

from host.live.live_session import LiveSession  # noqa: E402
from host.live.live_stream import LiveStream  # noqa: E402
from host.live.replay import ReplaySource  # noqa: E402
from host.log import read_log  # noqa: E402
from host.physical.calibration import load_calibration  # noqa: E402

from tests.browser.chromium import Chromium  # noqa: E402
from tests.host.logs import flight, written  # noqa: E402

WARM_UP_S = 5.0
STEPS = 300
# Thirty redraws a second on a clock of the page's own, one frame each: what others do on the
# machine neither drops a redraw nor makes it a larger one.
DRAWING = """(async () => {
  for (let timer = 0; timer < 2000; timer += 1) clearInterval(timer);
  const { History } = await import("./history.js");
  const { Plots } = await import("./plots.js");
  const { PLOTS } = await import("./channels.js");
  const parent = document.getElementById("plots");
  parent.replaceChildren();
  document.body.className = "";
  const names = ["t_s", ...new Set(PLOTS.flatMap((what) => what.series.map(([name]) => name)))];
  const [history, plots] = [new History(names, 30), new Plots(parent)];
  let [clock, row] = [35, 0];
  history.now = () => clock;
  window.drawing = async (steps) => {
    for (let at = 0; at < steps; at += 1) {
      const rows = [];
      for (; row < clock * RATE; row += 1) {
        const [t, noise] = [row / RATE, Math.sin(row * 12.9898) * 0.3];
        rows.push(t, ...names.slice(1).map((_, k) => 9 * Math.sin(t + k) + noise));
      }
      if (rows.length) history.add([0, rows.length / names.length, ...rows]);
      plots.draw(history);
      clock += 1 / 30;
      await new Promise(requestAnimationFrame);
    }
  };
  await drawing(10);
})()"""
TICK_HZ = os.sysconf("SC_CLK_TCK")
ROOT_PROC = Path("/proc")
PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")


@dataclass(frozen=True)
class Figure:
    """One line of the table."""

    name: str
    value: float
    limit: float
    unit: str
    at_least: bool = False

    @property
    def kept(self) -> bool:
        return self.value >= self.limit if self.at_least else self.value <= self.limit

    def line(self) -> str:
        bound = "at least" if self.at_least else "at most"
        state = "ok" if self.kept else "MISSED"
        return f"{self.name:<52}{self.value:>10.1f} {self.unit:<6}{bound} {self.limit:g}  {state}"


@contextlib.contextmanager
def live(folder: Path, *arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run `host live` and give its process and the page's address."""
    process = subprocess.Popen(
        [sys.executable, "-m", "host", "live", *arguments],
        cwd=folder, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stderr is not None
    try:
        for line in process.stderr:
            if found := re.search(r"page: (http\S+)", line):
                yield process, found[1]
                break
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=120)


def processor_s(pid: int) -> float:
    """Return the processor time of a process."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICK_HZ


def family_s(pid: int) -> float:
    """Return the processor time of a process and all below it."""
    below = (ROOT_PROC / str(pid) / "task" / str(pid) / "children").read_text().split()
    return processor_s(pid) + sum(family_s(int(one)) for one in below)


def memory_mb(pid: int) -> float:
    """Return the resident memory of a process."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * PAGE_BYTES / 1e6


def page(folder: Path, rate_hz: int, seconds: float) -> Iterator[Figure]:
    """Measure the page on a replay at a rate."""
    source = f"replay:{folder / 'flight.bin'}"
    with live(folder, source, "--rate", str(rate_hz)) as (process, url), Chromium() as browser:
        shown = browser.open(url)
        shown.wait_for("window.hostLive && hostLive.redraws > 30", 120)
        time.sleep(WARM_UP_S)
        shown.evaluate("hostLive.latencies.length = 0")
        redraws, start_s = shown.evaluate("hostLive.redraws"), time.monotonic()
        used_s, browser_s = processor_s(process.pid), family_s(browser.pid)
        time.sleep(seconds)
        passed_s = time.monotonic() - start_s
        browser_s = family_s(browser.pid) - browser_s
        redraws = shown.evaluate("hostLive.redraws") - redraws
        used_s = processor_s(process.pid) - used_s
        late_ms = np.percentile(shown.evaluate("hostLive.latencies"), 95)
        errors = shown.console_errors
    name = f"replay at {rate_hz} Hz:"
    yield Figure(f"{name} redraws a second", redraws / passed_s, 28.0, "1/s", at_least=True)
    yield Figure(f"{name} sample to redraw, p95", float(late_ms), 100.0, "ms")
    yield Figure(f"{name} server, of a core", 100.0 * used_s / passed_s, 10.0, "%")
    # Processor time of all its processes, which other work on the machine hardly changes.
    yield Figure(
        f"{name} browser, of two cores at 30 redraws", 1500.0 * browser_s / redraws, 90.0, "%"
    )
    yield Figure(f"{name} errors on the console", len(errors), 0, "")


def drawing(folder: Path, rate_hz: int) -> Iterator[Figure]:
    """Measure the processor time of a redraw, all processes of the browser together."""
    (folder / "short.bin").write_bytes(written(*flight(3.0)))
    with live(folder, f"replay:{folder / 'short.bin'}") as (_, url), Chromium() as browser:
        shown = browser.open(url)
        shown.wait_for("window.hostLive && hostLive.rows > 30", 120)
        shown.evaluate(DRAWING.replace("RATE", str(rate_hz)))
        used_s = family_s(browser.pid)
        shown.evaluate(f"drawing({STEPS})")
        used_s = family_s(browser.pid) - used_s
    yield Figure(f"a redraw at {rate_hz} Hz, processor time", 1e3 * used_s / STEPS, 33.0, "ms")


def endurance(folder: Path, hours: float) -> Iterator[Figure]:
    """Replay hours as fast as they decode, an hour's log again and again through one stream."""
    stream = LiveStream(load_calibration())
    session = LiveSession(ReplaySource(folder / "hour.bin"), stream, None, lambda _: None)
    # Made once: reading a log takes memory too, and the hours are to be those of the stream.
    source = ReplaySource(folder / "hour.bin", speed=float("inf"), rate_hz=20.0)
    portions = list(source.portions(lambda _: None))
    pid, first_mb, grown_mb, start_s = os.getpid(), 0.0, 0.0, time.monotonic()
    for hour in range(round(hours)):
        for data in portions:
            for at in range(0, len(data), 4096):
                part = data[at : at + 4096]
                session.state.received(len(part), stream.feed(part, time.time()))
        if hour == 0:
            first_mb = memory_mb(pid)
        grown_mb = max(grown_mb, memory_mb(pid) - first_mb)
    rows = len(read_log(folder / "hour.bin").frames["ident"]) // 5 * round(hours)
    yield Figure("memory grown after the first hour", grown_mb, 10.0, "MB")
    yield Figure("rows not decoded", abs(rows - stream.rows), 0, "")
    rate = hours * 3600.0 / (time.monotonic() - start_s)
    yield Figure("hours decoded, times real time", rate, 20.0, "", at_least=True)


def slow_viewers(folder: Path, seconds: float) -> Iterator[Figure]:
    """Let ten viewers look, three of whom never read; count what is missing on disk."""
    capture = folder / "ten.radio"
    source = f"replay:{folder / 'flight.bin'}"

    async def look(url: str) -> int:
        base, token = url.split("/?token=")
        read = 0
        async with aiohttp.ClientSession() as client:
            sockets = [await client.ws_connect(f"{base}/ws?token={token}") for _ in range(10)]

            async def follow(viewer: aiohttp.ClientWebSocketResponse) -> None:
                nonlocal read
                async for message in viewer:
                    read += len(message.data)

            tasks = [asyncio.ensure_future(follow(viewer)) for viewer in sockets[:7]]
            for viewer in sockets[7:]:  # a viewer whose computer sleeps
                assert viewer._response.connection is not None
                assert viewer._response.connection.transport is not None
                viewer._response.connection.transport.pause_reading()
            await asyncio.sleep(seconds)
            for task in tasks:
                task.cancel()
        return read

    with live(folder, source, "--rate", "100", "-o", str(capture)) as (process, url):
        used_s, start_s = processor_s(process.pid), time.monotonic()
        read = asyncio.run(look(url))
        used_s = processor_s(process.pid) - used_s
        passed_s = time.monotonic() - start_s
    lost = read_log(capture).loss
    yield Figure("ten viewers, three too slow: lost on disk", lost.frames + lost.lost_bytes, 0, "")
    yield Figure("read by the seven", read / 1e3 / passed_s, 70.0, "kB/s", at_least=True)
    yield Figure("server with ten viewers, of a core", 100.0 * used_s / passed_s, 25.0, "%")


def main() -> int:
    """Measure and print; 6 if a limit is missed."""
    parser = argparse.ArgumentParser(description="Measure `host live` on a quiet machine.")
    parser.add_argument("--only", choices=("page", "drawing", "endurance", "viewers"))
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--hours", type=float, default=8.0)
    asked = parser.parse_args()
    figures: list[Figure] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if asked.only != "endurance":
            seconds = 60.0 + 3 * asked.seconds
            (folder / "flight.bin").write_bytes(written(*flight(seconds)))
        if asked.only in (None, "page"):
            for rate_hz in (50, 100):
                figures += page(folder, rate_hz, asked.seconds)
        if asked.only in (None, "drawing"):
            for rate_hz in (50, 100):
                figures += drawing(folder, rate_hz)
        if asked.only in (None, "viewers"):
            figures += slow_viewers(folder, asked.seconds)
        if asked.only in (None, "endurance"):
            (folder / "hour.bin").write_bytes(written(*flight(3600.0)))
            figures += endurance(folder, asked.hours)
    print("\n".join(figure.line() for figure in figures))
    return 0 if all(figure.kept for figure in figures) else 6


if __name__ == "__main__":
    sys.exit(main())
