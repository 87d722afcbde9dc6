// The track from above, metres east and north of home; a map below it where there is one.

import { Tiles } from "./tiles.js";

// Heading of a compass, 0 to 360, of any number of turns.
export const compass = (degrees) => ((Math.round(degrees) % 360) + 360) % 360;

const TRACK = "#0b3d91";
const LIMIT = "#b00020";
const MOST = 3000;
const STEPS = [10, 20, 50, 100, 200, 500, 1000, 2000, 5000];

export class Plan {
  constructor(canvas) {
    this.canvas = canvas;
    this.points = [];
    this.wind = null;
    this.limitM = 0;
    this.tiles = new Tiles();
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  add(points) {
    this.points.push(...points);
    if (this.points.length > MOST) this.points = this.points.filter((_, at) => at % 2 === 0);
  }

  draw(heading = null) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    const dots = window.devicePixelRatio || 1;
    if (this.canvas.width !== width * dots || this.canvas.height !== height * dots) {
      this.canvas.width = width * dots;
      this.canvas.height = height * dots;
    }
    const pen = this.canvas.getContext("2d");
    pen.setTransform(dots, 0, 0, dots, 0, 0);
    pen.clearRect(0, 0, width, height);
    const place = this.frame(width, height);
    this.tiles.draw(pen, place, width, height);
    this.rings(pen, place, width, height);
    this.track(pen, place);
    if (this.points.length) this.aircraft(pen, place, heading);
    this.scale(pen, place, width, height);
    if (this.wind && Math.hypot(...this.wind) >= 0.5) this.arrow(pen, width);
  }

  frame(width, height) {
    const least = Math.max(60, 1.04 * this.limitM);
    let [west, east, south, north] = [-least, least, -least, least];
    for (const [x, y] of this.points) {
      west = Math.min(west, x);
      east = Math.max(east, x);
      south = Math.min(south, y);
      north = Math.max(north, y);
    }
    const perM = Math.min((width - 24) / (east - west), (height - 24) / (north - south));
    const [x0, y0] = [(west + east) / 2, (south + north) / 2];
    return { perM, at: (x, y) => [width / 2 + (x - x0) * perM, height / 2 - (y - y0) * perM] };
  }

  rings(pen, place, width, height) {
    const [x, y] = place.at(0, 0);
    const step = STEPS.find((one) => one * place.perM > 50) ?? 5000;
    pen.strokeStyle = "#ddd";
    pen.lineWidth = 1;
    for (let radius = step; radius * place.perM < Math.hypot(width, height); radius += step) {
      pen.beginPath();
      pen.arc(x, y, radius * place.perM, 0, 2 * Math.PI);
      pen.stroke();
    }
    this.limit(pen, place, x, y);
    pen.fillStyle = "#000";
    pen.font = "700 12px system-ui, sans-serif";
    pen.textAlign = "left";
    pen.fillRect(x - 3, y - 3, 6, 6);
    pen.fillText("home", x + 6, y + 12);
  }

  limit(pen, place, x, y) {
    if (!this.limitM) return;
    pen.strokeStyle = pen.fillStyle = LIMIT;
    pen.lineWidth = 2;
    pen.setLineDash([8, 5]);
    pen.beginPath();
    pen.arc(x, y, this.limitM * place.perM, 0, 2 * Math.PI);
    pen.stroke();
    pen.setLineDash([]);
    const radius = this.limitM * place.perM;
    if (radius < 45) return;
    pen.font = "700 12px system-ui, sans-serif";
    pen.textAlign = "center";
    pen.fillText(`${this.limitM.toFixed(0)} m`, x, y + radius - 5);
  }

  track(pen, place) {
    pen.strokeStyle = TRACK;
    pen.lineWidth = 2;
    pen.beginPath();
    this.points.forEach(([x, y], at) => {
      const [left, top] = place.at(x, y);
      if (at) pen.lineTo(left, top);
      else pen.moveTo(left, top);
    });
    pen.stroke();
  }

  aircraft(pen, place, heading) {
    const [x, y] = this.points[this.points.length - 1];
    const [left, top] = place.at(x, y);
    pen.save();
    pen.translate(left, top);
    pen.rotate(((heading ?? 0) * Math.PI) / 180);
    pen.fillStyle = "#c43b00";
    pen.beginPath();
    pen.moveTo(0, -11);
    pen.lineTo(7, 8);
    pen.lineTo(0, 4);
    pen.lineTo(-7, 8);
    pen.fill();
    pen.restore();
  }

  scale(pen, place, width, height) {
    const length = STEPS.findLast((one) => one * place.perM < width / 3) ?? 10;
    pen.strokeStyle = pen.fillStyle = "#000";
    pen.lineWidth = 3;
    pen.beginPath();
    pen.moveTo(8, height - 8);
    pen.lineTo(8 + length * place.perM, height - 8);
    pen.stroke();
    pen.font = "700 12px system-ui, sans-serif";
    pen.textAlign = "left";
    pen.fillText(`${length} m`, 8, height - 13);
    pen.textAlign = "right";
    pen.fillText("N \u2191", width - 6, 14);
  }

  // Where the air goes.
  arrow(pen, width) {
    const [east, north] = this.wind;
    const speed = Math.hypot(east, north);
    pen.save();
    pen.translate(width - 26, 44);
    pen.rotate(Math.atan2(east, north));
    pen.strokeStyle = "#00642c";
    pen.lineWidth = 3;
    pen.beginPath();
    pen.moveTo(0, 13);
    pen.lineTo(0, -13);
    pen.lineTo(-5, -5);
    pen.moveTo(0, -13);
    pen.lineTo(5, -5);
    pen.stroke();
    pen.restore();
    pen.fillStyle = "#00642c";
    pen.textAlign = "right";
    pen.fillText(`wind ${speed.toFixed(0)} m/s`, width - 6, 74);
  }

  // Metres over home by GPS.
  height() {
    return this.points.length ? this.points[this.points.length - 1][2] : null;
  }
}
