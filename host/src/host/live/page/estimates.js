// Derivatives as far as the flight tells them: value, half-width, and a bar against the wanted one.

const byId = (id) => document.getElementById(id);
const FULL = 3; // times the wanted half-width: the bar's whole length

function cell(row, text, kind = "") {
  const one = document.createElement("td");
  one.textContent = text;
  if (kind) one.className = kind;
  row.append(one);
  return one;
}

function digits(value) {
  return Math.abs(value) >= 10 ? value.toFixed(1) : value.toFixed(Math.abs(value) >= 1 ? 2 : 3);
}

// The wanted half-width is marked at a third of the bar; a shorter bar is better.
function bar(row, derivative) {
  const { percent, wanted_percent: wanted, enough } = derivative;
  const meter = document.createElement("meter");
  meter.min = 0;
  meter.max = FULL * wanted;
  meter.low = meter.high = wanted;
  meter.optimum = 0;
  meter.value = percent === null ? meter.max : Math.min(percent, meter.max);
  const word = percent === null ? "unknown" : `${percent.toFixed(percent < 30 ? 1 : 0)} %`;
  meter.title = `half-width ${word}, wanted ${wanted} %`;
  meter.setAttribute("aria-label", `${derivative.name}: ${meter.title}`);
  meter.classList.toggle("unknown", percent === null);
  cell(row, percent === null ? "-" : `± ${word}`, "number");
  cell(row, "", "bar").append(meter);
  cell(row, enough ? "enough" : "", "enough");
}

function line(derivative) {
  const row = document.createElement("tr");
  cell(row, derivative.name.replace("_", " "));
  const known = derivative.value !== null;
  cell(row, known ? digits(derivative.value) : "-", "number");
  bar(row, derivative);
  return row;
}

function said(estimates) {
  const count = estimates.points.length;
  const points = `${count} test point${count === 1 ? "" : "s"}`;
  const open = estimates.under_way ? `, in ${estimates.under_way.split(" at ")[0]}` : "";
  if (estimates.why_not) return count ? `${points}${open}; ${estimates.why_not}` : estimates.why_not;
  return estimates.until_s === null ? "waiting for a test point" : `${points}${open}, to ${estimates.until_s.toFixed(0)} s`;
}

// What to fly next for what is still missing, as far as one can tell now. While a card is flown its
// own next point is the one that the page calls next.
function nextWords(next, hasCard) {
  if (!next) return "";
  const left = next.points === 1 ? "the last one" : `about ${next.points} points, ${next.seconds} s`;
  const names = next.for.map((name) => name.replace("_", " ")).join(", ");
  return `${hasCard ? "after the card" : "next"}: ${next.text} (${left}; for ${names})`;
}

let enough = 0;

// Shows the estimates; returns true when one more derivative is known well enough.
export function showEstimates(estimates, hasCard) {
  byId("estimates-box").hidden = !estimates;
  if (!estimates) return false;
  byId("estimates-text").textContent = `${estimates.enough} of ${estimates.rows.length} enough`;
  byId("estimates-rows").replaceChildren(...estimates.rows.map(line));
  const words = said(estimates);
  if (byId("estimates-said").textContent !== words) byId("estimates-said").textContent = byId("estimates-said").title = words;
  const next = nextWords(estimates.next, hasCard);
  if (byId("estimates-next").textContent !== next) byId("estimates-next").textContent = next;
  const more = estimates.enough > enough;
  enough = estimates.enough;
  return more;
}
