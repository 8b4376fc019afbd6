"use strict";

/* What every page around a SurfaceView needs: unpacking, numbers to read, elements, histograms, colours of values. */

const byId = (id) => document.getElementById(id);

/** Unpack an array that the page carries: base64 of deflated bytes, least significant bytes of all elements first. */
async function unpack({ kind, length, data }) {
  const packed = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const Kind = { float32: Float32Array, uint32: Uint32Array, uint8: Uint8Array }[kind];
  const size = Kind.BYTES_PER_ELEMENT, bytes = new Uint8Array(length * size);
  for (let plane = 0; plane < size; plane++) {
    for (let i = 0; i < length; i++) bytes[i * size + plane] = planes[plane * length + i];
  }
  return new Kind(bytes.buffer);
}

/** Undo the coding of whole numbers as zigzag differences. */
function undelta(codes) {
  const values = new Uint32Array(codes.length);
  let value = 0;
  for (let i = 0; i < codes.length; i++) {
    value += (codes[i] >>> 1) ^ -(codes[i] & 1);
    values[i] = value;
  }
  return values;
}

/** A number to read: five digits, powers of ten where they are shorter. */
function readable(value) {
  if (!Number.isFinite(value)) return "no value";
  const size = Math.abs(value);
  if (value !== 0 && (size < 1e-3 || size >= 1e6)) {
    const [digits, power] = value.toExponential(3).split("e");
    const raised = String(Number(power)).replace(/[-0-9]/g, (c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]));
    return `${String(Number(digits)).replace("-", "−")} × 10${raised}`;
  }
  return String(Number(value.toPrecision(5))).replace("-", "−");
}

/** A number as it is put into an input. */
function typed(value) {
  const size = Math.abs(value);
  return value !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential(4) : String(Number(value.toPrecision(5)));
}

function element(name, attributes = {}, text = "") {
  const svg = ["svg", "rect", "line", "text", "g", "path", "circle", "title"].includes(name);
  const made = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
}

/** Draw one vertex's histogram as SVG: bars, the edges' first, middle and last value, the largest share. */
function drawHistogram(caption, counts, edges) {
  const width = 300, height = 112, left = 34, right = 6, base = 90, top = 8;
  const total = counts.reduce((sum, count) => sum + count, 0), peak = Math.max(...counts, 0);
  const spoken = `${caption}: ${counts.map(readable).join(", ")}`;
  const svg = element("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": spoken });
  const step = (width - left - right) / counts.length;
  counts.forEach((count, bin) => {
    const tall = peak > 0 ? (base - top) * count / peak : 0;
    const bar = element("rect", { x: left + bin * step + 1, y: base - tall, width: Math.max(step - 2, 1), height: tall, class: "bar" });
    bar.append(element("title", {}, `${readable(edges[bin])} to ${readable(edges[bin + 1])}: ${readable(count)}`));
    svg.append(bar);
  });
  svg.append(element("line", { x1: left, x2: width - right, y1: base, y2: base, class: "axis" }));
  const middle = (counts.length / 2) | 0;
  for (const [bin, anchor] of [[0, "start"], [middle, "middle"], [counts.length, "end"]]) {
    svg.append(element("text", { x: left + bin * step, y: base + 15, "text-anchor": anchor }, readable(edges[bin])));
  }
  svg.append(element("text", { x: left - 5, y: top + 8, "text-anchor": "end" }, readable(peak)));
  svg.append(element("text", { x: left - 5, y: base, "text-anchor": "end" }, "0"));
  const figure = element("figure");
  figure.append(element("figcaption", {}, total > 0 ? caption : `${caption} (no values)`), svg);
  return figure;
}

/** Each value's place in the colour map between two limits (0 to 1, may overshoot), and whether there is a value. */
function placed(values, low, high, logarithmic) {
  const pairs = new Float32Array(2 * values.length);
  const measure = logarithmic ? (value) => Math.log(Math.max(value, 1e-300)) : (value) => value;
  const first = measure(low), span = measure(high) - first;
  for (let i = 0; i < values.length; i++) {
    const known = Number.isFinite(values[i]);
    pairs[2 * i] = known ? Math.min(Math.max((measure(values[i]) - first) / span, -1), 2) : 0;
    pairs[2 * i + 1] = known ? 1 : 0;
  }
  return pairs;
}

/** A colour map as a CSS gradient. */
function gradient(bytes) {
  const stops = [];
  for (let i = 0; i < 256; i += 15) stops.push(`rgb(${bytes.slice(3 * i, 3 * i + 3).join(" ")})`);
  return `linear-gradient(to right, ${stops.join(", ")})`;
}

/** Show in a ruler how long a round length is on the canvas. */
function drawRuler(view, bar, text, unit) {
  const length = 0.25 * view.canvas.clientWidth / view.density, power = 10 ** Math.floor(Math.log10(length));
  const round = [5, 2, 1].find((step) => step * power <= length) * power;
  bar.style.width = `${round * view.density}px`;
  text.textContent = `${readable(round)} ${unit || "units"}`;
}
