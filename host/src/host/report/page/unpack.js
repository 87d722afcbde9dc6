// Packed channels (packing.py) -> arrays: base64, inflate, sums of differences.
async function inflated(id) {
  const letters = atob(document.getElementById(id).textContent), bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; k++) bytes[k] = letters.charCodeAt(k);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function timesOf(bytes, head) {
  const rows = head.rows, t = new Float64Array(rows);
  let ticks = 0;
  for (let k = 0; k < rows; k++) {
    ticks += bytes[k] + 256 * (bytes[rows + k] + 256 * (bytes[2 * rows + k] + 256 * bytes[3 * rows + k]));
    t[k] = head.start_s + ticks * head.tick_s;
  }
  return t;
}

function valuesOf(bytes, head, channel) {
  const rows = head.rows, at = 4 * rows + 2 * rows * channel, out = new Float64Array(rows);
  const [low, step] = head.scales[channel];
  let number = 0;
  for (let k = 0; k < rows; k++) {
    number = (number + bytes[at + k] + 256 * bytes[at + rows + k]) & 65535;
    out[k] = number === 65535 ? NaN : low + step * number;
  }
  return out;
}

// Samples over a stretch of time, a channel unpacked when it is asked for.
async function samplesOf(id, head) {
  const bytes = await inflated(id), known = new Map();
  return {
    t: timesOf(bytes, head),
    values(channel) {
      if (!known.has(channel)) known.set(channel, valuesOf(bytes, head, channel));
      return known.get(channel);
    },
  };
}
