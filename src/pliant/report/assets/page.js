"use strict";

/* The page around one SurfaceView: joins the controls, the colour bar and the read-outs to it. */

class Page {
  constructor(info, view, layers, histograms, tables) {
    Object.assign(this, { info, view, layers, histograms, tables });
    this.count = view.positions.length / 3;
    this.layer = 0;
  }

  /** Put the chosen layer on the surface between the chosen limits. */
  paint() {
    const logarithmic = byId("scale").value === "log";
    const ends = [byId("low"), byId("high")].map((input) => Number(input.value));
    const valid = ends[0] < ends[1] && !(logarithmic && ends[0] <= 0);
    byId("limits-error").hidden = valid;
    for (const id of ["low", "high"]) byId(id).setAttribute("aria-invalid", String(!valid));
    if (!valid) return;
    this.view.paint(placed(this.layers[this.layer], ends[0], ends[1], logarithmic));
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
    const bytes = this.tables[byId("map").value];
    byId("bar").style.backgroundImage = gradient(bytes);
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
    this.view.ondraw = () => drawRuler(this.view, byId("scale-bar"), byId("scale-text"), this.info.unit);
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
