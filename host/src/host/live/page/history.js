// The last seconds of every column, as arrays that uPlot draws: null where there is no value.

const SPARE = 2; // times the window, before what is older is thrown away

function thinned(column, start, few, isTime) {
  const out = [];
  for (let at = start; at < column.length; at += few) {
    const end = Math.min(at + few, column.length);
    if (isTime) {
      out.push(column[at], column[(at + end) >> 1]);
      continue;
    }
    let [least, most] = [at, at];
    for (let one = at; one < end; one += 1) {
      if (column[one] === null || column[least] === null || column[most] === null) {
        if (column[one] !== null) least = most = one;
      } else if (column[one] < column[least]) least = one;
      else if (column[one] > column[most]) most = one;
    }
    out.push(column[Math.min(least, most)], column[Math.max(least, most)]);
  }
  return out;
}

export class History {
  constructor(columns, windowS) {
    this.columns = columns;
    this.windowS = windowS;
    this.values = new Map(columns.map((name) => [name, []]));
    this.arrived = []; // of rows not drawn yet: when the computer read them, ms
    this.forgotten = 0; // rows thrown away
    this.lastT = null;
    this.lastAt = -Infinity; // performance.now() of the last row
  }

  // Take a message of the server: time of arrival, number of rows, rows (see live_session.py).
  add(numbers) {
    const count = numbers[1];
    const width = this.columns.length;
    for (let row = 0; row < count; row += 1) {
      const at = 2 + row * width;
      if (this.lastT !== null && numbers[at] < this.lastT - 5) this.clear();
      for (let column = 0; column < width; column += 1) {
        const given = numbers[at + column];
        this.values.get(this.columns[column]).push(Number.isFinite(given) ? given : null);
      }
      this.lastT = numbers[at];
    }
    this.arrived.push(numbers[0]);
    if (this.arrived.length > 1000) this.arrived.shift();
    this.lastAt = performance.now();
    this.forget();
  }

  clear() {
    this.forgotten = this.made; // numbers of rows are never used again
    for (const column of this.values.values()) column.length = 0;
  }

  forget() {
    const t = this.values.get("t_s");
    if (t.length < 64 || t[t.length - 1] - t[0] < SPARE * this.windowS) return;
    const cut = this.firstInWindow();
    this.forgotten += cut;
    for (const column of this.values.values()) column.splice(0, cut);
  }

  firstInWindow() {
    const t = this.values.get("t_s");
    const from = t[t.length - 1] - this.windowS;
    let low = 0;
    let high = t.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (t[middle] < from) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  // Columns of the window; of more rows than pixels the least and the greatest of each few, so that
  // no peak is lost. The few are the same from redraw to redraw: nothing shimmers.
  window(names, first, pixels) {
    const count = this.values.get("t_s").length - first;
    const few = Math.ceil(count / pixels);
    if (few <= 2) return names.map((name) => this.values.get(name).slice(first));
    const start = first + ((few - ((this.forgotten + first) % few)) % few);
    return names.map((name) => thinned(this.values.get(name), start, few, name === "t_s"));
  }

  // Rows since the beginning: number of the next one.
  get made() {
    return this.forgotten + this.values.get("t_s").length;
  }

  last(name) {
    const column = this.values.get(name);
    return column && column.length ? column[column.length - 1] : null;
  }

  // The aircraft's clock now: a second at most is added to that of the last row.
  now() {
    return this.lastT + Math.min(1, (performance.now() - this.lastAt) / 1000);
  }
}
