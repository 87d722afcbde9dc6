"""Take the pictures of the pages in `host/*.md` anew: a virtual flight and a virtual walk.

    PYTHONPATH=host python -m tests.browser.page_pictures    # nine minutes; then look at them
    PYTHONPATH=host python -m tests.browser.page_pictures --only learning

The flight is the card that `host plan` designs, received from its radio. Where the
logger learns, it flies two rows of multisines itself.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from host.aircraft.linear_aircraft import load as load_aircraft
from host.export.toml import dumps
from host.physical.calibration import calibration_of_text
from host.planning.card_design import design, document
from host.planning.flight_envelope import Envelope
from host.planning.learning_card import learned_axes
from host.planning.logger_card import logger_card
from host.twin.outcome.virtual_calibration import calibration
from host.twin.testcard.cards import Segment
from studies.learned_in_flight import card as learning_card
from studies.learned_in_flight import multisine
from studies.radio_flights import radio_flight

from tests.browser.chromium import LAPTOP, PHONE, Chromium, Page
from tests.browser.served_page import served_page

AIRCRAFT, SEED = "ultrastick25e", 31
POINTS = 6  # flown and judged before the picture: of roll and yaw nothing is known yet
PATIENCE_S = 300.0
TURN_S = 10.4  # of 180 deg at 17 m/s
WIDE = Envelope(distance_m=500, alpha_deg=12.0, rates_degps=250.0)
WALK = "sim:walk/half_travel@4x"


def flight(folder: Path, into: Path) -> None:
    """Picture the page in flight, on a phone, and when nothing comes any more."""
    card = design(AIRCRAFT)
    (folder / "plan.toml").write_text(dumps(document(card)), encoding="utf-8")
    flown = radio_flight(card, SEED)
    (folder / "plan.radio").write_bytes(b"".join(part.data for part in flown.sent))
    (folder / "calibration.toml").write_text(flown.calibration, encoding="utf-8")
    words = ("--card", "plan.toml", "--aircraft", AIRCRAFT, "--calibration", "calibration.toml")
    # The browser first: the flight does not wait for one.
    with Chromium() as browser, served_page(folder, "live", "plan.radio", *words) as live:
        page = browser.open(live.url)
        which = "document.getElementById('point-which').textContent"
        page.wait_for(f"Number({which}.split(' ')[1]) >= {POINTS}", PATIENCE_S)
        page.wait_for("document.getElementById('estimates-next').textContent !== ''", PATIENCE_S)
        page.press(" ", "Space", " ")
        page.wait_for("document.querySelector('#events').textContent.includes('mark 1')")
        taken(page, into / "live-page.png", LAPTOP)
        taken(page, into / "live-phone.png", PHONE)
        page.resize(LAPTOP)
        page.wait_for("document.getElementById('banner').textContent !== ''", PATIENCE_S)
        page.wait_for("parseFloat(document.getElementById('link-age').textContent) > 8")
        taken(page, into / "live-old.png", LAPTOP)


def learning(folder: Path, into: Path) -> None:
    """Picture what the logger has learned of pitch in a row that it flies."""
    roll, pitch = multisine("aileron", 4.0, 6, 6), multisine("elevator", 5.0, 5, 5)
    back = Segment("turn", duration_s=TURN_S, bank_deg=30.0)
    segments = (roll, back, pitch, Segment("trim", duration_s=3.0))
    card = replace(learning_card(), segments=segments)
    plane = load_aircraft(AIRCRAFT)
    lines = calibration_of_text(calibration(plane), folder / "calibration.toml")
    axes = learned_axes(AIRCRAFT, card, lines)
    (folder / "rows.card").write_bytes(logger_card(card, plane, lines, WIDE, axes))
    (folder / "rows.toml").write_text(dumps(document(card)), encoding="utf-8")
    words = ("live", "sim:rows.toml", "--flight-card", "rows.card")
    with Chromium() as browser, served_page(folder, *words) as live:
        page = browser.open(live.url)
        told = "document.getElementById('logger-text').textContent"
        page.wait_for(f"/^pitch, row 2, 1[2-9] s/.test({told})", PATIENCE_S)
        taken(page, into / "live-learning.png", LAPTOP)


def walk(folder: Path, into: Path) -> None:
    """Picture the guided list where a surface has half its travel."""
    with Chromium() as browser, served_page(folder, "preflight", WALK) as live:
        page = browser.open(live.url)
        title = "document.getElementById('preflight-title').textContent"
        page.wait_for(f"{title}.startsWith('supply')", PATIENCE_S)
        page.wait_for("document.getElementById('preflight-seen').textContent !== ''", PATIENCE_S)
        taken(page, into / "preflight-page.png", LAPTOP)


def taken(page: Page, path: Path, size: tuple[int, int]) -> None:
    """Take one picture, and refuse it where the page complained."""
    page.resize(size)
    page.evaluate("new Promise((done) => setTimeout(done, 500))")  # drawn at its new size
    page.screenshot(path)
    assert page.console_errors == [], page.console_errors
    print(f"wrote {path}")


PICTURES = {"walk": walk, "flight": flight, "learning": learning}


def main(arguments: list[str] | None = None) -> int:
    """Take all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("host"))
    parser.add_argument("--only", choices=PICTURES, help="one of them")
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        for name, take in PICTURES.items():
            if args.only in (None, name):
                take(Path(folder), args.folder.absolute())
    return 0


if __name__ == "__main__":
    sys.exit(main())
