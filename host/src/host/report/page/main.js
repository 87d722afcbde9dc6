// Puts the page together: strips, list of test points, picker, track, panels.
const byId = (id) => document.getElementById(id);

function picker(meta, strips, redraw) {
  const place = byId("picker"), chosen = new Set(meta.strips.filter((one) => one.on).map((one) => one.name));
  const now = () => [
    ...meta.strips.filter((one) => chosen.has(one.name)).map((one) => one.channels),
    ...meta.channels.filter((one) => chosen.has(`channel ${one.name}`)).map((one) => [one.name]),
  ];
  const box = (key, text, title, parent) => {
    const label = document.createElement("label"), input = document.createElement("input");
    input.type = "checkbox";
    input.checked = chosen.has(key);
    input.addEventListener("change", () => {
      if (input.checked) chosen.add(key); else chosen.delete(key);
      redraw(now());
    });
    label.title = title;
    label.append(input, ` ${text}`);
    parent.append(label);
  };
  const group = (title) => {
    const field = document.createElement("fieldset"), legend = document.createElement("legend");
    legend.textContent = title;
    field.append(legend);
    place.append(field);
    return field;
  };
  const ready = group("strips");
  meta.strips.forEach((one) => box(one.name, one.name, one.channels.join(", "), ready));
  const groups = new Map();
  for (const one of meta.channels) {
    if (!groups.has(one.group)) groups.set(one.group, group(one.group));
    box(`channel ${one.name}`, one.name, one.text, groups.get(one.group));
  }
  return now();
}

async function start() {
  const meta = JSON.parse(byId("meta").textContent), samples = new Samples(meta);
  await samples.load();
  const track = meta.track ? new Track(byId("track"), meta) : null;
  const panels = new Panels(meta, samples);
  const strips = new Strips(byId("strips"), meta, samples, (from, to) => {
    byId("view").textContent = `${from.toFixed(2)} to ${to.toFixed(2)} s`;
    panels.shown(from, to);
  }, (t) => track?.at(t));
  strips.show(picker(meta, strips, (names) => strips.show(names)));
  await strips.view(samples.from, samples.to);

  const around = (from, to) => strips.view(from - 2, to + 2);
  document.querySelectorAll("[data-from]").forEach((row) => row.addEventListener("click", () => {
    around(Number(row.dataset.from), Number(row.dataset.to));
    document.querySelectorAll("tr.chosen").forEach((one) => one.classList.remove("chosen"));
    row.classList.add("chosen");
  }));
  const span = () => strips.to - strips.from, middle = () => (strips.to + strips.from) / 2;
  const moves = {
    all: () => strips.view(samples.from, samples.to),
    in: () => strips.view(middle() - span() / 4, middle() + span() / 4),
    out: () => strips.view(middle() - span(), middle() + span()),
    back: () => strips.view(Math.max(samples.from, strips.from - span() / 2), Math.max(samples.from + span(), strips.to - span() / 2)),
    on: () => strips.view(Math.min(samples.to - span(), strips.from + span() / 2), Math.min(samples.to, strips.to + span() / 2)),
  };
  for (const [name, move] of Object.entries(moves)) byId(`go-${name}`).addEventListener("click", move);
  let waiting = 0;
  addEventListener("resize", () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => { strips.resize(); track?.draw(); panels.draw(); }, 150);
  });
  document.body.dataset.ready = "yes";
}

start().catch((error) => {
  byId("trouble").textContent = `This page could not be drawn: ${error.message}. It needs a browser of 2023 or later (Chrome 80, Firefox 113, Safari 16.4).`;
  throw error;
});
