// Puts the page together: rows into the history, thirty redraws a second, the state five times.

import { LEAST_AIRSPEED_MPS, words } from "./channels.js";
import { connect } from "./connection.js";
import { showEstimates } from "./estimates.js";
import { History } from "./history.js";
import { Horizon } from "./horizon.js";
import { showLearning } from "./learning.js";
import { showAge, showState } from "./panel.js";
import { compass, Plan } from "./plan.js";
import { Plots } from "./plots.js";
import { Preflight } from "./preflight.js";
import { Sound } from "./sound.js";
import { Verdict } from "./verdict.js";
import { Voice } from "./voice.js";

const REDRAW_MS = 1000 / 30;
const OLD_S = 1;
const BEAT_S = 4; // the recorder's heartbeat comes every second
const GAPS = 4000; // latencies kept for the bench

const byId = (id) => document.getElementById(id);
const plan = new Plan(byId("plan"));
const horizon = new Horizon(byId("horizon"));
const sound = new Sound(byId("sound"));
const voice = new Voice(byId("voice"));
const verdict = new Verdict(sound, voice);
const measured = { redraws: 0, latencies: [], rows: 0 };
let history = null;
let plots = null;
let state = null;
let stateAt = -Infinity;
let recording = { bytes: null, trouble: "" };
let recordingAt = -Infinity;
let marked = 0;
let connected = false;
let wasOld = false;

const server = connect({
  onHello(hello) {
    history = new History(hello.columns, hello.window_s);
    if (plots === null) plots = new Plots(byId("plots"));
    byId("mark").hidden = !hello.may_mark;
    preflight.allow(hello.may_mark);
    connected = true;
    recordingAt = performance.now();
    plan.points = [];
    plan.tiles.zooms = hello.tiles;
  },
  onRows(numbers) {
    history.add(numbers);
    measured.rows += numbers[1];
  },
  onState(said) {
    state = said;
    stateAt = performance.now();
    document.body.classList.remove("waiting");
    plan.wind = said.wind_mps;
    plan.limitM = said.home?.limit_m ?? 0;
    plan.tiles.home = said.home?.place_deg ?? null;
    voice.tell(said.home?.warning ?? "");
    if (said.track.length) plan.add(said.track);
    showState(said);
    preflight.show(said.preflight);
    if (showEstimates(said.estimates, Boolean(said.test_point?.next))) sound.play([660, 880]);
    showLearning(said.logger ?? { card: false, age_s: null, rows: [] });
    verdict.show(said.test_point ?? null);
    const marks = said.events.filter((event) => event.kind === "mark").length;
    if (marks > marked) sound.play([660]);
    marked = marks;
  },
  onRecording(said) {
    recording = said;
    recordingAt = performance.now();
  },
  onClosed() {
    connected = false;
  },
});

const preflight = new Preflight((what) => server.ask({ type: "preflight", ...what }), sound);

function ageS() {
  if (state === null || state.age_s === null) return null;
  return state.age_s + (performance.now() - stateAt) / 1000;
}

function banner(age) {
  if (!connected) return "host live has ended, or this page lost it: nothing here is new";
  if (recording.trouble) return `${recording.trouble} (the card goes on)`;
  const beatS = (performance.now() - recordingAt) / 1000;
  if (beatS > BEAT_S) return `no word of the ground's recording for ${beatS.toFixed(0)} s (the card goes on)`;
  if (state === null) return "";
  if (state.ended) return "the source has ended: nothing here is new";
  if (age === null) return "nothing received yet";
  return age > OLD_S ? `no data for ${age.toFixed(0)} s: values are old` : "";
}

function tell() {
  if (history === null || plots === null) return;
  const age = connected ? ageS() : null;
  const old = age === null || age > OLD_S;
  document.body.classList.toggle("old", old);
  if (old && !wasOld) {
    sound.play([440, 330]);
    voice.say("no data");
  }
  wasOld = old;
  showAge(age, banner(age));
  plots.say(history, state ? state.jumps : {});
  const pair = ["airspeed_a_mps", "airspeed_b_mps"].map((one) => history.last(one)).filter((one) => one !== null);
  const airspeed = pair.length ? pair.reduce((a, b) => a + b) / pair.length : null;
  byId("airspeed").textContent = words(airspeed, 1, LEAST_AIRSPEED_MPS);
  byId("height").textContent = words(history.last("height_m") ?? plan.height(), 0);
  const heading = history.last("psi_deg");
  byId("heading").textContent = heading === null ? "-" : compass(heading);
  plan.draw(heading);
}

function redraw() {
  if (history === null || plots === null || performance.now() - history.lastAt > 1500) return;
  plots.draw(history);
  measured.redraws += 1;
  const now = Date.now();
  const arrived = history.arrived.splice(0);
  if (state !== null) measured.latencies.push(...arrived.map((at) => now - at)); // else kept ones
  if (measured.latencies.length > GAPS) measured.latencies.splice(0, GAPS / 2);
}

let due = 0;

function frame(now) {
  if (now >= due) {
    due = Math.max(due + REDRAW_MS, now - REDRAW_MS);
    redraw();
  }
  requestAnimationFrame(frame);
}

byId("mark").addEventListener("click", () => server.mark());
document.addEventListener("keydown", (event) => {
  if (event.code !== "Space" || event.repeat || event.target instanceof HTMLButtonElement) return;
  event.preventDefault();
  server.mark();
});
if (location.search) window.history.replaceState(null, "", location.pathname);
window.hostLive = measured;
setInterval(tell, 200);
setInterval(() => history && horizon.draw(history.last("phi_deg"), history.last("theta_deg")), 100);
setInterval(() => plots && plots.describe(), 1000);
requestAnimationFrame(frame);
