"""Fly and identify the flight of host/IDENTIFY.md, and write its answer and pictures anew.

cd host && python -m studies.first_flight            # --check: is the page the answer of today?
"""

from __future__ import annotations

import contextlib
import io
import re
import sys
import tempfile
from pathlib import Path

from host.cli import main as host

HOST = Path(__file__).resolve().parents[1]
PAGE = HOST / "IDENTIFY.md"
PICTURES = HOST / "pictures"
SHOWN = ("longitudinal_fit.svg", "longitudinal_intervals.svg")
DIGITS = re.compile(r"(\d+\.\d\d)\d+")  # a hundredth of a point is nothing to see
ANSWER = re.compile(r"(?<=```\n)Known from this flight.*?(?=```\n)", re.DOTALL)
MANEUVERS = re.compile(r"(?<=```\n)\d+ maneuvers found.*?(?=```\n)", re.DOTALL)
LISTED = 5  # lines of `host maneuvers` that the page shows
STALE = 6


def flown_answer(folder: Path, *, drawn: bool = False) -> str:
    """Run the page's commands in a folder and return what `host identify` prints.

    Parameters
    ----------
    folder : Path
    drawn : bool
        Draw its pictures too: three quarters of the time.

    Raises
    ------
    RuntimeError
        A command of the page failed; its line stands on stderr.
    """
    flight = folder / "flight"
    flown = [
        "identify", str(flight / "flight.bin"),
        "--calibration", str(flight / "calibration.toml"),
        "--aircraft", "ultrastick25e", *(("--plots", str(flight / "pictures")) if drawn else ()),
    ]  # fmt: skip
    printed = io.StringIO()
    for words in (["simulate", "demo", "--no-picture", "-o", str(flight)], flown):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            code = host(words)
        if code:
            raise RuntimeError(f"host {words[0]} ended with {code}")
    return printed.getvalue()


def flown_maneuvers(folder: Path) -> str:
    """Return the head of what `host maneuvers` prints of the flight that was flown there."""
    flight, printed = folder / "flight", io.StringIO()
    calibration = ["--calibration", str(flight / "calibration.toml")]
    with contextlib.redirect_stdout(printed):
        host(["maneuvers", str(flight / "flight.bin"), *calibration])
    return "\n".join([*printed.getvalue().splitlines()[:LISTED], "   ..."])


def page_with(answer: str, page: str, maneuvers: str | None = None) -> str:
    """Return the page with this answer, and these maneuvers, in place of what it shows."""
    shown = [(ANSWER, "answers", answer)]
    shown += [] if maneuvers is None else [(MANEUVERS, "lists of maneuvers", maneuvers)]
    for pattern, what, text in shown:
        page, count = pattern.subn((text.rstrip() + "\n").replace("\\", r"\\"), page)
        if count != 1:
            raise ValueError(f"{PAGE.name} shows {count} {what}, expected 1")
    return page


def main(words: list[str]) -> int:
    """Write page and pictures, or with `--check` compare the page; 6 where it is stale."""
    page = PAGE.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as name:
        answer = flown_answer(Path(name), drawn="--check" not in words)
        maneuvers = flown_maneuvers(Path(name))
        if "--check" in words:
            stale = page_with(answer, page, maneuvers) != page
            if stale:
                sys.stderr.write(f"{PAGE.name} shows another answer: run studies.first_flight\n")
            return STALE if stale else 0
        PICTURES.mkdir(exist_ok=True)
        for picture in SHOWN:
            text = Path(name, "flight", "pictures", picture).read_text(encoding="utf-8")
            (PICTURES / picture).write_text(DIGITS.sub(r"\1", text), encoding="utf-8")
    PAGE.write_text(page_with(answer, page, maneuvers), encoding="utf-8")
    sys.stderr.write(f"wrote {PAGE.name} and {len(SHOWN)} pictures in {PICTURES}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
