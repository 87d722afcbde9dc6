// Plots of the last seconds: uPlot draws lines and axes, the heading above them says the values.

import { PLOTS } from "./channels.js";

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

class Plot {
  constructor(what, parent) {
    this.what = what;
    this.columns = what.series.map(([column]) => column);
    const box = element("section", what.jumps ? "plot surface" : "plot");
    box.setAttribute("aria-label", what.title);
    const heading = element("h2", "", what.title);
    if (!what.jumps) heading.append(element("small", "", what.unit));
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
    if (what.difference) {
      extra.append("L-R ", this.extra);
      values.append(extra);
    }
    values.title = what.series.map(([column]) => column).join(", ");
    heading.append(values);
    this.canvas = element("div", "canvas");
    this.canvas.setAttribute("role", "img");
    if (what.jumps) {
      extra.append("jumps ", this.extra);
      this.canvas.append(extra);
    }
    box.append(heading, this.canvas);
    parent.append(box);
    this.chart = new uPlot(this.options(), [[], ...this.columns.map(() => [])], this.canvas);
    this.fit();
  }

  options() {
    const scales = { x: { time: false, auto: false, range: () => this.span || [0, 30] } };
    for (const [, , , unit] of this.what.series) {
      const name = unit || this.what.unit;
      if (!scales[name]) {
        const range = ranger(unit ? (unit === "us" ? 200 : 10) : this.what.span);
        scales[name] = { auto: true, range: (_, least, most) => range(least, most) };
      }
    }
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
        { scale: this.what.unit, stroke: AXIS, grid: GRID, font: FONT, size: 36, gap: 2,
          ticks: { show: false }, space: 26, values: (_, ticks) => ticks.map(String) },
      ],
      series: [
        {},
        ...this.what.series.map(([, label, stroke, unit]) => ({
          label,
          stroke,
          width: 1.6,
          scale: unit || this.what.unit,
          points: { show: false },
          spanGaps: false,
        })),
      ],
    };
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width > 20 && height > 20) this.chart.setSize({ width, height });
  }

  draw(history, first, span) {
    this.span = span;
    this.chart.setData(history.window(["t_s", ...this.columns], first));
  }

  say(history, jumps) {
    const { digits, series, difference } = this.what;
    series.forEach(([column, , , unit], at) => {
      const value = history.last(column);
      this.values[at].textContent = value === null ? "-" : value.toFixed(unit === "deg" ? 1 : digits);
    });
    if (difference) {
      const [left, right] = difference.map((column) => history.last(column));
      this.extra.textContent = left === null || right === null ? "-" : (left - right).toFixed(digits);
    } else if (this.what.jumps) {
      const count = jumps[this.what.jumps] ?? 0;
      this.extra.textContent = String(count);
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
    this.plots = PLOTS.map((what) => new Plot(what, parent));
    new ResizeObserver(() => this.plots.forEach((plot) => plot.fit())).observe(parent);
  }

  draw(history) {
    if (history.lastT === null) return;
    const first = history.firstInWindow();
    const now = history.now();
    const span = [now - history.windowS, now];
    for (const plot of this.plots) plot.draw(history, first, span);
  }

  say(history, jumps) {
    for (const plot of this.plots) plot.say(history, jumps);
  }

  describe() {
    for (const plot of this.plots) plot.describe();
  }
}
