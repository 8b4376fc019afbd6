/* Symmetries of one SurfaceView: a button shows one, lines join points with their images, a picked point is followed. */

/** A SurfaceView with a second marker, the image of the first. */
class MirrorView extends SurfaceView {
  drawMarker(ratio) {
    super.drawMarker(ratio);
    if (this.mirrored === undefined || this.mirrored === null) return;
    const marked = this.marked;
    this.marked = this.mirrored;
    super.drawMarker(ratio * 0.7);
    this.marked = marked;
  }
}

class SymmetryPage {
  constructor(info, view, layers, maps, table) {
    Object.assign(this, { info, view, layers, maps, shown: 0, picked: null });
    view.useTable(table);
  }

  /** Show a symmetry: its colours, its lines, from where they are seen best. */
  show(number) {
    this.shown = number;
    for (const button of document.querySelectorAll("[data-symmetry]")) {
      button.setAttribute("aria-pressed", String(Number(button.dataset.symmetry) === number));
    }
    const { low, high } = this.info.layers[number];
    this.view.paint(placed(this.layers[number], low, high > low ? high : low + 1, false));
    this.look(this.info.firsts[number]);
    this.make();
    if (this.picked !== null) this.select(this.picked);
  }

  look(side) {
    this.view.look(this.info.cameras[side]);
  }

  /** Make the lines and dots of the shown symmetry; drawing places them. */
  make() {
    const shape = (name, attributes) => {
      const made = document.createElementNS("http://www.w3.org/2000/svg", name);
      for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
      return made;
    };
    const most = Math.min(Number(byId("drawn").value), this.info.ends[this.shown].length);
    byId("count").textContent = String(most);
    this.links = this.info.ends[this.shown].slice(0, most).map((from) => ({
      from, to: this.maps[this.shown][from] - 1,
      line: shape("line", {}), dots: [shape("circle", { r: 2.6 }), shape("circle", { r: 2.6 })],
    }));
    byId("links").replaceChildren(...this.links.flatMap(({ line, dots }) => [line, ...dots]));
    this.view.redraw();
  }

  /** Put lines where the surface is; what turns away from the viewer is faint. */
  trace() {
    drawRuler(this.view, byId("scale-bar"), byId("scale-text"), this.info.unit);
    const towards = this.view.rotation[2];
    const facing = (vertex) => dot(towards, Array.from(this.view.normals.subarray(3 * vertex, 3 * vertex + 3))) > 0;
    for (const { from, to, line, dots } of this.links || []) {
      const ends = [from, to], places = ends.map((vertex) => this.view.project(vertex));
      const front = ends.map(facing);
      [["x1", 0, 0], ["y1", 0, 1], ["x2", 1, 0], ["y2", 1, 1]].forEach(([name, end, axis]) =>
        line.setAttribute(name, places[end][axis].toFixed(1)));
      line.setAttribute("opacity", front[0] && front[1] ? 0.75 : front[0] || front[1] ? 0.4 : 0.16);
      dots.forEach((spot, end) => {
        spot.setAttribute("cx", places[end][0].toFixed(1));
        spot.setAttribute("cy", places[end][1].toFixed(1));
        spot.setAttribute("opacity", front[end] ? 1 : 0.3);
      });
    }
  }

  select(vertex) {
    const image = this.maps[this.shown][vertex] - 1;
    this.picked = vertex;
    this.view.mirrored = image >= 0 ? image : null;
    this.view.mark(vertex);
    byId("vertex").value = vertex;
    byId("vertex-error").hidden = true;
    byId("told").textContent = image >= 0
      ? `Vertex ${vertex} is carried to vertex ${image}, the smaller mark.` : `Vertex ${vertex} is not carried anywhere.`;
  }

  selectTyped() {
    const text = byId("vertex").value.trim(), vertex = Number(text);
    const valid = text !== "" && Number.isInteger(vertex) && vertex >= 0 && vertex < this.maps[0].length;
    byId("vertex-error").hidden = valid;
    byId("vertex").setAttribute("aria-invalid", String(!valid));
    if (!valid) return;
    this.view.face(vertex);
    this.select(vertex);
  }

  join() {
    for (const button of document.querySelectorAll("[data-symmetry]")) {
      button.addEventListener("click", () => this.show(Number(button.dataset.symmetry)));
    }
    for (const button of document.querySelectorAll("[data-side]")) {
      button.addEventListener("click", () => this.look(button.dataset.side));
    }
    byId("drawn").addEventListener("input", () => this.make());
    byId("vertex-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.selectTyped();
    });
    this.view.onpick = (vertex) => this.select(vertex);
    this.view.onreset = () => this.look(this.info.firsts[this.shown]);
    this.view.ondraw = () => this.trace();
  }
}

async function start() {
  if (!("DecompressionStream" in window)) throw new Error("This browser cannot unpack the data.");
  const info = JSON.parse(byId("surface-data").textContent), count = info.layers.length;
  const [table, positions, codes, ...arrays] = await Promise.all(
    [info.tables.viridis, info.positions, info.faces, ...info.layers.map((layer) => layer.values), ...info.maps].map(unpack));
  const view = new MirrorView(byId("canvas"), positions, undelta(codes), info.missing);
  const page = new SymmetryPage(info, view, arrays.slice(0, count), arrays.slice(count), table);
  page.join();
  page.show(0);
  byId("canvas").addEventListener("webglcontextlost", () => fail(new Error("The graphics driver stopped.")));
  byId("loading").hidden = true;
  window.pliant = { view, page }; // for scripts and tests
  document.documentElement.dataset.ready = "true";
}

function fail(error) {
  byId("loading").hidden = false;
  byId("loading").textContent = `The surface cannot be shown: ${error.message} Open the page in a browser from 2023 or later with WebGL 2 turned on. The tables below hold the numbers.`;
}

start().catch(fail);
