/*
 * SurfaceView draws a triangle mesh with one colour value a vertex on a canvas (WebGL 2), turns it, and says which
 * vertex is under the pointer. The projection is orthographic, so a length on the screen is a length on the shape.
 * View coordinates: x right, y up, z towards the viewer. `rotation` holds them as rows of a 3 x 3 matrix.
 */

const COARSE = 8000; // triangles, about, of a coarse copy

class SurfaceView {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {Float32Array} positions  three a vertex
   * @param {Uint32Array} faces  three vertex numbers a triangle
   * @param {number[]} missing  colour of a vertex without a value, 0 to 1
   */
  constructor(canvas, positions, faces, missing) {
    const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("This browser cannot draw WebGL 2 here.");
    Object.assign(this, { canvas, gl, positions, faces, marked: null, mirrored: null, pan: [0, 0], waiting: false });
    Object.assign(this, { base: 1, enlarged: 1 }); // how large it is where it just fits, and how much larger it was made
    Object.assign(this, { coarse: null, motion: new Motion(gl, () => this.redraw()) });
    Object.assign(this, boundingSphere(positions));
    this.normals = vertexNormals(positions, faces);
    this.rotation = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    this.surface = this.program(SURFACE_VERTEX, SURFACE_FRAGMENT);
    this.marker = this.program(MARKER_VERTEX, MARKER_FRAGMENT);
    this.shape = gl.createVertexArray();
    gl.bindVertexArray(this.shape);
    this.attribute("position", positions, 3);
    this.attribute("normal", this.normals, 3);
    this.colours = this.attribute("colour", new Float32Array(positions.length / 3 * 2), 2);
    gl.bindVertexArray(null);
    this.index = gl.createBuffer();
    this.order(faces);
    this.farthest = extremes(positions, this.centre);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    for (const name of ["MIN_FILTER", "MAG_FILTER"]) gl.texParameteri(gl.TEXTURE_2D, gl["TEXTURE_" + name], gl.LINEAR);
    for (const name of ["WRAP_S", "WRAP_T"]) gl.texParameteri(gl.TEXTURE_2D, gl["TEXTURE_" + name], gl.CLAMP_TO_EDGE);
    gl.useProgram(this.surface.program);
    gl.uniform3fv(this.surface.at("missing"), missing);
    new ResizeObserver(() => {
      if (canvas.clientWidth) this.base = this.filling;
      this.redraw();
    }).observe(canvas);
    this.listen();
  }

