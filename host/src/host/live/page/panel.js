// Lamps, figures, facts and events. Every text is set as text: a stranger's words stay words.

const byId = (id) => document.getElementById(id);
const figure = (value, digits) => (value === null || value === undefined ? "-" : value.toFixed(digits));

const NEAR_M = 20; // of home: nearer, GPS does not tell where it lies

function lamp(id, word, kind) {
  byId(id).className = `lamp ${kind}`;
  const text = byId(`${id}-text`);
  if (text.textContent !== word) text.textContent = word;
}

function fact(list, name, value, bad = false) {
  const term = document.createElement("dt");
  term.textContent = name;
  const said = document.createElement("dd");
  said.textContent = value;
  said.title = value;
  if (bad) said.className = "bad";
  list.append(term, said);
}

export function showState(state) {
  const { rec, link, system, gps } = state;
  const recording = rec.state === "recording";
  lamp("rec", recording ? `${rec.blocks} blocks` : rec.state, recording ? "good" : rec.state === "unknown" ? "" : "bad");
  const { go, preflight } = state;
  const sofar = preflight === null ? "no preflight" : `${preflight.seen} of ${preflight.items.length}`;
  lamp("go", go === null ? sofar : go ? "GO" : "NO-GO", go === null ? "" : go ? "good" : "bad");
  byId("link-rate").textContent = figure(link.rows_per_s, 0);
  byId("link-lost").textContent = figure(link.lost_percent, 1);
  byId("link-lost").parentElement.classList.toggle("bad", link.lost_percent > 5);
  byId("gps").textContent = gps.satellites ?? "-";
  byId("gps-fix").textContent = gps.fix ?? "satellites";
  byId("rail").textContent = figure(system.rail_v, 2);
  byId("supply").textContent = figure(system.supply_v, 2);
  showDoubts(state.doubts);
  showHome(state.home);
  showFacts(state, link, system);
  showEvents(state.events);
}

function showFacts(state, link, system) {
  const list = document.createDocumentFragment();
  const captured = state.not_recorded ? "NOT RECORDED" : state.captured_bytes === null ? "a replay: none" : `${(state.captured_bytes / 1000).toFixed(1)} kB`;
  fact(list, "ground capture", captured);
  fact(list, "rows, lost", `${link.rows}, ${link.lost}`);
  fact(list, "card: dropped, errors", `${system.frames_dropped ?? "-"}, ${system.card_errors ?? "-"}`, system.frames_dropped > 0 || system.card_errors > 0);
  fact(list, "servos by", system.drive ?? "-");
  byId("facts").replaceChildren(list);
  const more = document.createDocumentFragment();
  fact(more, "switch", state.switch_us === null ? "-" : `${state.switch_us} us`);
  fact(more, "bytes/s, damaged", `${link.bytes_per_s}, ${link.damaged_bytes}`, link.damaged_bytes > 0);
  fact(more, "not sent by radio", system.not_sent ?? "-");
  fact(more, "heard of", (system.sensors ?? []).join(", ") || "-");
  more.lastChild.className = "long";
  fact(more, "aircraft", state.who.aircraft || "-");
  fact(more, "firmware", [state.who.board, state.who.firmware].filter(Boolean).join(" ") || "-");
  fact(more, "viewers", String(state.viewers));
  fact(more, "from", state.source.split(/[\\/]/).pop());
  byId("more").replaceChildren(more);
}

// Home as the aircraft sees it: how far, where to turn, and the limit that it nears.
export function showHome(home) {
  byId("home-distance").textContent = figure(home?.distance_m, 0);
  const far = Boolean(home) && home.distance_m > NEAR_M;
  byId("home-bearing").textContent = far ? figure(home.bearing_deg, 0) : "-";
  const outside = Boolean(home) && home.distance_m > home.limit_m;
  byId("home-distance").parentElement.classList.toggle("bad", outside);
  const limit = byId("limit");
  limit.className = outside ? "bad" : "";
  if (limit.textContent !== (home?.warning ?? "")) limit.textContent = home?.warning ?? "";
}

export function showDoubts(doubts) {
  const said = doubts.map((doubt) => doubt.text).join("; ");
  if (byId("doubts").textContent !== said) byId("doubts").textContent = said;
  for (const figure of ["airspeed", "height"]) {
    byId(figure).parentElement.classList.toggle("bad", doubts.some((doubt) => doubt.figure === figure));
  }
}

let lastEvent = 0;

function showEvents(events) {
  const newest = events.length ? events[events.length - 1].number : 0;
  if (newest === lastEvent) return;
  lastEvent = newest;
  const rows = events.slice().reverse().map((event) => {
    const row = document.createElement("li");
    row.className = event.kind;
    row.textContent = `${event.t_s.toFixed(1)} s  ${event.text}`;
    return row;
  });
  byId("events").replaceChildren(...rows);
}

export function showAge(ageS, banner) {
  byId("link-age").textContent = ageS === null ? "-" : ageS < 100 ? ageS.toFixed(1) : ageS.toFixed(0);
  byId("age-figure").classList.toggle("bad", ageS === null || ageS > 1);
  if (byId("banner").textContent !== banner) byId("banner").textContent = banner;
}
