/* The page around one SurfaceView: joins the controls, what colours mean and the read-outs to it. */

class LayerPage extends SurfacePage {
  constructor(info, view, layers, histograms, tables) {
    super(info, view);
    Object.assign(this, { layers, histograms, tables, layer: 0, chosen: null });
    this.key = new ColourKey(byId("key"), (value) => {
      this.chosen = value;
      this.paint();
    });
  }

  /** Put the chosen layer on the surface: labels in their own colours, values between the chosen limits. */
  paint() {
    const layer = this.info.layers[this.layer], values = this.layers[this.layer];
    if (layer.labels) {
      this.view.paint(placedLabels(values, layer.labels), true);
      this.view.useTable(labelTable(layer.labels, this.chosen));
      this.key.legend(layer, this.count, this.chosen);
      return;
    }
    const logarithmic = byId("scale").value === "log";
    const [low, high] = ["low", "high"].map((id) => Number(byId(id).value));
    const valid = low < high && !(logarithmic && low <= 0);
    byId("limits-error").hidden = valid;
    for (const id of ["low", "high"]) byId(id).setAttribute("aria-invalid", String(!valid));
    if (!valid) return;
    const table = this.tables[byId("map").value];
    this.view.paint(placed(values, low, high, logarithmic));
    this.view.useTable(table);
    const single = layer.single && low === Number(typed(layer.low)) && high === Number(typed(layer.high));
    this.key.bar(layer, values, { low, high, single, logarithmic, table });
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
    byId("continuous").hidden = Boolean(layer.labels);
    this.chosen = null;
    this.resetLimits();
  }

  /** Show a vertex: its number, position, values, their ranks, and its histograms. */
  select(vertex) {
    super.select(vertex);
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
      const { name, labels } = this.info.layers[i];
      if (labels) {
        row(name, labels.names[labels.values.indexOf(values[vertex])] ?? "no value");
        return;
      }
      const known = values.filter(Number.isFinite), below = known.filter((value) => value < values[vertex]).length;
      const rank = Number.isFinite(values[vertex]) ? `percentile ${(100 * below / known.length).toFixed(1)}` : "";
      row(name, readable(values[vertex]), rank);
    });
    const bins = this.info.edges.length - 1, drawn = this.histograms.map((values, i) => drawHistogram(
      this.info.histograms[i], Array.from(values.subarray(vertex * bins, (vertex + 1) * bins)), this.info.edges));
    byId("histograms").replaceChildren(...drawn);
    byId("nothing-picked").hidden = true;
    byId("picked").hidden = false;
  }

  join() {
    super.join();
    byId("layer").addEventListener("change", () => this.chooseLayer());
    byId("map").addEventListener("change", () => this.paint());
    byId("scale").addEventListener("change", () => this.resetLimits());
    for (const id of ["low", "high"]) byId(id).addEventListener("change", () => this.paint());
    byId("reset-limits").addEventListener("click", () => this.resetLimits());
  }
}

startPage(async (info, view, layers) => {
  const histograms = await Promise.all(info.histogramArrays.map(unpack)), tables = {};
  for (const [name, packed] of Object.entries(info.tables)) tables[name] = await unpack(packed);
  const page = new LayerPage(info, view, layers, histograms, tables);
  page.join();
  page.chooseLayer();
  page.look(page.first);
  return page;
});
