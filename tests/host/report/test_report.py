"""The write-up: its numbers are those of --json, nothing planted runs, it prints."""

import base64
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.report.flight_sections import calibration_and_preflight, data_health, maneuver_cards
from host.report.shown_flight import ShownFlight

from tests.browser.chromium import PHONE, Chromium
from tests.host.report.flights import PLANTED

ASKED = ("--model", "short-period", "--method", "output-error-white", "--no-delays")
SOURCE = "<img src=x onerror=alert(1)>\x01&.csv"


class Numbers(HTMLParser):
    """Collects what is shown for every place of result.json."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[str, float, str]] = []
        self._now: tuple[str, float] | None = None

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        own = dict(attrs)
        if own.get("data-json"):
            self._now = str(own["data-json"]), float(own.get("data-scale") or 1.0)

    def handle_data(self, data: str) -> None:
        if self._now:
            self.found.append((*self._now, data))
            self._now = None


def at(document: Any, pointer: str) -> Any:
    """Return what a JSON pointer leads to."""
    for step in pointer.split("/")[1:]:
        key = step.replace("~1", "/").replace("~0", "~")
        document = document[int(key)] if isinstance(document, list) else document[key]
    return document


def doublets() -> pd.DataFrame:
    """Return a short-period motion under three elevator doublets, Euler in small steps."""
    t = np.arange(0.0, 30.0, 0.02)
    de = np.zeros(len(t))
    for begin in (2.0, 11.0, 20.0):
        de += 0.06 * ((t >= begin) & (t < begin + 0.4)) - 0.06 * (
            (t >= begin + 0.4) & (t < begin + 0.8)
        )
    x = np.zeros((len(t), 2))
    for k in range(len(t) - 1):
        now = x[k]
        for _ in range(20):
            rate = np.array([-6.0 * now[0] + 0.95 * now[1] - 0.6 * de[k],
                             -150.0 * now[0] - 10.0 * now[1] - 150.0 * de[k]])  # fmt: skip
            now = now + 0.001 * rate
        x[k + 1] = now
    x += 2e-3 * np.random.default_rng(1).standard_normal(x.shape)
    return pd.DataFrame({
        "t_s": t, "airspeed_mps": 17.0 + 0.01 * np.sin(t), "elevator_rad": de,
        "alpha_rad": x[:, 0], "q_radps": x[:, 1],
    })  # fmt: skip


def test_numbers_of_the_report_are_those_of_json_and_nothing_planted_runs(
    tmp_path: Path, browser: Chromium, capsys: pytest.CaptureFixture[str]
) -> None:
    source, target = tmp_path / SOURCE, tmp_path / "report.html"
    doublets().to_csv(source, index=False)
    sheet = tmp_path / "sheet.txt"
    sheet.write_text(f"{PLANTED}\nGO 2026-11-23\n", encoding="utf-8")
    assert main(["identify", str(source), *ASKED, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    words = ["-o", str(target), "--preflight", str(sheet)]
    assert main(["report", str(source), *ASKED, *words]) == 0
    text = target.read_text(encoding="utf-8")
    numbers = Numbers()
    numbers.feed(text)
    assert len(numbers.found) > 20
    for pointer, scale, shown in numbers.found:
        assert float(shown) == pytest.approx(at(said, pointer) * scale, rel=6e-2), pointer
    assert any("/parameters/M_alpha/value" in pointer for pointer, _, _ in numbers.found)
    (inside,) = re.findall(r'href="data:application/json;base64,([^"]+)"', text)
    assert json.loads(base64.b64decode(inside)) == said
    for word in ("GO 2026-11-23", "M_alpha", "short period", "SHA-256", "Verdict", "unseen"):
        assert word in text
    assert "<img src=x" not in text and "</script><b>" not in text and "\x01" not in text
    page = browser.open(target.as_uri())
    page.wait_for("document.readyState === 'complete'")
    page.resize(PHONE)
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE[0]
    page.resize((1280, 900))
    assert page.console_errors == []
    assert [one for one in page.requests if not one.startswith("data:")] == [target.as_uri()]
    broken = "[...document.images].filter((one) => !one.naturalWidth).length"
    assert page.evaluate(broken) == 0 and page.evaluate("document.images.length") >= 3
    printed = page.call("Page.printToPDF", printBackground=True)["data"]
    assert base64.b64decode(printed).startswith(b"%PDF")


def test_sections_of_a_hostile_log_stay_text(flight: ShownFlight) -> None:
    text = data_health([flight], [flight.name])
    text += maneuver_cards([flight], [])
    text += calibration_and_preflight([flight], {}, (PLANTED, [PLANTED]))
    assert "<img" not in text and "<b>" not in text and "\x01" not in text
    assert "<td>elevator" in text and "default" in text and "lost" in text
