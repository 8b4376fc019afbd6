/* Geometry of triangle meshes for pages: normals, extent, a coarser copy, whose label a triangle shows. */

/** Area-weighted unit normals of a mesh. */
function vertexNormals(positions, faces) {
  const normals = new Float32Array(positions.length);
  for (let f = 0; f < faces.length; f += 3) {
    const a = 3 * faces[f], b = 3 * faces[f + 1], c = 3 * faces[f + 2];
    const ux = positions[b] - positions[a], uy = positions[b + 1] - positions[a + 1], uz = positions[b + 2] - positions[a + 2];
    const vx = positions[c] - positions[a], vy = positions[c + 1] - positions[a + 1], vz = positions[c + 2] - positions[a + 2];
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    for (const corner of [a, b, c]) {
      normals[corner] += nx;
      normals[corner + 1] += ny;
      normals[corner + 2] += nz;
    }
  }
  for (let i = 0; i < normals.length; i += 3) {
    const length = Math.hypot(normals[i], normals[i + 1], normals[i + 2]) || 1;
    normals[i] /= length;
    normals[i + 1] /= length;
    normals[i + 2] /= length;
  }
  return normals;
}

/** Centre of the bounding box, and the radius of the sphere about it that holds every vertex. */
function boundingSphere(positions) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions.length; i++) {
    const axis = i % 3;
    if (positions[i] < low[axis]) low[axis] = positions[i];
    if (positions[i] > high[axis]) high[axis] = positions[i];
  }
  const centre = low.map((value, axis) => (value + high[axis]) / 2);
  let radius = 0;
  for (let i = 0; i < positions.length; i += 3) {
    radius = Math.max(radius, Math.hypot(positions[i] - centre[0], positions[i + 1] - centre[1], positions[i + 2] - centre[2]));
  }
  return { centre, radius: radius || 1 };
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((value) => value / (Math.hypot(...a) || 1));

/** Vertices that lie farthest in one of many directions, from the centre: enough to know how wide a view is. */
function extremes(positions, centre) {
  const chosen = new Set(), count = 160, golden = Math.PI * (3 - Math.sqrt(5));
  for (let i = 0; i < count / 2; i++) {
    const z = 1 - (i + 0.5) * 2 / count, r = Math.sqrt(1 - z * z);
    const [x, y] = [r * Math.cos(golden * i), r * Math.sin(golden * i)];
    let low = Infinity, high = -Infinity, lowest = 0, highest = 0;
    for (let v = 0; v < positions.length; v += 3) {
      const along = x * positions[v] + y * positions[v + 1] + z * positions[v + 2];
      if (along < low) [low, lowest] = [along, v];
      if (along > high) [high, highest] = [along, v];
    }
    chosen.add(lowest).add(highest);
  }
  return Array.from(chosen, (v) => [0, 1, 2].map((axis) => positions[v + axis] - centre[axis]));
}

/**
 * A coarser copy of a mesh on the same vertices: those within a cell of a grid become one, and what is left of the
 * triangles is returned, about as many as wanted. For looks only: it may have holes where a shape is thin.
 */
function coarserFaces(positions, normals, faces, wanted) {
  let area = 0;
  const corner = (values, vertex) => values.subarray(3 * vertex, 3 * vertex + 3);
  const normal = (a, b, c) => {
    const from = corner(positions, a), side = (to) => corner(positions, to).map((value, axis) => value - from[axis]);
    return cross(side(b), side(c));
  };
  for (let f = 0; f < faces.length; f += 3) {
    area += Math.hypot(...normal(faces[f], faces[f + 1], faces[f + 2])) / 2;
  }
  // A surface passes about 1.5 cells for each cell's worth of area, and leaves two triangles in each.
  const cell = Math.sqrt(3 * area / wanted) || 1, reach = 2 ** 17, first = new Map();
  const stands = new Uint32Array(positions.length / 3);
  for (let i = 0; i < stands.length; i++) {
    const [x, y, z] = [0, 1, 2].map((axis) => Math.round(positions[3 * i + axis] / cell) % reach);
    const key = (x * reach + y) * reach + z;
    if (!first.has(key)) first.set(key, i);
    stands[i] = first.get(key);
  }
  const kept = [];
  for (let f = 0; f < faces.length; f += 3) {
    const a = stands[faces[f]], b = stands[faces[f + 1]], c = stands[faces[f + 2]];
    if (a === b || b === c || c === a) continue;
    // Cells that fold a triangle over would show its dark side.
    const out = corner(normals, a).map((value, axis) => value + normals[3 * b + axis] + normals[3 * c + axis]);
    if (dot(normal(a, b, c), out) < 0) kept.push(a, c, b);
    else kept.push(a, b, c);
  }
  return Uint32Array.from(kept);
}

/** The triangles, each begun at the corner after which the last one has the label of most of them: that one is shown. */
function facesByLabel(faces, pairs) {
  const turned = faces.slice(), label = (corner) => pairs[2 * corner] + 4 * pairs[2 * corner + 1];
  for (let f = 0; f < faces.length; f += 3) {
    const a = label(faces[f]), b = label(faces[f + 1]), c = label(faces[f + 2]);
    if (a === b && b !== c) turned.set([faces[f + 2], faces[f], faces[f + 1]], f);
  }
  return turned;
}
