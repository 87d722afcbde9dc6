"""The write-up: its numbers are those of --json, nothing planted runs, it prints."""

import base64
import json
import re
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.report.fit_section import mode_table
from host.report.flight_sections import calibration_and_preflight, data_health, maneuver_cards
from host.report.json_numbers import JsonNumbers
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
        self.beside: list[tuple[str, float, str]] = []
        self._now: tuple[str, float] | None = None
        self._to = self.found

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        own = dict(attrs)
        if own.get("data-json"):
            self._now = str(own["data-json"]), float(own.get("data-scale") or 1.0)
            self._to = self.beside if own.get("data-file") else self.found

    def handle_data(self, data: str) -> None:
        if self._now:
            self._to.append((*self._now, data))
            self._now = None


def at(document: Any, pointer: str) -> Any:
    """Return what a JSON pointer leads to."""
    for step in pointer.split("/")[1:]:
        key = step.replace("~1", "/").replace("~0", "~")
        document = document[int(key)] if isinstance(document, list) else document[key]
    return document


@cache
def doublets() -> pd.DataFrame:
    """Return a short-period motion under three elevator doublets, Euler in small steps.

    Nobody writes into it.
    """
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
    for word in ("GO 2026-11-23", "M_alpha", "short period", "SHA-256", "Answer", "unseen"):
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
    pdf = base64.b64decode(printed)
    assert pdf.startswith(b"%PDF")
    assert 1 <= len(re.findall(rb"/Type\s*/Page[^s]", pdf)) <= 3  # six with ten test points


def test_a_report_of_before_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    doublets().to_csv("flight.csv", index=False)
    Path("flight.report.html").write_text("of before", encoding="utf-8")
    assert main(["report", "flight.csv", *ASKED]) == 0
    assert Path("flight.report.html").read_text(encoding="utf-8") == "of before"
    assert sorted(p.name for p in tmp_path.glob("*.html")) == [
        "flight-2.report.html", "flight.report.html"
    ]  # fmt: skip


def test_a_second_method_and_what_the_aircraft_file_says_stand_beside(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nobody asked for either: a report of one method says nothing of what another would."""
    source, target = tmp_path / "flight.csv", tmp_path / "report.html"
    doublets().to_csv(source, index=False)
    asked = [str(source), "--model", "short-period", "--no-delays", "--aircraft", "ultrastick25e"]
    assert main(["report", *asked, "-o", str(target)]) == 0
    capsys.readouterr()
    assert main(["identify", *asked, "--method", "equation-error", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    numbers = Numbers()
    numbers.feed(target.read_text(encoding="utf-8"))
    assert {pointer.rsplit("/", 2)[-2] for pointer, _, _ in numbers.beside} == {
        "Z_alpha", "Z_de", "M_alpha", "M_q", "M_de"
    }  # fmt: skip
    for pointer, scale, shown in numbers.beside:
        assert float(shown) == pytest.approx(at(said, pointer) * scale, rel=6e-2), pointer
    priors = {pointer.split("/")[-2]: float(shown) for pointer, _, shown in numbers.found
              if pointer.endswith("/prior")}  # fmt: skip
    assert priors["Cm_q"] == pytest.approx(-10.9, rel=0.01)  # of the file, at no angle of attack
    text = target.read_text(encoding="utf-8")
    assert "Methods side by side" in text and "coefficients of UASLab OpenFlight" in text
    assert "Simulated" not in text


def test_modes_of_a_simulated_flight_name_the_damping_once() -> None:
    mode = {"name": "short period", "eigenvalue": [-10.0, 15.0], "frequency_radps": 18.0}
    mode |= {"known": "not", "reason": "q_radps is not predicted"}
    truth = {"short period": {"truth": 18.4}, "short period, damping": {"truth": 0.57}}
    numbers = JsonNumbers({"answers": [{"modes": [mode]}], "truth": {"own": truth}})
    text = re.sub("<[^>]+>", " ", mode_table(numbers, ["own"], ["mine"]))
    assert " ".join(text.split()).endswith("not: q_radps is not predicted 18.4 , damping 0.57")


def test_sections_of_a_hostile_log_stay_text(flight: ShownFlight) -> None:
    text = data_health([flight], [flight.name])
    text += maneuver_cards([flight], [])
    text += calibration_and_preflight([flight], {}, (PLANTED, [PLANTED]))
    assert "<img" not in text and "<b>" not in text and "\x01" not in text
    assert "<td>elevator" in text and "default" in text and "lost" in text
