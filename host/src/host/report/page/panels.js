// Two drawings of what is in view: one channel over another, and a channel's spectrum.
class Panels {
  constructor(meta, samples) {
    Object.assign(this, { meta, samples, xy: null, spectrum: null });
    this.view = [samples.from, samples.to];
    for (const id of ["xy-x", "xy-y", "spectrum-channel"]) {
      const select = document.getElementById(id);
      meta.channels.forEach((one, k) => select.add(new Option(one.name, k)));
      select.value = this.usual(id);
      select.addEventListener("change", () => this.draw());
    }
    document.querySelectorAll("details.panel").forEach((one) => one.addEventListener("toggle", () => this.draw()));
  }

  usual(id) {
    const named = { "xy-x": ["alpha_deg", "elevator_deg"], "xy-y": ["q_degps", "az_mps2"],
      "spectrum-channel": ["q_degps", "az_mps2"] }[id];
    const found = named.map((name) => this.meta.channels.findIndex((one) => one.name === name)).find((k) => k >= 0);
    return found === undefined ? Math.min(id === "xy-y" ? 1 : 0, this.meta.channels.length - 1) : found;
  }

  shown(from, to) {
    this.view = [from, to];
    this.draw();
  }

  draw() {
    if (document.getElementById("xy-panel").open) this.drawXy();
    if (document.getElementById("spectrum-panel").open) this.drawSpectrum();
  }

  chosen(id) {
    return Number(document.getElementById(id).value);
  }

  drawXy() {
    const [x, y] = [this.chosen("xy-x"), this.chosen("xy-y")];
    const [t, a, b] = this.samples.between(...this.view, [x, y]);
    const inside = (one) => this.meta.maneuvers.some((m) => one >= m.start_s && one <= m.end_s);
    const rows = t.map((one, k) => [a[k], b[k], inside(one)]).filter((row) => row[0] !== null && row[1] !== null);
    rows.sort((one, other) => one[0] - other[0]);
    const data = [rows.map((r) => r[0]), rows.map((r) => (r[2] ? null : r[1])), rows.map((r) => (r[2] ? r[1] : null))];
    const dots = (label, stroke) => ({ label, stroke, paths: () => null, points: { show: true, size: 3, stroke, fill: stroke } });
    this.xy?.destroy();
    this.xy = this.chart("xy", data, x, this.meta.channels[y],
      [dots("between test points", "#9ca3af"), dots("in test points", "#c2410c")], 1, this.meta.channels[x]);
  }

  drawSpectrum() {
    const channel = this.chosen("spectrum-channel"), note = document.getElementById("spectrum-note");
    const cut = this.samples.whole(...this.view, channel);
    this.spectrum?.destroy();
    this.spectrum = null;
    const found = cut && spectrumOf(...cut);
    if (!found) {
      note.textContent = "No whole samples in view: zoom into a test point (its row in the list), or use host plot --full.";
      return;
    }
    const own = this.meta.channels[channel];
    note.textContent = `${cut[0][0].toFixed(1)} to ${cut[0][cut[0].length - 1].toFixed(1)} s, ${found.pieces} pieces averaged, Hann window.`;
    this.spectrum = this.chart("spectrum", [found.frequency, found.density.map((p) => Math.max(p, 1e-300))], channel,
      { name: own.name, unit: own.unit ? `(${own.unit})\u00b2/Hz` : "1/Hz" },
      [{ label: own.name, stroke: "#0b5cad", width: 1.2, points: { show: false } }], 3, { name: "frequency", unit: "Hz" });
  }

  chart(id, data, _, y, series, distr, x) {
    const place = document.getElementById(id), narrow = place.clientWidth < 600;
    const axis = (one) => (one.unit ? `${one.name}, ${one.unit}` : one.name);
    return new uPlot({
      width: place.clientWidth, height: narrow ? 260 : 320,
      scales: { x: { time: false, distr }, y: { distr } },
      series: [{ label: axis(x) }, ...series],
      axes: [
        { label: axis(x), labelSize: 18, size: 30, font: "11px sans-serif", labelFont: "11px sans-serif" },
        { label: axis(y), labelSize: 18, size: 60, font: "11px sans-serif", labelFont: "11px sans-serif",
          values: distr === 3 ? (_u, ticks) => ticks.map((v) => (v === null ? "" : v.toExponential(0))) : undefined },
      ],
    }, data, place);
  }
}
