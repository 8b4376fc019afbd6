/* Two SurfaceViews beside each other: what they show, how they turn, what is picked, mirror images, bull's-eyes. */

class Pane {
  constructor(place, board) {
    this.place = place;
    this.board = board;
    this.stage = place.querySelector(".stage");
    this.chooser = place.querySelector("select");
    this.chooser.hidden = this.chooser.options.length < 2; // nothing to choose: the heading names it
    this.chooser.addEventListener("change", () => this.show(Number(this.chooser.value)).catch((error) => this.fail(error)));
    this.picked = null;
    this.chose = false; // the picked vertex was chosen by a step, not by hand
    this.key = new ColourKey(place.querySelector(".key"), (value) => board.highlight(value === null ? null : { value, name: this.labelName(value) }));
  }

  fail(error) {
    const note = this.place.querySelector(".loading");
    note.hidden = false;
    console.error(error);
    note.textContent = `The surface cannot be shown: ${error.message}`;
  }

  async show(index) {
    const info = this.board.infos[index];
    this.place.querySelector(".loading").hidden = false;
    const data = await this.board.unpacked(index);
    // A canvas keeps its context: a new surface gets a new canvas.
    const old = this.stage.querySelector("canvas"), canvas = old.cloneNode();
    old.replaceWith(canvas);
    if (this.view) this.view.gl.getExtension("WEBGL_lose_context")?.loseContext();
    this.info = info;
    this.data = data;
    this.view = new SurfaceView(canvas, data.positions, data.faces, info.missing);
    this.view.onpick = (vertex) => this.board.pick(this, vertex);
    this.view.onreset = () => this.board.look(info.first);
    this.view.ondraw = () => {
      drawRuler(this.view, this.place.querySelector(".scale-bar"), this.place.querySelector(".scale-text"), info.unit);
      this.board.turned(this);
    };
    this.picked = null;
    this.place.querySelector(".readout").replaceChildren();
    const cautions = this.place.querySelector(".cautions");
    cautions.hidden = !info.notes.length;
    cautions.replaceChildren(...info.notes.map((text) => element("p", {}, text)));
    this.place.querySelector(".loading").hidden = true;
    this.look(info.first);
    this.board.changed();
  }

  /** Look from a side, the shape filling the canvas: the zoom that others follow is relative to this. */
  look(side) {
    this.board.turning = true;
    this.view.look(this.info.cameras[side]);
    this.board.turning = false;
  }

  /** The values of the layer of this name, with its limits; nothing where the surface has none. */
  layer(name) {
    const at = this.info.layers.findIndex((layer) => layer.name === name);
    return at < 0 ? null : { about: this.info.layers[at], values: this.data.layers[at] };
  }

  /** Whether a layer only shows where a map leads: its values are colours, not sizes. */
  isMap(name) {
    return this.info.maps.some((map) => map.name === name);
  }

  /** What the shown layer calls a label; surfaces may mean different things by one number. */
  labelName(value) {
    const labels = this.layer(byId("layer").value)?.about.labels;
    return labels ? labels.names[labels.values.indexOf(value)] : undefined;
  }

  /** Show a layer: labels in their colours, one alone if it is chosen; values as `scale` says. */
  paint(name, scale, chosen) {
    const layer = this.layer(name), labels = layer && layer.about.labels;
    if (labels) {
      const known = chosen && this.labelName(chosen.value) === chosen.name ? chosen.value : null;
      this.view.paint(placedLabels(layer.values, labels), true);
      this.view.useTable(labelTable(labels, known));
      this.key.legend(layer.about, this.info.count, known);
      this.bullseye(layer, name, (value) => labels.colours[labels.values.indexOf(value)]);
      return;
    }
    this.view.useTable(scale.table);
    const values = layer ? layer.values : new Float32Array(this.info.count).fill(NaN);
    const place = (value) => placed([value], scale.low, scale.high, scale.logarithmic)[0];
    this.view.paint(placed(values, scale.low, scale.high, scale.logarithmic));
    if (layer && this.isMap(name)) this.key.matched(layer.about);
    else if (layer) this.key.bar(layer.about, values, scale);
    else this.key.place.replaceChildren(element("p", { class: "hint" }, `This surface has no values called ${name}; it is grey.`));
    this.bullseye(layer, name, (value) => {
      const at = 3 * Math.round(255 * Math.min(Math.max(place(value), 0), 1));
      return `#${Array.from(scale.table.slice(at, at + 3), (part) => part.toString(16).padStart(2, "0")).join("")}`;
    });
  }

