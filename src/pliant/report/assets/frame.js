/* What the pages of one surface share: sides to look from, a vertex by its number, the ruler, how a page starts. */

class SurfacePage {
  constructor(info, view) {
    Object.assign(this, { info, view, count: view.positions.length / 3 });
  }

  /** The camera to begin with. */
  get first() {
    return this.info.first;
  }

  look(side) {
    this.view.look(this.info.cameras[side]);
  }

  /** Mark a vertex that was picked or typed; pages say more about it. */
  select(vertex) {
    this.view.mark(vertex);
    byId("vertex").value = vertex;
    byId("vertex").setAttribute("aria-invalid", "false");
    byId("vertex-error").hidden = true;
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

  drawn() {
    drawRuler(this.view, document.querySelector(".scale-bar"), document.querySelector(".scale-text"), this.info.unit);
  }

  join() {
    byId("vertex-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.selectTyped();
    });
    for (const button of document.querySelectorAll("[data-side]")) {
      button.addEventListener("click", () => this.look(button.dataset.side));
    }
    this.view.onpick = (vertex) => this.select(vertex);
    this.view.onreset = () => this.look(this.first);
    this.view.ondraw = () => this.drawn();
  }
}

/** Unpack what the page carries and start it: `build` gets the data, the view and the layers, and returns the page. */
async function startPage(build) {
  try {
    if (!("DecompressionStream" in window)) throw new Error("This browser cannot unpack the data.");
    const info = JSON.parse(byId("surface-data").textContent);
    const [positions, codes, ...layers] = await Promise.all([info.positions, info.faces, ...info.layers.map((layer) => layer.values)].map(unpack));
    const view = new SurfaceView(byId("canvas"), positions, undelta(codes), info.missing);
    byId("canvas").addEventListener("webglcontextlost", () => fail(new Error("The graphics driver stopped.")));
    const page = await build(info, view, layers);
    byId("loading").hidden = true;
    window.pliant = { view, page }; // for scripts and tests
    document.documentElement.dataset.ready = "true";
  } catch (error) {
    fail(error);
  }
}

function fail(error) {
  console.error(error);
  byId("loading").hidden = false;
  byId("loading").textContent = `The surface cannot be shown: ${error.message} Open the page in a browser from 2023 or later with WebGL 2 turned on. The tables below hold the numbers.`;
}
