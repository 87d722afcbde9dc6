"""The page of a flight in a browser: drawn, nothing asked of anybody, nothing planted runs."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from host.cli import main
from host.errors import UsageError
from host.report.flight_page import flight_page
from host.report.flight_reading import FlightRequest, read_flight
from host.report.shown_flight import Happening, ShownFlight
from host.report.strip_figure import overview_figure

import host
from tests.browser.chromium import PHONE, Chromium
from tests.host.report.flights import PLANTED

PX4 = Path(__file__).resolve().parents[2] / "data/px4/sample_log_small.ulg"
CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ufffe\uffff]")


def test_page_of_a_hostile_log_is_drawn_and_asks_nobody(
    log_file: Path, tmp_path: Path, browser: Chromium, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "flight.html"
    assert main(["plot", str(log_file), "-o", str(target)]) == 3  # a second is lost
    assert " test points" in capsys.readouterr().out
    text = target.read_text(encoding="utf-8")
    assert not CONTROL.search(text) and len(text) < 3_000_000
    page = browser.open(target.as_uri())
    page.wait_for("document.body.dataset.ready")
    assert page.console_errors == []
    assert page.requests == [target.as_uri()]
    assert page.evaluate("document.querySelectorAll('#strips canvas').length") >= 6
    assert page.evaluate("document.querySelectorAll('img, b').length") == 0
    assert "onerror=alert(1)" in page.evaluate("document.querySelector('h1').textContent")
    whole = page.evaluate("document.getElementById('view').textContent")
    page.click("tr[data-from]")
    page.wait_for(f"document.getElementById('view').textContent !== '{whole}'")
    page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    page.wait_for("document.querySelectorAll('#spectrum canvas, #xy canvas').length === 2")
    page.click("#picker input:not(:checked)")
    page.resize(PHONE)
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE[0]
    assert page.console_errors == [] and len(page.requests) == 1


def test_the_policy_stops_a_script_that_got_into_the_page(
    flight: ShownFlight, tmp_path: Path, browser: Chromium
) -> None:
    text = flight_page(flight).replace("<body>", "<body><script>window.ran = 1</script>")
    target = tmp_path / "broken.html"
    target.write_text(text, encoding="utf-8")
    page = browser.open(target.as_uri())
    page.wait_for("document.body.dataset.ready")
    assert page.evaluate("window.ran") is None
    assert any("Content Security Policy" in one for one in page.console_errors)


def test_planted_events_end_no_block_of_data(flight: ShownFlight) -> None:
    events = [Happening(1.0, PLANTED + "\ud800\uffff<!--", 1.0)]
    text = flight_page(replace(flight, events=events, name=PLANTED))
    assert "<b>" not in text and "<!--" not in text and not CONTROL.search(text)
    blocks = flight_page(flight).count("</script")
    assert text.count("</script") == blocks
    text.encode("utf-8")


def test_pictures_are_the_same_twice_and_name_what_is_unknown(
    log_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("one.svg", "two.svg"):
        words = ["--svg", str(tmp_path / name), "--channels", "alpha_deg,q_degps+p_degps"]
        assert main(["plot", str(log_file), *words, "--from", "5", "--to", "12"]) == 3
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()
    assert main(["plot", str(log_file), "--png", str(tmp_path / "a.png"), "--channels", "nix"]) == 2
    assert "nix: not measured here; there are airspeed_mps" in capsys.readouterr().err


def test_a_log_draws_itself_in_a_notebook(log_file: Path) -> None:
    log = host.read_log(log_file)
    pictures = log.plot("elevator_deg", "p_degps+q_degps", from_s=5.0, to_s=12.0)
    (figure,) = pictures.values()
    assert [axis.get_ylabel() for axis in figure.axes] == ["deg", "deg/s"]
    assert figure.axes[0].get_xlim()[0] >= 5.0
    page = pictures._repr_html_()
    assert page.startswith("<img ") and page.count("<") == 1  # the name is hostile
    assert len(next(iter(log.plot().values())).axes) >= 5
    with pytest.raises(UsageError, match="nix: not measured"):
        log.plot("nix")


def test_a_loss_whose_time_nobody_knows_is_listed_and_no_folder_is_told() -> None:
    """The page said "listed under Losses", and there stood none; its note named a folder."""
    flight = read_flight(FlightRequest(PX4))[0]
    text = flight_page(flight)
    assert "1 lost range: shown as a gap" in text
    assert "<h2>Losses</h2><p>none</p>" not in text and "<td></td><td>" in text
    assert str(PX4.parent) not in text.partition("<details")[0]


def test_names_stand_above_their_strip(flight: ShownFlight) -> None:
    """The frame ran through their underscores."""
    figure = overview_figure(flight)
    figure.draw_without_rendering()
    for axis in figure.axes:
        name, frame = axis.get_legend().get_window_extent(), axis.get_window_extent()
        assert name.y0 >= frame.y1 - 0.5
