// The way over ground from above, equal metres both ways, coloured by test point.
const TRACK_COLOURS = ["#c2410c", "#0b5cad", "#15803d", "#7e22ce", "#be123c", "#0e7490", "#a16207", "#4d7c0f",
  "#1d4ed8", "#9d174d"];

class Track {
  constructor(canvas, meta) {
    this.canvas = canvas;
    this.track = meta.track;
    this.maneuvers = meta.maneuvers;
    this.now = null;
    this.draw();
  }

  draw() {
    const ratio = devicePixelRatio, canvas = this.canvas;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    const ctx = canvas.getContext("2d");
    ctx.scale(ratio, ratio);
    const { east_m: east, north_m: north } = this.track;
    const [left, right, low, high] = [lowest(east), -lowest(east.map((v) => -v)), lowest(north), -lowest(north.map((v) => -v))];
    const scale = Math.min((width - 40) / Math.max(1, right - left), (height - 40) / Math.max(1, high - low));
    this.x = (e) => width / 2 + (e - (left + right) / 2) * scale;
    this.y = (n) => height / 2 - (n - (low + high) / 2) * scale;
    this.line(ctx, 0, east.length, "#9ca3af", 1);
    for (const one of this.maneuvers) {
      const first = firstAt(this.track.t_s, one.start_s), last = firstAt(this.track.t_s, one.end_s);
      const colour = TRACK_COLOURS[(one.number - 1) % TRACK_COLOURS.length];
      this.line(ctx, first, last + 1, colour, 2.5);
      if (first < east.length && north[first] !== null) {
        ctx.fillStyle = colour;
        ctx.font = "11px sans-serif";
        ctx.fillText(one.number, this.x(east[first]) + 4, this.y(north[first]) - 4);
      }
    }
    this.scaleBar(ctx, scale, height);
    ctx.fillStyle = "#374151";
    ctx.font = "12px sans-serif";
    ctx.fillText("N \u2191", width - 30, 18);
    if (this.now !== null) this.dot(ctx);
  }

  line(ctx, first, last, colour, thick) {
    ctx.strokeStyle = colour;
    ctx.lineWidth = thick;
    ctx.beginPath();
    let pen = false;
    for (let k = first; k < Math.min(last, this.track.t_s.length); k++) {
      const e = this.track.east_m[k], n = this.track.north_m[k];
      if (e === null || n === null) { pen = false; continue; }
      if (pen) ctx.lineTo(this.x(e), this.y(n)); else ctx.moveTo(this.x(e), this.y(n));
      pen = true;
    }
    ctx.stroke();
  }

  scaleBar(ctx, scale, height) {
    const wanted = 80 / scale, power = 10 ** Math.floor(Math.log10(wanted));
    const metres = power * (wanted / power >= 5 ? 5 : wanted / power >= 2 ? 2 : 1);
    ctx.fillStyle = ctx.strokeStyle = "#374151";
    ctx.lineWidth = 1;
    ctx.strokeRect(10, height - 10, metres * scale, 0);
    ctx.font = "11px sans-serif";
    ctx.fillText(`${metres} m`, 10, height - 14);
  }

  dot(ctx) {
    const k = Math.min(firstAt(this.track.t_s, this.now), this.track.t_s.length - 1);
    const e = this.track.east_m[k], n = this.track.north_m[k];
    if (e === null || n === null) return;
    ctx.fillStyle = "#111827";
    ctx.beginPath();
    ctx.arc(this.x(e), this.y(n), 4, 0, 7);
    ctx.fill();
  }

  at(t) {
    this.now = t;
    if (!this.waiting) {
      this.waiting = true;
      requestAnimationFrame(() => { this.waiting = false; this.draw(); });
    }
  }
}

function lowest(values) {
  return values.reduce((least, one) => (one !== null && one < least ? one : least), Infinity);
}