  /** The bull's-eye of the means by segment, in the colours that the surface has. */
  bullseye(layer, name, colourOf) {
    const place = this.place.querySelector(".bullseye");
    place.hidden = !(this.data.segments && layer);
    if (place.hidden) return;
    const colour = (value) => {
      const css = Number.isFinite(value) && colourOf(value) || "#c9ced4", [r, g, b] = rgbOf(css);
      return { css, dark: 0.3 * r + 0.59 * g + 0.11 * b < 130 };
    };
    const first = (number) => this.data.segments.indexOf(number);
    place.replaceChildren(drawBullseye(segmentMeans(layer.values, this.data.segments), colour, name, (number) => {
      const vertex = first(number);
      if (vertex >= 0) this.board.pick(this, vertex);
    }));
  }

  /** Look from where a map is seen best. */
  lookAlong(map) {
    const rows = this.info.maps[map]?.camera;
    if (!rows) return;
    this.board.turning = true;
    this.view.look(rows);
    this.board.turning = false;
  }

  /**
   * The vertex picked by hand if the map takes it anywhere, else the one that it takes farthest, both ends facing the
   * viewer if possible: a step always shows something.
   */
  carried(map) {
    const images = map === null ? null : this.data.maps[map];
    if (!images || (this.picked !== null && !this.chose && images[this.picked] > 0)) return this.picked;
    this.chose = true;
    const at = this.data.positions, { normals, rotation } = this.view;
    const facing = (vertex) => dot(rotation[2], normals.subarray(3 * vertex, 3 * vertex + 3)) > 0.2;
    let farthest = -1, chosen = this.picked;
    for (let v = 0; v < images.length; v++) {
      if (!images[v]) continue;
      const w = 3 * (images[v] - 1);
      const moved = Math.hypot(at[3 * v] - at[w], at[3 * v + 1] - at[w + 1], at[3 * v + 2] - at[w + 2]);
      const apart = moved * (facing(v) && facing(w / 3) ? 1 : 0.3);
      if (apart > farthest) [farthest, chosen] = [apart, v];
    }
    return chosen;
  }

  /** Show a vertex and, under the chosen map, its mirror image. */
  select(vertex, map) {
    this.picked = vertex;
    const image = map === null || !this.data.maps[map] ? -1 : this.data.maps[map][vertex] - 1;
    this.view.mirrored = image >= 0 ? image : null;
    this.view.mark(vertex);
    const table = element("table"), body = element("tbody");
    const row = (name, text) => {
      const line = element("tr");
      line.append(element("th", { scope: "row" }, name), element("td", {}, text));
      body.append(line);
    };
    row("Vertex", String(vertex));
    if (map !== null && this.data.maps[map]) row(this.info.maps[map].name, image >= 0 ? `vertex ${image}` : "none here");
    if (this.data.segments) row("AHA segment", this.data.segments[vertex] ? String(this.data.segments[vertex]) : "none (base)");
    this.info.layers.forEach(({ name, labels }, i) => {
      if (this.isMap(name)) return;
      const value = this.data.layers[i][vertex];
      row(name, labels ? labels.names[labels.values.indexOf(value)] ?? "no value" : readable(value));
    });
    table.append(body);
    const charts = this.data.histograms.map((values, i) => {
      const bins = this.info.bins[i], edges = Array.from({ length: bins + 1 }, (_, bin) => bin);
      return drawHistogram(this.info.histograms[i], Array.from(values.subarray(vertex * bins, (vertex + 1) * bins)), edges);
    });
    this.place.querySelector(".readout").replaceChildren(table, ...charts);
  }
}

class Board {
  constructor(infos) {
    this.infos = infos;
    this.kept = new Map();
    this.map = null;
    this.chosen = null;
    this.turning = false;
    this.panes = [...document.querySelectorAll(".pane")].map((place) => new Pane(place, this));
  }

  async unpacked(index) {
    if (!this.kept.has(index)) {
      const info = this.infos[index], all = (packs) => Promise.all(packs.map(unpack));
      const [positions, codes] = await all([info.positions, info.faces]);
      this.kept.set(index, {
        positions, faces: undelta(codes),
        layers: await all(info.layers.map((layer) => layer.values)),
        histograms: await all(info.histogramArrays),
        maps: await all(info.maps.map((map) => map.values)),
        segments: info.segments ? await unpack(info.segments) : null,
      });
    }
    return this.kept.get(index);
  }

  async start() {
    this.tables = {};
    for (const [name, table] of Object.entries(this.infos[0].tables)) this.tables[name] = await unpack(table);
    for (const id of ["map", "scale", "common"]) byId(id).addEventListener("change", () => this.paint());
    byId("layer").addEventListener("change", () => this.highlight(null));
    byId("linked").addEventListener("change", () => this.turned(this.panes[0]));
    for (const button of document.querySelectorAll("[data-side]")) button.addEventListener("click", () => this.look(button.dataset.side));
    byId("previous").addEventListener("click", () => this.step(-1));
    byId("next").addEventListener("click", () => this.step(1));
    for (const id of ["linked", "common"]) byId(id).closest(".check").hidden = this.panes.length < 2;
    for (const pane of this.panes) await pane.show(Number(pane.chooser.value));
    if (!byId("stepper").hidden) this.step(1);
    this.stepped = true; // from now on a layer that is no map's was chosen by hand
    window.pliant = this; // for scripts and tests
    document.documentElement.dataset.ready = "true";
  }

