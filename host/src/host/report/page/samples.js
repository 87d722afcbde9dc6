// What is drawn between two instants: every sample where the page has them, else the overview.
const MOST_POINTS = 40000;

function firstAt(t, instant) {
  let low = 0, high = t.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (t[middle] < instant) low = middle + 1; else high = middle;
  }
  return low;
}

class Samples {
  constructor(meta) {
    this.meta = meta;
    this.stretches = meta.stretches.map((head) => ({
      head, from: head.start_s, to: head.end_s, samples: null,
    }));
  }

  async load() {
    this.overview = await samplesOf("overview", this.meta.overview);
    this.from = this.overview.t[0];
    this.to = this.overview.t[this.overview.t.length - 1];
    if (!(this.to > this.from)) this.to = this.from + 1;
  }

  // Unpack what a view needs; true if something new is there.
  async want(from, to) {
    const missing = this.parts(from, to).filter((one) => !one.samples);
    for (const one of missing) {
      one.samples = await samplesOf(`stretch${this.stretches.indexOf(one)}`, one.head);
    }
    return missing.length > 0;
  }

  // Stretches of whole samples in a view, none where they would be more than can be drawn.
  parts(from, to) {
    const seen = this.stretches.filter((one) => one.from < to && one.to > from);
    const points = seen.reduce((sum, one) => sum + one.head.rows
      * (Math.min(to, one.to) - Math.max(from, one.from)) / Math.max(1e-9, one.to - one.from), 0);
    return points > MOST_POINTS ? [] : seen;
  }

  // [t, values of each channel], null where nothing was measured; one point more on either side.
  between(from, to, channels) {
    const out = [[], ...channels.map(() => [])];
    const add = (samples, low, high) => {
      const first = Math.max(0, firstAt(samples.t, low) - 1);
      const last = Math.min(samples.t.length, firstAt(samples.t, high) + 1);
      const start = out[0].length ? out[0][out[0].length - 1] : -Infinity;
      const columns = channels.map((channel) => samples.values(channel));
      for (let k = first; k < last; k++) {
        if (samples.t[k] <= start) continue;
        out[0].push(samples.t[k]);
        columns.forEach((column, n) => out[n + 1].push(Number.isNaN(column[k]) ? null : column[k]));
      }
    };
    let at = from;
    for (const one of this.parts(from, to).filter((part) => part.samples)) {
      if (one.from > at) add(this.overview, at, one.from);
      while (out[0].length && out[0][out[0].length - 1] >= one.from) out.forEach((column) => column.pop());
      add(one.samples, Math.max(at, one.from), Math.min(to, one.to));
      at = one.to;
    }
    if (at < to) add(this.overview, at, to);
    return out;
  }

  // The samples themselves, without overview, for a spectrum; null where the page has none there.
  whole(from, to, channel) {
    if (!this.meta.stretches.length) {
      return this.meta.whole ? this.cut(this.overview, from, to, channel) : null;
    }
    const one = this.stretches.filter((part) => part.samples)
      .find((part) => part.from <= from + 1e-6 && part.to >= to - 1e-6)
      || this.stretches.find((part) => part.samples && part.from < to && part.to > from);
    return one ? this.cut(one.samples, from, to, channel) : null;
  }

  cut(samples, from, to, channel) {
    const first = firstAt(samples.t, from), last = firstAt(samples.t, to);
    return [samples.t.slice(first, last), samples.values(channel).slice(first, last)];
  }
}
