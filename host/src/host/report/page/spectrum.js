// Power spectral density of the samples in view: Welch's averages, Hann window, half overlap.
function spectrumOf(t, values) {
  const [even, rate] = evenGrid(t, values);
  let length = 1;
  while (length * 2 <= Math.min(2048, even.length)) length *= 2;
  if (length < 16) return null;
  const mean = even.reduce((sum, one) => sum + one, 0) / even.length;
  const power = new Float64Array(length / 2 + 1);
  let pieces = 0, weight = 0;
  const hann = Float64Array.from({ length }, (_, k) => 0.5 - 0.5 * Math.cos((2 * Math.PI * k) / length));
  for (const one of hann) weight += one * one;
  for (let first = 0; first + length <= even.length; first += length / 2) {
    const re = Float64Array.from({ length }, (_, k) => (even[first + k] - mean) * hann[k]);
    const im = new Float64Array(length);
    fourier(re, im);
    for (let k = 0; k <= length / 2; k++) {
      const sides = k === 0 || k === length / 2 ? 1 : 2;
      power[k] += (sides * (re[k] * re[k] + im[k] * im[k])) / (rate * weight);
    }
    pieces += 1;
  }
  const frequency = Array.from(power, (_, k) => (k * rate) / length);
  return { frequency: frequency.slice(1), density: Array.from(power, (p) => p / pieces).slice(1), pieces };
}

function evenGrid(t, values) {
  const known = [], when = [];
  values.forEach((one, k) => { if (!Number.isNaN(one)) { known.push(one); when.push(t[k]); } });
  if (known.length < 16) return [[], 1];
  const steps = when.slice(1).map((one, k) => one - when[k]).sort((a, b) => a - b);
  const step = steps[steps.length >> 1], count = Math.floor((when[when.length - 1] - when[0]) / step) + 1;
  let at = 0;
  const even = Float64Array.from({ length: count }, (_, k) => {
    const instant = when[0] + k * step;
    while (at < when.length - 2 && when[at + 1] < instant) at += 1;
    const share = Math.min(1, (instant - when[at]) / (when[at + 1] - when[at]));
    return known[at] + share * (known[at + 1] - known[at]);
  });
  return [even, 1 / step];
}

// Cooley and Tukey, in place; the length is a power of two.
function fourier(re, im) {
  const length = re.length;
  for (let k = 1, other = 0; k < length; k++) {
    let bit = length >> 1;
    for (; other & bit; bit >>= 1) other ^= bit;
    other ^= bit;
    if (k < other) [re[k], re[other], im[k], im[other]] = [re[other], re[k], im[other], im[k]];
  }
  for (let size = 2; size <= length; size *= 2) {
    for (let k = 0; k < size / 2; k++) {
      const c = Math.cos((2 * Math.PI * k) / size), s = -Math.sin((2 * Math.PI * k) / size);
      for (let a = k; a < length; a += size) {
        const b = a + size / 2, x = re[b] * c - im[b] * s, y = re[b] * s + im[b] * c;
        re[b] = re[a] - x;
        im[b] = im[a] - y;
        re[a] += x;
        im[a] += y;
      }
    }
  }
}