  /** After a surface was chosen: offer what any of them has, keep what was chosen. */
  changed() {
    const shown = this.panes.filter((pane) => pane.view);
    const names = [...new Set(shown.flatMap((pane) => pane.info.layers.map((layer) => layer.name)))];
    const chooser = byId("layer"), before = chooser.value;
    chooser.replaceChildren(...names.map((name) => element("option", { value: name }, name)));
    if (names.includes(before)) chooser.value = before;
    const most = Math.max(...shown.map((pane) => pane.info.maps.length));
    byId("stepper").hidden = !most;
    if (this.map !== null && this.map >= most) this.map = null;
    this.paint();
  }

  /** Show one label alone, on every surface that has it; all with null. */
  highlight(value) {
    this.chosen = value;
    this.paint();
  }

  limits(pane, name, logarithmic) {
    const about = pane.layer(name)?.about;
    if (!about) return [0, 1];
    if (about.single) return [about.low, about.low];
    return logarithmic && about.low_positive > 0 ? [about.low_positive, about.high] : [about.low, about.high];
  }

  paint() {
    const shown = this.panes.filter((pane) => pane.view), name = byId("layer").value;
    const labelled = shown.every((pane) => !pane.layer(name) || pane.layer(name).about.labels);
    for (const id of ["map", "scale", "common"]) byId(id).disabled = labelled;
    const valued = (pane) => pane.layer(name) && !pane.layer(name).about.labels;
    const positive = shown.every((pane) => !valued(pane) || pane.layer(name).about.low_positive > 0);
    byId("scale").querySelector("[value=log]").disabled = !positive;
    if (!positive) byId("scale").value = "linear";
    const logarithmic = byId("scale").value === "log", table = this.tables[byId("map").value];
    const own = shown.map((pane) => this.limits(pane, name, logarithmic));
    const having = own.filter((_, i) => valued(shown[i]));
    const both = [Math.min(...having.map((ends) => ends[0])), Math.max(...having.map((ends) => ends[1]))];
    shown.forEach((pane, i) => {
      const [low, high] = byId("common").checked && having.length ? both : own[i];
      pane.paint(name, { low, high: high > low ? high : low + 1, single: !(high > low), logarithmic, table }, this.chosen);
    });
  }

  look(side) {
    for (const pane of this.panes) if (pane.view) pane.look(side);
  }

  /** Turn and zoom the other pane as this one was. */
  turned(pane) {
    if (this.turning || !byId("linked").checked) return;
    for (const other of this.panes) {
      if (other === pane || !other.view) continue;
      const view = other.view, rotation = pane.view.rotation, enlarged = pane.view.enlarged;
      if (view.rotation.flat().every((value, i) => value === rotation.flat()[i]) && view.enlarged === enlarged) continue;
      this.turning = true;
      view.rotation = rotation.map((row) => row.slice());
      view.enlarged = enlarged;
      view.keepInside();
      if (pane.view.motion.moving) view.motion.stir();
      view.draw(view.motion.detail);
      this.turning = false;
    }
  }

  pick(pane, vertex) {
    for (const one of this.panes) {
      if (one !== pane && !(one.view && one.info.count === pane.info.count)) continue;
      one.chose = false;
      one.select(vertex, this.map);
    }
  }

  /** Show the layer of a map, if every surface has maps or one's layer is shown already: others are not greyed. */
  colourBy(named) {
    const shown = this.panes.filter((pane) => pane.view), chooser = byId("layer");
    const isMap = (name) => shown.some((pane) => pane.isMap(name));
    if (!shown.some((pane) => pane.layer(named)) || chooser.value === named) return;
    if (!isMap(chooser.value) && (this.stepped || !shown.every((pane) => pane.info.maps.length))) return;
    chooser.value = named;
    this.paint();
  }

  step(by) {
    const most = Math.max(...this.panes.filter((pane) => pane.view).map((pane) => pane.info.maps.length));
    const at = (this.map === null ? -1 : this.map) + by;
    this.map = at < 0 ? (by < 0 && this.map === null ? most - 1 : null) : at >= most ? null : at;
    const named = this.map === null ? null : this.panes.find((pane) => pane.view && pane.info.maps[this.map]).info.maps[this.map].name;
    byId("step").textContent = named === null ? "none" : `${named}, ${this.map + 1} of ${most}`;
    if (named !== null) this.colourBy(named);
    for (const pane of this.panes) {
      if (pane.view && named !== null) pane.lookAlong(this.map);
      const vertex = pane.view ? pane.carried(this.map) : null;
      if (vertex !== null) pane.select(vertex, this.map);
    }
  }
}

const board = new Board(JSON.parse(byId("surfaces").textContent));
board.start().catch((error) => board.panes.forEach((pane) => pane.fail(error)));
