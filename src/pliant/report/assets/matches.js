"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const board = document.getElementById("board");
  const told = document.getElementById("told");
  const usual = told.textContent;
  // Both images are brought to one height, in the unit of the first.
  const high = data.sizes[0][1];
  const factors = [1, high / data.sizes[1][1]];
  const gap = 0.03 * (data.sizes[0][0] + data.sizes[1][0] * factors[1]);
  const left = [0, data.sizes[0][0] + gap];
  const wide = left[1] + data.sizes[1][0] * factors[1];
  const radius = wide / 420;
  const make = (name, attributes, parent = board) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    parent.appendChild(element);
    return element;
  };
  board.setAttribute("viewBox", `0 0 ${wide} ${high}`);
  const groups = [0, 1].map((k) =>
    make("g", { transform: `translate(${left[k]} 0) scale(${factors[k]}) translate(.5 .5)` }));
  const picture = (k, parent) => make("image", {
    href: data.images[k], x: -0.5, y: -0.5, width: data.sizes[k][0], height: data.sizes[k][1],
    preserveAspectRatio: "none" }, parent);
  groups.forEach((group, k) => picture(k, group));
  let overlay = null;
  if (data.transform) {
    const [a, b] = data.transform;
    const clip = make("clipPath", { id: "second" });
    make("rect", { x: -0.5, y: -0.5, width: data.sizes[1][0], height: data.sizes[1][1] }, clip);
    const window_ = make("g", { "clip-path": "url(#second)" }, groups[1]);
    overlay = make("g", { transform: `matrix(${a[0]} ${b[0]} ${a[1]} ${b[1]} ${a[2]} ${b[2]})`, opacity: 0 }, window_);
    picture(0, overlay);
  }
  const box = (group, [x0, y0, x1, y1], kind) => {
    if (x1 > x0) make("rect", { x: x0 - 0.5, y: y0 - 0.5, width: x1 - x0, height: y1 - y0, class: kind }, group);
  };
  groups.forEach((group, k) => {
    box(group, data.boxes[k], "found");
    if (data.truth) box(group, data.truth[k], "true");
  });
  const layer = make("g", {});
  const place = (k, x, y) => [left[k] + factors[k] * (x + 0.5), factors[k] * (y + 0.5)];
  const matches = data.points.map(([x1, y1, x2, y2], i) => {
    const [ax, ay] = place(0, x1, y1);
    const [bx, by] = place(1, x2, y2);
    const parts = [
      make("line", { x1: ax, y1: ay, x2: bx, y2: by, class: "link" }, layer),
      make("circle", { cx: ax, cy: ay, r: radius, class: "dot" }, layer),
      make("circle", { cx: bx, cy: by, r: radius, class: "dot" }, layer)];
    const show = (on) => {
      layer.classList.toggle("single", on);
      parts.forEach((part) => part.classList.toggle("on", on));
      told.textContent = on
        ? `Match ${i + 1}: (${x1.toFixed(0)}, ${y1.toFixed(0)}) and (${x2.toFixed(0)}, ${y2.toFixed(0)}), distance ${data.distances[i].toFixed(3)}`
        : usual;
    };
    parts.forEach((part) => {
      part.addEventListener("mouseenter", () => show(true));
      part.addEventListener("mouseleave", () => show(false));
    });
    return parts;
  });
  const most = document.getElementById("most");
  const draw = () => {
    document.getElementById("drawn").textContent = most.value;
    matches.forEach((parts, i) => parts.forEach((part) => { part.style.display = i < most.value ? "" : "none"; }));
  };
  most.addEventListener("input", draw);
  draw();
  const over = document.getElementById("over");
  over.disabled = !overlay;
  over.addEventListener("input", () => {
    document.getElementById("share").textContent = over.value;
    overlay.setAttribute("opacity", over.value / 100);
  });
})();
