// What the logger estimates by itself while it flies a row, and what is estimated here.

const byId = (id) => document.getElementById(id);
const OLD_S = 3; // it tells once a second

function cell(row, text, kind = "") {
  const one = document.createElement("td");
  one.textContent = text;
  if (kind) one.className = kind;
  row.append(one);
}

function digits(value) {
  return Math.abs(value) >= 10 ? value.toFixed(1) : value.toFixed(Math.abs(value) >= 1 ? 2 : 3);
}

// A figure and its half-width in per cent of it; one that the input did not tell is a question mark.
function figure(row, said) {
  const known = said !== null && said.half_width !== null;
  cell(row, known ? digits(said.value) : said === null ? "-" : "?", "number");
  const percent = known && said.value ? Math.abs((100 * said.half_width) / said.value) : Infinity;
  cell(row, !known ? "" : percent < 100 ? `± ${percent.toFixed(percent < 30 ? 1 : 0)} %` : "no sign", "width");
}

function line(derivative) {
  const row = document.createElement("tr");
  cell(row, derivative.name.replace("_", " "));
  figure(row, derivative);
  figure(row, derivative.ground);
  cell(row, derivative.enough ? "enough" : "", "enough");
  return row;
}

function words(said, old) {
  if (!said.rows.length) return "no row has taught yet";
  const last = said.rows.reduce((one, other) => (other.t_s >= one.t_s ? other : one));
  const what = `${last.axis}, row ${last.row}, ${last.after_s.toFixed(0)} s`;
  return old ? `${what}; ${said.age_s.toFixed(0)} s ago` : what;
}

// Shows nothing where the stream never named a flight card; grey what did not come just now.
export function showLearning(said) {
  byId("logger-box").hidden = !said.card;
  const old = said.age_s === null || said.age_s > OLD_S;
  byId("logger-box").classList.toggle("past", old);
  byId("logger-head").hidden = !said.rows.length;
  const text = words(said, old);
  if (byId("logger-text").textContent !== text) byId("logger-text").textContent = text;
  byId("logger-rows").replaceChildren(...said.rows.map(line));
}
