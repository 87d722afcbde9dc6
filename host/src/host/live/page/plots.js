// Plots of the last seconds: uPlot draws lines and axes, the heading above them says the values.
//
// The window moves by whole pixels, ten a second. uPlot draws a plot anew only then; between two such
// steps everything but the newest rows stands where it stood, and only these are added. The plots
// take their steps in turn, so that a redraw has four of them to draw anew and not all twelve.

import { PLOTS, words } from "./channels.js";

const AXIS = "#333";
const GRID = { stroke: "#ddd", width: 1 };
const FONT = "11px system-ui, sans-serif";

// An axis that holds all values, never less than `span` wide, and moves only when it must.
function ranger(span) {
  let low = 0;
  let high = 0;
  return (least, most) => {
    if (least === null || most === null || least === undefined || most === undefined) {
      return low < high ? [low, high] : [-span / 2, span / 2];
    }
    const room = Math.max(span, (most - least) * 1.1);
    if (least < low || most > high || room < 0.5 * (high - low) || low === high) {
      const middle = (least + most) / 2;
      low = middle - room * 0.6;
      high = middle + room * 0.6;
    }
    return [low, high];
  };
}

function element(kind, className, text = "") {
  const made = document.createElement(kind);
  made.className = className;
  made.textContent = text;
  return made;
}

function set(figure, text) {
  if (figure.textContent !== text) figure.textContent = text;
}

class Plot {
  constructor(what, parent, turn) {
    this.what = what;
    this.turn = turn; // share of a pixel by which this one steps behind the first
    this.end = null; // of the window as it is drawn, s
    this.made = 0; // rows that are drawn
    this.columns = what.series.map(([column]) => column);
    const box = element("section", "plot");
    box.setAttribute("aria-label", what.title);
    const heading = element("h2", "", what.title);
    heading.append(element("small", "", what.unit));
    const values = element("span", "values");
    this.values = what.series.map(([, label, colour]) => {
      const one = element("span", "");
      one.style.color = colour;
      one.append(`${label} `);
      const figure = element("b", "", "-");
      one.append(figure);
      values.append(one);
      return figure;
    });
    const extra = element("span", what.jumps ? "jumps" : "");
    this.extra = element("b", "", "-");
    if (what.difference || what.jumps) {
      extra.append(what.jumps ? "jumps " : "L-R ", this.extra);
      values.append(extra);
    }
    values.title = what.series.map(([column]) => column).join(", ");
    heading.append(values);
    this.canvas = element("div", "canvas");
    this.canvas.setAttribute("role", "img");
    box.append(heading, this.canvas);
    parent.append(box);
    this.chart = new uPlot(this.options(), [[], ...this.columns.map(() => [])], this.canvas);
    this.fit();
  }

  options() {
    const range = ranger(this.what.span);
    const scales = {
      x: { time: false, auto: false, range: () => this.span || [0, 30] },
      y: { auto: true, range: (_, least, most) => range(least, most) },
    };
    return {
      width: 200,
      height: 80,
      legend: { show: false },
      cursor: { show: false },
      padding: [4, 4, 0, 0],
      scales,
      axes: [
        // Seconds stand below the last row of plots only: text is what takes longest to draw.
        { scale: "x", stroke: AXIS, grid: GRID, font: FONT, size: this.what.times ? 16 : 4, gap: 1,
          ticks: { show: false }, space: 80,
          values: (_, ticks) => ticks.map((tick) => (this.what.times ? `${Math.round(tick)}` : "")) },
        { scale: "y", stroke: AXIS, grid: GRID, font: FONT, size: 36, gap: 2,
          ticks: { show: false }, space: 26, values: (_, ticks) => ticks.map(String) },
      ],
      series: [
        {},
        ...this.what.series.map(([, label, stroke]) => ({
          label,
          stroke,
          width: 1.6,
          scale: "y",
          points: { show: false },
          spanGaps: false,
        })),
      ],
    };
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width > 20 && height > 20) this.chart.setSize({ width, height });
    this.end = null;
  }

  // Shows what came since; returns true where the whole plot was drawn.
  draw(history, first, now) {
    const pixels = this.chart.bbox.width;
    const step = history.windowS / pixels;
    const end = (Math.ceil(now / step - this.turn) + this.turn) * step;
    const whole = end !== this.end || !this.add(history);
    if (whole) {
      this.end = end;
      this.span = [end - history.windowS, end];
      this.chart.setData(history.window(["t_s", ...this.columns], first, pixels));
    }
    this.made = history.made;
    return whole;
  }

  // Adds the lines of the newest rows; returns false where one of them leaves the axis.
  add(history) {
    const from = Math.max(this.made - 1 - history.forgotten, 0);
    const t = history.values.get("t_s");
    if (from >= t.length - 1) return true;
    const { chart, columns } = this;
    const series = columns.map((name, at) => ({ line: chart.series[at + 1], column: history.values.get(name) }));
    const inside = ({ line, column }) => {
      const { min, max } = chart.scales[line.scale];
      for (let at = from; at < t.length; at += 1) if (column[at] !== null && !(column[at] >= min && column[at] <= max)) return false;
      return true;
    };
    if (!series.every(inside)) return false;
    const { ctx, bbox } = chart;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const { line, column } of series) {
      ctx.strokeStyle = line.stroke();
      ctx.lineWidth = line.width * devicePixelRatio;
      ctx.beginPath();
      let pen = false;
      for (let at = from; at < t.length; at += 1) {
        if (column[at] === null) {
          pen = false;
          continue;
        }
        const x = Math.round(chart.valToPos(t[at], "x", true));
        const y = Math.round(chart.valToPos(column[at], line.scale, true));
        if (pen) ctx.lineTo(x, y);
        else ctx.moveTo(x, y);
        pen = true;
      }
      ctx.stroke();
    }
    ctx.restore();
    return true;
  }

  say(history, jumps) {
    const { digits, least, series, difference } = this.what;
    series.forEach(([column], at) => {
      set(this.values[at], words(history.last(column), digits, least));
    });
    if (difference) {
      const [left, right] = difference.map((column) => history.last(column));
      set(this.extra, left === null || right === null ? "-" : (left - right).toFixed(digits));
    } else if (this.what.jumps) {
      const count = jumps[this.what.jumps] ?? 0;
      set(this.extra, String(count));
      this.extra.parentElement.classList.toggle("bad", count > 0);
    }
  }

  describe() {
    const said = this.what.series.map(([, label], at) => `${label} ${this.values[at].textContent}`);
    this.canvas.setAttribute("aria-label", `${this.what.title}, ${said.join(", ")} ${this.what.unit}`);
  }
}

export class Plots {
  constructor(parent) {
    this.plots = PLOTS.map((what, at) => new Plot(what, parent, at / PLOTS.length));
    new ResizeObserver(() => this.plots.forEach((plot) => plot.fit())).observe(parent);
  }

  // Returns how many plots were drawn anew.
  draw(history) {
    if (history.lastT === null) return 0;
    const first = history.firstInWindow();
    const now = history.now();
    return this.plots.filter((plot) => plot.draw(history, first, now)).length;
  }

  say(history, jumps) {
    for (const plot of this.plots) plot.say(history, jumps);
  }

  describe() {
    for (const plot of this.plots) plot.describe();
  }
}