  program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    return { program, at: (name) => gl.getUniformLocation(program, name) };
  }

  attribute(name, values, width) {
    const gl = this.gl, buffer = gl.createBuffer(), place = gl.getAttribLocation(this.surface.program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, width, gl.FLOAT, false, 0, 0);
    return buffer;
  }

  /** Put triangles on the card. */
  order(faces, index = this.index) {
    const gl = this.gl;
    gl.bindVertexArray(this.shape);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, index);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
  }

  /**
   * Give every vertex its place in the colour map (0 to 1, may overshoot) and whether it has a value (1 or 0). Labels
   * are not mixed within a triangle.
   */
  paint(pairs, labelled = false) {
    const gl = this.gl;
    if (labelled) this.order(facesByLabel(this.faces, pairs));
    gl.useProgram(this.surface.program);
    gl.uniform1i(this.surface.at("labelled"), Number(labelled));
    gl.bindBuffer(gl.ARRAY_BUFFER, this.colours);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, pairs);
    this.redraw();
  }

  /** Choose the colour map: 256 colours of red, green, blue bytes. */
  useTable(bytes) {
    const gl = this.gl, pixels = new Uint8Array(1024).fill(255);
    for (let i = 0; i < 256; i++) pixels.set(bytes.subarray(3 * i, 3 * i + 3), 4 * i);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    this.redraw();
  }

  /** Screen pixels for each unit of length. */
  get density() {
    return this.base * this.enlarged;
  }

  redraw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      if (this.motion.moving && this.motion.busy) this.redraw();
      else this.draw(this.motion.detail);
    });
  }

  /** The triangles to draw, few of them if wanted; returns how many corners. */
  bindFaces(coarse) {
    const gl = this.gl;
    if (coarse && !this.coarse) {
      this.coarse = { index: gl.createBuffer(), faces: coarserFaces(this.positions, this.normals, this.faces, COARSE) };
      this.order(this.coarse.faces, this.coarse.index);
    }
    gl.bindVertexArray(this.shape);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, coarse ? this.coarse.index : this.index);
    return coarse ? this.coarse.faces.length : this.faces.length;
  }

  draw(detail = DETAILS[0]) {
    const { gl, canvas } = this, ratio = Math.min(window.devicePixelRatio || 1, 2) * detail.pixels;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (!width || !height) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    this.place(this.surface);
    gl.drawElements(gl.TRIANGLES, this.bindFaces(detail.coarse && this.faces.length > 6 * COARSE), gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
    if (this.marked !== null) this.drawMarker(this.marked, 15 * ratio);
    if (this.marked !== null && this.mirrored !== null) this.drawMarker(this.mirrored, 10.5 * ratio);
    this.motion.submitted();
    if (this.ondraw) this.ondraw();
  }

  /** In full where it is in sight, faintly through the surface that hides it. */
  drawMarker(vertex, size) {
    const gl = this.gl;
    this.place(this.marker);
    gl.uniform3fv(this.marker.at("marked"), this.positionOf(vertex));
    gl.uniform1f(this.marker.at("size"), size);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    for (const [test, opacity] of [[gl.GREATER, 0.35], [gl.LEQUAL, 1]]) {
      gl.depthFunc(test);
      gl.uniform1f(this.marker.at("opacity"), opacity);
      gl.drawArrays(gl.POINTS, 0, 1);
    }
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  place(stage) {
    const gl = this.gl, width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    gl.useProgram(stage.program);
    // WebGL takes columns; the rows of the rotation are the view's axes.
    const columns = [0, 1, 2].flatMap((axis) => this.rotation.map((row) => row[axis]));
    gl.uniformMatrix3fv(stage.at("rotation"), false, columns);
    gl.uniform3fv(stage.at("centre"), this.centre);
    gl.uniform2f(stage.at("scale"), 2 * this.density / width, 2 * this.density / height);
    gl.uniform2f(stage.at("pan"), 2 * this.pan[0] / width, -2 * this.pan[1] / height);
    gl.uniform1f(stage.at("reach"), 1.05 * this.radius);
  }

  positionOf(vertex) {
    return Array.from(this.positions.subarray(3 * vertex, 3 * vertex + 3));
  }

  /** Where a vertex is on the canvas, in CSS pixels from its upper left corner, and its depth (larger is nearer). */
  project(vertex) {
    const offset = this.positionOf(vertex).map((value, axis) => value - this.centre[axis]);
    const [x, y, z] = this.rotation.map((row) => dot(row, offset));
    const { clientWidth: width, clientHeight: height } = this.canvas, scale = this.density;
    return [width / 2 + this.pan[0] + x * scale, height / 2 + this.pan[1] - y * scale, z];
  }

  /** The vertex under a point of the canvas: the nearest corner, on the screen, of the triangle seen there; or null. */
  pick(x, y) {
    const { faces, positions, rotation, centre, density } = this;
    const n = positions.length / 3, px = new Float64Array(n), py = new Float64Array(n), pz = new Float64Array(n);
    const [right, up, towards] = rotation;
    for (let i = 0; i < n; i++) {
      const a = positions[3 * i] - centre[0], b = positions[3 * i + 1] - centre[1], c = positions[3 * i + 2] - centre[2];
      px[i] = right[0] * a + right[1] * b + right[2] * c;
      py[i] = up[0] * a + up[1] * b + up[2] * c;
      pz[i] = towards[0] * a + towards[1] * b + towards[2] * c;
    }
    const sx = (x - this.canvas.clientWidth / 2 - this.pan[0]) / density;
    const sy = (this.canvas.clientHeight / 2 + this.pan[1] - y) / density;
    let nearest = -Infinity, hit = -1;
    for (let f = 0; f < faces.length; f += 3) {
      const a = faces[f], b = faces[f + 1], c = faces[f + 2];
      const ax = px[a] - sx, ay = py[a] - sy, bx = px[b] - sx, by = py[b] - sy, cx = px[c] - sx, cy = py[c] - sy;
      const u = bx * cy - cx * by, v = cx * ay - ax * cy, w = ax * by - bx * ay, total = u + v + w;
      if (total === 0 || u * total < 0 || v * total < 0 || w * total < 0) continue;
      const depth = (u * pz[a] + v * pz[b] + w * pz[c]) / total;
      if (depth > nearest) {
        nearest = depth;
        hit = f;
      }
    }
    if (hit < 0) return null;
    const distance = (i) => Math.hypot(px[i] - sx, py[i] - sy);
    return [faces[hit], faces[hit + 1], faces[hit + 2]].sort((a, b) => distance(a) - distance(b))[0];
  }

  mark(vertex) {
    this.marked = vertex;
    this.redraw();
  }

  /** Look from a direction (rows: the image's right, its up, towards the viewer), the shape filling the canvas. */
  look(rotation) {
    this.rotation = rotation.map((row) => row.slice());
    this.pan = [0, 0];
    this.enlarged = 1;
    this.base = this.filling;
    this.redraw();
  }

  /** The density at which the shape just fits into the canvas, seen as it is. */
  get filling() {
    const [width, height] = [0, 1].map((row) => {
      let most = 1e-3 * this.radius;
      for (const spot of this.farthest) most = Math.max(most, Math.abs(dot(this.rotation[row], spot)));
      return 2 * most;
    });
    return 0.92 * Math.min(this.canvas.clientWidth / width, this.canvas.clientHeight / height);
  }

  /** Nothing is cut off by turning, unless it was enlarged on purpose. */
  keepInside() {
    if (this.enlarged <= 1 && this.canvas.clientWidth) this.base = Math.min(this.base, this.filling);
  }

  /** Turn so that a vertex faces the viewer, keeping the image's up as it is where that is possible. */
  face(vertex) {
    const towards = unit(Array.from(this.normals.subarray(3 * vertex, 3 * vertex + 3)));
    if (!dot(towards, towards)) return;
    let right = cross(this.rotation[1], towards);
    if (Math.hypot(...right) < 1e-3) right = cross(this.rotation[2], towards);
    right = unit(right);
    this.rotation = [right, cross(towards, right), towards];
    this.keepInside();
    const [x, y] = this.project(vertex), { clientWidth: width, clientHeight: height } = this.canvas;
    if (x < 0 || y < 0 || x > width || y > height) this.shift(width / 2 - x, height / 2 - y);
    this.redraw();
  }

  /** Turn about the image's vertical axis, then about its horizontal one, in radians: the front follows the pointer. */
  turn(sideways, down) {
    const mix = (a, b, angle) => a.map((value, axis) => value * Math.cos(angle) + b[axis] * Math.sin(angle));
    const turned = mix(this.rotation[2], this.rotation[0], -sideways);
    const up = unit(mix(this.rotation[1], turned, -down)), towards = unit(mix(turned, this.rotation[1], down));
    this.rotation = [unit(cross(up, towards)), up, towards];
    this.keepInside();
    this.redraw();
  }

  shift(x, y) {
    this.pan = [this.pan[0] + x, this.pan[1] + y];
    this.redraw();
  }

  /** Zoom by a factor and keep the point (x, y) of the canvas where it is. */
  zoomBy(factor, x = this.canvas.clientWidth / 2, y = this.canvas.clientHeight / 2) {
    const enlarged = Math.min(Math.max(this.enlarged * factor, 0.2), 60), change = enlarged / this.enlarged;
    const fromCentre = [x - this.canvas.clientWidth / 2, y - this.canvas.clientHeight / 2];
    this.pan = this.pan.map((value, axis) => fromCentre[axis] - change * (fromCentre[axis] - value));
    this.enlarged = enlarged;
    this.redraw();
  }

  listen() {
    const canvas = this.canvas, pointers = new Map();
    let travelled = 0;
    const spot = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (!pointers.size) travelled = 0;
      pointers.set(event.pointerId, spot(event));
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = pointers.get(event.pointerId);
      if (!before) return;
      const now = spot(event), dx = now[0] - before[0], dy = now[1] - before[1];
      travelled += Math.hypot(dx, dy);
      this.motion.stir();
      const other = [...pointers].find(([id]) => id !== event.pointerId);
      if (other) {
        const there = other[1], length = (p) => Math.hypot(p[0] - there[0], p[1] - there[1]) || 1;
        this.zoomBy(length(now) / length(before), (now[0] + there[0]) / 2, (now[1] + there[1]) / 2);
        this.shift(dx / 2, dy / 2);
      } else if (event.buttons & 2 || event.buttons & 4 || event.shiftKey) {
        this.shift(dx, dy);
      } else if (travelled > 4) {
        this.turn(dx * 0.008, dy * 0.008);
      }
      pointers.set(event.pointerId, now);
    });
    canvas.addEventListener("pointerup", (event) => {
      if (pointers.size === 1 && travelled <= 4 && event.button === 0) {
        const vertex = this.pick(...spot(event));
        if (vertex !== null && this.onpick) this.onpick(vertex);
      }
      pointers.delete(event.pointerId);
    });
    canvas.addEventListener("pointercancel", (event) => pointers.delete(event.pointerId));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.motion.stir();
      this.zoomBy(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), ...spot(event));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  key(event) {
    const step = Math.PI / 18, move = 24;
    const sides = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key.startsWith("Arrow")) this.motion.stir();
    if (sides[event.key]) {
      const [x, y] = sides[event.key];
      if (event.shiftKey) this.shift(x * move, y * move);
      else this.turn(x * step, y * step);
    } else if (event.key === "+" || event.key === "=") this.zoomBy(1.2);
    else if (event.key === "-") this.zoomBy(1 / 1.2);
    else if (event.key === "0" && this.onreset) this.onreset();
    else return;
    event.preventDefault();
  }
}
