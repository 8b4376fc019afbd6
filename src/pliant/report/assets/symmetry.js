/* Symmetries of one SurfaceView: a button shows one, lines join points with their images, a picked point is followed. */

class SymmetryPage extends SurfacePage {
  constructor(info, view, layers, maps, table) {
    super(info, view);
    Object.assign(this, { layers, maps, shown: 0, picked: null });
    view.useTable(table);
  }

  get first() {
    return this.info.firsts[this.shown];
  }

  /** Show a symmetry: its colours, its lines, from where they are seen best. */
  show(number) {
    this.shown = number;
    for (const button of document.querySelectorAll("[data-symmetry]")) {
      button.setAttribute("aria-pressed", String(Number(button.dataset.symmetry) === number));
    }
    const { low, high } = this.info.layers[number];
    this.view.paint(placed(this.layers[number], low, high > low ? high : low + 1, false));
    this.look(this.first);
    this.make();
    if (this.picked !== null) this.select(this.picked);
  }

  /** Make the lines and dots of the shown symmetry; drawing places them. */
  make() {
    const most = Math.min(Number(byId("drawn").value), this.info.ends[this.shown].length);
    byId("count").textContent = String(most);
    this.links = this.info.ends[this.shown].slice(0, most).map((from) => ({
      from, to: this.maps[this.shown][from] - 1,
      line: element("line", {}), dots: [element("circle", { r: 2.6 }), element("circle", { r: 2.6 })],
    }));
    byId("links").replaceChildren(...this.links.flatMap(({ line, dots }) => [line, ...dots]));
    this.view.redraw();
  }

  /** Put lines where the surface is; what turns away from the viewer is faint. */
  drawn() {
    super.drawn();
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
    super.select(vertex);
    byId("told").textContent = image >= 0
      ? `Vertex ${vertex} is carried to vertex ${image}, the smaller mark.` : `Vertex ${vertex} is not carried anywhere.`;
  }

  join() {
    super.join();
    for (const button of document.querySelectorAll("[data-symmetry]")) {
      button.addEventListener("click", () => this.show(Number(button.dataset.symmetry)));
    }
    byId("drawn").addEventListener("input", () => this.make());
  }
}

startPage(async (info, view, layers) => {
  const table = await unpack(info.tables.viridis), maps = await Promise.all(info.maps.map(unpack));
  const page = new SymmetryPage(info, view, layers, maps, table);
  page.join();
  page.show(0);
  return page;
});
