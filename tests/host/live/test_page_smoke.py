"""`host live` as a user starts it, seen through a browser: one start for everything."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.browser.chromium import PHONE, Chromium
from tests.browser.served_page import ServedPage, served_page
from tests.host.live.radio import Sent, joined, sent
from tests.protocol.log_writer import envelope, rows

# Two seconds of thirty redraws on a clock of our own; then the same instant drawn anew.
REDRAWS = """(async () => {
  const { History } = await import("./history.js");
  const { Plots } = await import("./plots.js");
  const { PLOTS } = await import("./channels.js");
  const parent = document.getElementById("plots");
  parent.replaceChildren();
  const names = ["t_s", ...new Set(PLOTS.flatMap((what) => what.series.map(([name]) => name)))];
  const [history, plots] = [new History(names, 30), new Plots(parent)];
  let [clock, row, whole] = [35, 0, 0];
  history.now = () => clock;
  const drawn = async () => {
    const rows = [];
    for (; row < clock * 50; row += 1) {
      rows.push(row / 50, ...names.slice(1).map((_, at) => Math.sin(row / 50 + at)));
    }
    if (rows.length) history.add([0, rows.length / names.length, ...rows]);
    whole += plots.draw(history);
    await null; // uPlot draws behind what asked for it
  };
  await drawn();
  whole = 0;
  for (let at = 0; at < 60; at += 1) {
    clock += 1 / 30;
    await drawn();
  }
  const often = whole;
  const seen = () => plots.plots.map(({ chart: { ctx: { canvas }, ctx } }) =>
    ctx.getImageData(0, 0, canvas.width, canvas.height).data);
  const grown = seen();
  plots.plots.forEach((plot) => { plot.end = null; });
  await drawn();
  let [off, inked] = [0, 0];
  seen().forEach((anew, plot) => anew.forEach((value, at) => {
    if (at % 4 !== 3) return; // how opaque a pixel is
    inked += value > 127;
    off += Math.abs(value - grown[plot][at]) > 127;
  }));
  return { often, off, inked };
})()"""
PLANTED = b"<script>x=1"  # twelve characters of identity.board


# One derivative known well enough, one not yet, one not at all; then one more.
ESTIMATES = """(async () => {
  const { showEstimates } = await import("./estimates.js");
  const row = (name, value, percent, wanted) => ({ name, value, percent, wanted_percent: wanted,
    half_width: value, enough: percent !== null && percent <= wanted });
  const said = (...rows) => ({ rows, enough: rows.filter((one) => one.enough).length, until_s: 42,
    points: ["<b>elevator</b> 3-2-1-1 at 31.0 s"], under_way: "rudder doublet at 40.1 s",
    why_not: "" });
  const known = row("Cm_q", -12.34, 9, 20);
  const first = showEstimates(said(known, row("Cn_r", -0.1, 55, 20), row("Cl_p", null, null, 15)));
  const more = showEstimates(said(known, row("Cn_r", -0.1, 12, 20), row("Cl_p", null, null, 15)));
  const lines = [...document.querySelectorAll("#estimates-rows tr")].map((line) => line.innerText);
  const shown = { first, more, lines,
    hidden: document.getElementById("estimates-box").hidden,
    head: document.getElementById("estimates-text").innerText,
    foot: document.getElementById("estimates-said").innerText,
    markup: document.querySelectorAll("#estimates-said b").length };
  const next = { text: "a doublet", points: 1, seconds: 6, for: ["Cn_r"] };
  const called = [true, false].map((hasCard) => {
    showEstimates({ ...said(known), next }, hasCard);
    return document.getElementById("estimates-next").innerText.split(":")[0];
  });
  const { compass } = await import("./plan.js");
  const { PLOTS, words } = await import("./channels.js");
  const unit = ([column]) => column.split("_").pop();
  const units = PLOTS.map(({ series }) => new Set(series.map(unit)).size);
  const airspeed = [-2, 4.9, 17.04, -8, null].map((one) => words(one, 1, 5));
  const { showDoubts } = await import("./panel.js");
  const none = document.getElementById("doubts").innerText;
  showDoubts([{ figure: "height", text: "<b>barometer" }]);
  const doubts = [none, document.getElementById("doubts").innerText,
    document.querySelectorAll(".figure.bad > #height").length];
  return { ...shown, called, airspeed, doubts,
    heading: [-90, 359.7, 725].map(compass), units: Math.max(...units) };
})()"""


# What the logger learns: no card, a card, a row that teaches, the same sent no more.
LEARNING = """(async () => {
  const { showLearning } = await import("./learning.js");
  const box = document.getElementById("logger-box");
  const row = (name, value, half_width, ground) => ({ name, value, half_width, ground, row: 2,
    axis: "<b>pitch", after_s: 5.02, t_s: 70, enough: half_width !== null && half_width < 1 });
  const rows = [row("Cm_alpha", -1.62, 0.17, { value: -1.52, half_width: 0.1 }),
    row("Cm_q", -10.1, 19, null), row("Cm_de", -1.27, null, null)];
  const seen = (card, age_s, told) => {
    showLearning({ card, age_s, rows: told });
    const cell = box.querySelector("td");
    return { hidden: box.hidden, text: document.getElementById("logger-text").innerText,
      colour: cell ? getComputedStyle(cell).color : "" };
  };
  document.body.classList.remove("old");
  const before = [seen(false, null, []), seen(true, null, [])];
  const now = seen(true, 0.4, rows);
  const lines = [...box.querySelectorAll("tbody tr")].map((line) => line.innerText.split("\\t"));
  const past = seen(true, 8.2, rows);
  return { before, now, lines, past, markup: box.querySelectorAll("b").length };
})()"""


# A voice of this computer speaks once switched on, and says once what begins to hold.
VOICE = """(async () => {
  const { Voice } = await import("./voice.js");
  window.SpeechSynthesisUtterance = class { constructor(text) { this.text = text; } };
  const said = [];
  const voices = [{ lang: "en-US", localService: false }, { lang: "en-GB", localService: true }];
  const synthesis = { getVoices: () => voices, cancel: () => {},
    speak: ({ text, voice }) => said.push(`${voice.lang}: ${text}`) };
  const button = document.createElement("button");
  const voice = new Voice(button, synthesis);
  voice.say("too early");
  button.click();
  voice.say("good 93. next: rudder doublet, 3 deg, steps of 0.51 s");
  for (const left of [7.2, 6.1]) voice.tell(`300 m from home in ${left} s: turn`);
  button.click();
  voice.say("too late");
  const strange = new Voice(button, { getVoices: () => voices.slice(0, 1) });
  strange.toggle();
  return { said, off: document.getElementById("voice").textContent, strange: button.textContent };
})()"""


# The horizon in a climb to the right: sky left above, ground right below.
HORIZON = """(async () => {
  const { Horizon } = await import("./horizon.js");
  const canvas = document.getElementById("horizon");
  new Horizon(canvas).draw(50, 0);
  const pen = canvas.getContext("2d");
  const at = (x, y) => [...pen.getImageData(x * canvas.width, y * canvas.height, 1, 1).data];
  return [at(0.1, 0.5), at(0.9, 0.5)].map(([red, , blue]) => (blue > red ? "sky" : "ground"));
})()"""


# A tile lies where its corner is: that of home below home, its neighbour in the east next to it.
TILES = """(async () => {
  const { Tiles, tileOf } = await import("./tiles.js");
  const [column, row] = tileOf(51.5, -0.1, 10).map(Math.floor);
  const tiles = new Tiles();
  [tiles.zooms, tiles.home] = [[0, 15], [51.5, -0.1]];
  const asked = [];
  tiles.picture = (zoom, x, y) => { asked.push([zoom, x, y]); return zoom === 15; };
  const drawn = [];
  const pen = { drawImage: (_, left, top, width) => drawn.push([left, top, width]) };
  const place = { perM: 0.5, at: (x, y) => [150 + x / 2, 100 - y / 2] };
  tiles.draw(pen, place, 300, 200);
  const home = tileOf(51.5, -0.1, 15).map(Math.floor);
  const own = asked.findIndex(([, x, y]) => x === home[0] && y === home[1]);
  const [left, top, width] = drawn[own];
  const inside = left <= 150 && 150 < left + width && top <= 100 && 100 < top + width;
  const covered = drawn.some(([x, y]) => x <= 0 && y <= 0);
  return { column, row, inside, covered, width };
})()"""


def planted(seconds: float) -> bytes:
    """Return a stream whose board and aircraft names are markup."""
    parts = sent(seconds)
    at = parts[len(parts) // 4]
    who = rows("identity", 1, t_us=np.array([at.t_us], np.uint32), board=PLANTED)
    config = rows("config", 1, t_us=np.array([at.t_us], np.uint32), aircraft=b"<img src=x>")
    more = [Sent(at.t_us, envelope(one.tobytes())) for one in (who, config)]
    return joined(sorted([*parts, *more], key=lambda part: part.t_us))


@pytest.mark.costs(60, "a browser draws twelve plots without a graphics card, started once")
def test_the_page_shows_the_flight_and_asks_nobody_else(tmp_path: Path) -> None:
    (tmp_path / "in.radio").write_bytes(planted(48.0))
    with served_page(tmp_path, "live", "in.radio@4x", "-o", "<b>out.radio", "--json") as live:
        look(live, tmp_path)
    assert live.code == 0, live.err
    assert "Traceback" not in live.err
    assert "next: host decode" in live.err
    notes = (tmp_path / "<b>out.radio.jsonl").read_text().splitlines()
    assert json.loads(notes[0])["source"] == "replay:in.radio@4x"
    assert [json.loads(one)["kind"] for one in notes[1:]].count("mark") == 1
    assert json.loads(live.out.splitlines()[-1])["link"]["damaged_bytes"] == 0


def look(live: ServedPage, folder: Path) -> None:
    """Do what a pilot does, and what a stranger's text would do."""
    with Chromium() as browser:
        page = browser.open(live.url)
        page.wait_for("window.hostLive && hostLive.redraws > 0 && hostLive.rows > 100", 60)
        assert page.evaluate("document.querySelectorAll('#plots .plot canvas').length") == 12
        assert page.evaluate("location.search") == ""  # the token is out of sight
        page.wait_for("document.querySelector('#more').textContent.includes('<img src=x>')", 60)
        assert page.evaluate("document.querySelectorAll('#more img, #more script').length") == 0
        page.press(" ", "Space", " ")
        page.wait_for("document.querySelector('#events').textContent.includes('mark 1')")
        page.click("#sound")
        page.wait_for("document.querySelector('#sound').getAttribute('aria-pressed') === 'true'")
        page.screenshot(folder / "laptop.png")
        page.resize(PHONE)
        wide = page.evaluate("document.documentElement.scrollWidth")
        assert wide <= PHONE[0], "a phone must not scroll sideways"
        # A second of silence makes every value grey.
        for value in ("#airspeed", "#link-rate", "#plots .values span", "#facts dd"):
            colour = f"getComputedStyle(document.querySelector('{value}')).color"
            page.wait_for(f"{colour} === 'rgb(154, 154, 154)'", 120)
        unnamed = "[...document.querySelectorAll('canvas, [role=img], button')].filter((one) =>"
        unnamed += " !one.closest('[aria-label]') && !one.textContent).length"
        assert page.evaluate(unnamed) == 0
        assert live.strangers(page.requests) == []
        assert page.console_errors == []
        told = page.evaluate(ESTIMATES)
        assert (told["first"], told["more"], told["hidden"]) == (True, True, False), told
        assert told["called"] == ["after the card", "next"]
        assert told["heading"] == [270, 0, 5]
        assert told["units"] == 1  # of a strip
        assert told["airspeed"] == ["< 5", "< 5", "17.0", "-8.0", "-"]
        assert told["doubts"] == ["", "<b>barometer", 1]
        assert told["head"] == "2 of 3 enough"
        assert [("enough" in line, line.split()[0]) for line in told["lines"]] == [
            (True, "Cm"), (True, "Cn"), (False, "Cl"),
        ]  # fmt: skip
        assert "± 12.0 %" in told["lines"][1], told
        assert "-" in told["lines"][2], told
        assert told["foot"] == "1 test point, in rudder doublet, to 42 s"
        assert told["markup"] == 0
        learning = page.evaluate(LEARNING)
        assert [one["hidden"] for one in learning["before"]] == [True, False]
        assert learning["before"][1]["text"] == "no row has taught yet"
        assert learning["now"]["text"] == "<b>pitch, row 2, 5 s"
        assert learning["lines"] == [
            ["Cm alpha", "-1.62", "± 10.5 %", "-1.52", "± 6.6 %", "enough"],
            ["Cm q", "-10.1", "no sign", "-", "", ""],
            ["Cm de", "?", "", "-", "", ""],
        ]
        assert learning["past"]["text"] == "<b>pitch, row 2, 5 s; 8 s ago"
        assert learning["now"]["colour"] == "rgb(0, 0, 0)"
        assert learning["past"]["colour"] == "rgb(154, 154, 154)"
        assert learning["markup"] == 0
        tiles = page.evaluate(TILES)
        assert (tiles["column"], tiles["row"]) == (511, 340)  # as web maps number London at 10
        assert tiles["inside"] and tiles["covered"]
        assert tiles["width"] == pytest.approx(380.7, abs=1.0)  # 40 075 km cos(51.5 deg) / 2^15 / 2
        voice = page.evaluate(VOICE)
        assert (voice["off"], voice["strange"]) == ("Voice off", "No voice here")
        assert voice["said"] == [
            "en-GB: voice on",
            "en-GB: good 93. next: rudder doublet, 3 degrees, steps of 0.51 seconds",
            "en-GB: 300 metres from home in 7.2 seconds: turn",
        ]
        assert page.evaluate(HORIZON) == ["sky", "ground"]
        drawn = page.evaluate(REDRAWS)
        assert drawn["often"] < 12 * 60 / 2, drawn  # of 12 plots and 60 redraws
        assert drawn["off"] < 0.01 * drawn["inked"], drawn  # rows that are added stand in place
