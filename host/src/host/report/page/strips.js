// Strips of channels over time: one axis, one cursor, test points shaded, losses and events marked.
const COLOURS = ["#0b5cad", "#c2410c", "#15803d", "#7e22ce", "#0e7490", "#a16207"];
const GRADES = { good: "rgba(22,163,74,.16)", fair: "rgba(217,119,6,.18)", poor: "rgba(220,38,38,.16)" };
const LOSS = "rgba(220,38,38,.45)", EVENT = "#6d28d9", JUMP = "#be123c";

class Strips {
  constructor(place, meta, samples, onView, onCursor) {
    Object.assign(this, { place, meta, samples, onView, onCursor });
    this.index = new Map(meta.channels.map((one, k) => [one.name, k]));
    this.charts = [];
    this.from = samples.from;
    this.to = samples.to;
  }

  // Draw these strips, a list of lists of channel names.
  show(strips) {
    this.charts.forEach((one) => one.chart.destroy());
    this.place.replaceChildren();
    this.charts = strips.map((names, at) => this.strip(names, at === 0));
  }

  strip(names, first) {
    const channels = names.map((name) => this.index.get(name));
    const unit = this.meta.channels[channels[0]].unit;
    const width = this.place.clientWidth, narrow = width < 600;
    const options = {
      width,
      height: (narrow ? 130 : 150) + (first ? 16 : 0),
      padding: [first ? 18 : 6, 12, 0, 0],
      scales: { x: { time: false } },
      cursor: {
        sync: { key: "flight" }, drag: { x: true, y: false, setScale: false },
        bind: { dblclick: () => () => { this.view(this.samples.from, this.samples.to); return null; } },
      },
      series: [
        { label: "t, s", value: (_, t) => (t == null ? "" : t.toFixed(3)) },
        ...names.map((name, k) => ({
          label: name, stroke: COLOURS[k % COLOURS.length], width: 1.2, points: { show: false },
          value: (_, v) => (v == null ? "" : shortNumber(v)),
        })),
      ],
      axes: [
        { size: 28, font: "11px sans-serif", grid: { stroke: "#e5e7eb" } },
        { size: narrow ? 46 : 60, font: "11px sans-serif", grid: { stroke: "#e5e7eb" },
          label: unit || names[0], labelSize: 16, labelFont: "11px sans-serif" },
      ],
      hooks: {
        drawClear: [(chart) => this.shade(chart, first)],
        draw: [(chart) => this.mark(chart, first)],
        setSelect: [(chart) => this.selected(chart)],
        setCursor: [(chart) => {
          if (chart.cursor.left >= 0) this.onCursor(chart.posToVal(chart.cursor.left, "x"));
        }],
      },
    };
    const data = this.samples.between(this.from, this.to, channels);
    const chart = new uPlot(options, data, this.place);
    chart.setScale("x", { min: this.from, max: this.to });
    return { chart, channels };
  }

  selected(chart) {
    if (!(chart.select.width > 4)) return;
    const from = chart.posToVal(chart.select.left, "x");
    const to = chart.posToVal(chart.select.left + chart.select.width, "x");
    chart.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    this.view(from, to);
  }

  // Show from one instant to another in every strip.
  async view(from, to) {
    const least = 0.05;
    this.from = Math.max(this.samples.from, Math.min(from, to - least));
    this.to = Math.min(this.samples.to, Math.max(to, this.from + least));
    await this.samples.want(this.from, this.to);
    for (const { chart, channels } of this.charts) {
      const data = this.samples.between(this.from, this.to, channels);
      chart.batch(() => {
        chart.setData(data, false);
        chart.setScale("x", { min: this.from, max: this.to });
      });
    }
    this.onView(this.from, this.to);
  }

  resize() {
    for (const { chart } of this.charts) chart.setSize({ width: this.place.clientWidth, height: chart.height });
  }

  shade(chart, first) {
    const { ctx, bbox } = chart, ratio = devicePixelRatio;
    const at = (t) => Math.max(bbox.left, Math.min(bbox.left + bbox.width, chart.valToPos(t, "x", true)));
    ctx.save();
    for (const one of this.meta.maneuvers) {
      if (one.end_s < this.from || one.start_s > this.to) continue;
      const left = at(one.start_s), right = at(one.end_s);
      ctx.fillStyle = GRADES[one.quality];
      ctx.fillRect(left, bbox.top, Math.max(1, right - left), bbox.height);
      if (first && right - left > 8 * ratio) {
        ctx.fillStyle = "#374151";
        ctx.font = `${11 * ratio}px sans-serif`;
        const long = `${one.number}  ${one.grade.toFixed(2)}`;
        const text = ctx.measureText(long).width < right - left ? long : `${one.number}`;
        ctx.textAlign = "center";
        ctx.fillText(text, (left + right) / 2, bbox.top - 5 * ratio);
      }
    }
    ctx.fillStyle = LOSS;
    for (const one of this.meta.losses) {
      if (one.end_s < this.from || one.t_s > this.to) continue;
      const left = at(one.t_s);
      ctx.fillRect(left, bbox.top, Math.max(2 * ratio, at(one.end_s) - left), bbox.height);
    }
    ctx.restore();
  }

  mark(chart, first) {
    const { ctx, bbox } = chart, ratio = devicePixelRatio;
    const line = (t, colour, height) => {
      if (t < this.from || t > this.to) return;
      const x = Math.round(chart.valToPos(t, "x", true)) + 0.5;
      ctx.strokeStyle = colour;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + height);
      ctx.stroke();
    };
    ctx.save();
    ctx.lineWidth = ratio;
    ctx.setLineDash([3 * ratio, 3 * ratio]);
    if (first) this.meta.events.forEach((one) => line(one.t_s, EVENT, bbox.height));
    const own = this.charts.find((one) => one.chart === chart);
    const names = own ? own.channels.map((k) => this.meta.channels[k].name) : [];
    ctx.setLineDash([]);
    for (const one of this.meta.jumps) {
      if (names.includes(`servo_${one.channel}_us`)) line(one.t_s, JUMP, bbox.height);
    }
    ctx.restore();
  }
}

function shortNumber(value) {
  const size = Math.abs(value);
  return size >= 1000 ? value.toFixed(1) : size >= 10 ? value.toFixed(2) : size >= 0.01 || size === 0
    ? value.toFixed(3) : value.toExponential(2);
}
