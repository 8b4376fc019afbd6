// Query and match beside each other (one above the other where it is narrow), with lines between shared features.
"use strict";
const Board = (() => {
  const SIDE = 300;
  const GAP = 14;
  const make = (parent, name, attributes) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    parent.appendChild(element);
    return element;
  };

  // Pictures share their height when side by side, and their width when stacked.
  const frames = (pictures, narrow) => {
    const sizes = pictures.map(({ naturalWidth: w, naturalHeight: h }) =>
      narrow ? [SIDE, SIDE * h / w] : [SIDE * w / h, SIDE]);
    const first = sizes[0];
    const offset = narrow ? [0, first[1] + GAP] : [first[0] + GAP, 0];
    return [[0, 0, ...first], [...offset, ...sizes[1]]];
  };

  const show = (svg, pictures, narrow) => {
    svg.replaceChildren();
    const places = frames(pictures, narrow);
    const [, , w, h] = places[1];
    svg.setAttribute("viewBox", `0 0 ${Math.max(places[0][2], places[1][0] + w)} ${Math.max(places[0][3], places[1][1] + h)}`);
    places.forEach(([x, y, width, height], k) =>
      make(svg, "image", { href: pictures[k].src, x, y, width, height, preserveAspectRatio: "none" }));
    return places;
  };

  const connect = (svg, places, shared) => {
    const at = (k, x, y) => [places[k][0] + x * places[k][2], places[k][1] + y * places[k][3]];
    [shared.query_box, shared.item_box].forEach((box, k) => {
      if (!box) return;
      const [x, y] = at(k, box[0], box[1]);
      make(svg, "rect", { class: "part", x, y, rx: 3, width: (box[2] - box[0]) * places[k][2], height: (box[3] - box[1]) * places[k][3] });
    });
    return shared.points.map(([x1, y1, x2, y2]) => {
      const group = make(svg, "g", { class: "pair" });
      const [a, b] = [at(0, x1, y1), at(1, x2, y2)];
      make(group, "line", { class: "link", x1: a[0], y1: a[1], x2: b[0], y2: b[1] });
      for (const [cx, cy] of [a, b]) make(group, "circle", { class: "dot", r: 2.6, cx, cy });
      return group;
    });
  };
  return { show, connect };
})();
