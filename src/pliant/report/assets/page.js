"use strict";

/* The page around a SurfaceView: unpacks the data, and joins the controls, the colour bar and the read-outs to it. */

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
  const svg = ["svg", "rect", "line", "text", "g"].includes(name);
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

class Page {
  constructor(info, view, layers, histograms, tables) {
    Object.assign(this, { info, view, layers, histograms, tables });
    this.count = view.positions.length / 3;
    this.layer = 0;
  }

  /** Put the chosen layer on the surface between the chosen limits. */
  paint() {
    const values = this.layers[this.layer], pairs = new Float32Array(2 * this.count);
    const logarithmic = byId("scale").value === "log";
    const ends = [byId("low"), byId("high")].map((input) => Number(input.value));
    const valid = ends[0] < ends[1] && !(logarithmic && ends[0] <= 0);
    byId("limits-error").hidden = valid;
    for (const id of ["low", "high"]) byId(id).setAttribute("aria-invalid", String(!valid));
    if (!valid) return;
    const measure = logarithmic ? (value) => Math.log(Math.max(value, 1e-300)) : (value) => value;
    const low = measure(ends[0]), span = measure(ends[1]) - low;
    for (let i = 0; i < this.count; i++) {
      const known = Number.isFinite(values[i]);
      pairs[2 * i] = known ? Math.min(Math.max((measure(values[i]) - low) / span, -1), 2) : 0;
      pairs[2 * i + 1] = known ? 1 : 0;
    }
    this.view.paint(pairs);
    const middle = logarithmic ? Math.sqrt(ends[0] * ends[1]) : (ends[0] + ends[1]) / 2;
    [ends[0], middle, ends[1]].forEach((value, i) => { byId("bar-ticks").children[i].textContent = readable(value); });
    byId("bar").setAttribute("aria-label", `Colour bar, ${this.info.layers[this.layer].name}: ${readable(ends[0])} to ${readable(ends[1])}`);
  }

  /** Set the limits to the layer's own: percentiles, or for logarithms its positive ones. */
  resetLimits() {
    const layer = this.info.layers[this.layer];
    const logarithmic = byId("scale").value === "log";
    const ends = logarithmic ? [layer.low_positive, layer.high] : [layer.low, layer.high];
    byId("low").value = typed(ends[0]);
    byId("high").value = typed(ends[1]);
    this.paint();
  }

  chooseLayer() {
    this.layer = Number(byId("layer").value);
    const layer = this.info.layers[this.layer], log = byId("scale").querySelector("[value=log]");
    log.disabled = !(layer.low_positive > 0 && layer.low_positive < layer.high);
    if (log.disabled) byId("scale").value = "linear";
    byId("bar-label").textContent = layer.name;
    byId("bar-note").textContent = layer.missing ? `Grey: no value (${layer.missing} vertices).` : "";
    this.resetLimits();
  }

  chooseTable() {
    const bytes = this.tables[byId("map").value], stops = [];
    for (let i = 0; i < 256; i += 15) stops.push(`rgb(${bytes.slice(3 * i, 3 * i + 3).join(" ")})`);
    byId("bar").style.backgroundImage = `linear-gradient(to right, ${stops.join(", ")})`;
    this.view.useTable(bytes);
  }

  /** Show a vertex: its number, position, values, their ranks, and its histograms. */
  select(vertex) {
    this.view.mark(vertex);
    byId("vertex").value = vertex;
    byId("vertex-error").hidden = true;
    const rows = byId("readout");
    rows.replaceChildren();
    const row = (name, text, note = "") => {
      const line = element("tr"), cell = element("td", {}, text);
      if (note) cell.append(element("small", {}, note));
      line.append(element("th", { scope: "row" }, name), cell);
      rows.append(line);
    };
    row("Vertex", String(vertex));
    const position = this.view.positionOf(vertex).map((value) => value.toFixed(this.info.decimals).replace("-", "−"));
    row(`Position${this.info.unit ? ` (${this.info.unit})` : ""}`, position.join(", "));
    this.layers.forEach((values, i) => {
      const known = values.filter(Number.isFinite), below = known.filter((value) => value < values[vertex]).length;
      const rank = Number.isFinite(values[vertex]) ? `percentile ${(100 * below / known.length).toFixed(1)}` : "";
      row(this.info.layers[i].name, readable(values[vertex]), rank);
    });
    const bins = this.info.edges.length - 1, drawn = this.histograms.map((values, i) => drawHistogram(
      this.info.histograms[i], Array.from(values.subarray(vertex * bins, (vertex + 1) * bins)), this.info.edges));
    byId("histograms").replaceChildren(...drawn);
    byId("nothing-picked").hidden = true;
    byId("picked").hidden = false;
  }

  selectTyped() {
    const text = byId("vertex").value.trim(), vertex = Number(text);
    const valid = text !== "" && Number.isInteger(vertex) && vertex >= 0 && vertex < this.count;
    byId("vertex-error").hidden = valid;
    byId("vertex").setAttribute("aria-invalid", String(!valid));
    if (!valid) return;
    this.view.face(vertex);
    this.select(vertex);
  }

  look(side) {
    this.view.look(this.info.cameras[side]);
  }

  join() {
    byId("layer").addEventListener("change", () => this.chooseLayer());
    byId("map").addEventListener("change", () => this.chooseTable());
    byId("scale").addEventListener("change", () => this.resetLimits());
    for (const id of ["low", "high"]) byId(id).addEventListener("change", () => this.paint());
    byId("reset-limits").addEventListener("click", () => this.resetLimits());
    byId("vertex-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.selectTyped();
    });
    for (const button of document.querySelectorAll("[data-side]")) {
      button.addEventListener("click", () => this.look(button.dataset.side));
    }
    this.view.onpick = (vertex) => this.select(vertex);
    this.view.onreset = () => this.look(this.info.first);
    this.view.ondraw = () => {
      const length = 0.25 * this.view.canvas.clientWidth / this.view.density, power = 10 ** Math.floor(Math.log10(length));
      const round = [5, 2, 1].find((step) => step * power <= length) * power;
      byId("scale-bar").style.width = `${round * this.view.density}px`;
      byId("scale-text").textContent = `${readable(round)} ${this.info.unit || "units"}`;
    };
  }
}

async function start() {
  if (!("DecompressionStream" in window)) throw new Error("This browser cannot unpack the data.");
  const info = JSON.parse(byId("surface-data").textContent);
  const [positions, codes, ...arrays] = await Promise.all(
    [info.positions, info.faces, ...info.layers.map((layer) => layer.values), ...info.histogramArrays].map(unpack));
  const tables = {};
  for (const [name, packed] of Object.entries(info.tables)) tables[name] = await unpack(packed);
  const view = new SurfaceView(byId("canvas"), positions, undelta(codes), info.missing);
  const page = new Page(info, view, arrays.slice(0, info.layers.length), arrays.slice(info.layers.length), tables);
  page.join();
  page.chooseTable();
  page.chooseLayer();
  page.look(info.first);
  byId("canvas").addEventListener("webglcontextlost", () => fail(new Error("The graphics driver stopped.")));
  byId("loading").hidden = true;
  window.pliant = { view, page }; // for scripts and tests
  document.documentElement.dataset.ready = "true";
}

function fail(error) {
  byId("loading").hidden = false;
  byId("loading").textContent = `The surface cannot be shown: ${error.message} Open the page in a browser from 2023 or later with WebGL 2 turned on. The tables below hold the summary.`;
}

start().catch(fail);
