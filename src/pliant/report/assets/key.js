/* What colours mean: a bar with numbers for values, a legend with a button for each label. */

/** Each vertex's label as its place in the table of labels, and whether it has one. */
function placedLabels(values, labels) {
  const places = new Map(labels.values.map((value, i) => [value, i])), pairs = new Float32Array(2 * values.length);
  for (let i = 0; i < values.length; i++) {
    const place = places.get(values[i]);
    if (place !== undefined) pairs.set([place / 255, 1], 2 * i);
  }
  return pairs;
}

const rgbOf = (colour) => [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));

/** The table of labels' colours; all but the chosen label, if one is, nearly white. */
function labelTable(labels, chosen) {
  const bytes = new Uint8Array(768);
  labels.colours.forEach((colour, i) => {
    const pale = chosen !== null && labels.values[i] !== chosen;
    bytes.set(rgbOf(colour).map((part) => (pale ? 222 + 0.12 * part : part)), 3 * i);
  });
  return bytes;
}

/** How many values lie beyond the limits, in words; nothing where none does. */
function clipped(values, low, high) {
  let below = 0, above = 0, known = 0, least = Infinity, most = -Infinity;
  for (const value of values) {
    if (!Number.isFinite(value)) continue;
    known += 1;
    if (value < low) below += 1;
    else if (value > high) above += 1;
    least = Math.min(least, value);
    most = Math.max(most, value);
  }
  // Limits travel in double precision and values in single.
  const slack = 1e-6 * Math.max(Math.abs(low), Math.abs(high));
  if (!(least < low - slack || most > high + slack)) return "";
  const share = (count) => `${count} (${count && count < 0.001 * known ? "< 0.1" : (100 * count / known).toFixed(1)} %)`;
  return `Colours end at these limits: ${share(below)} vertices lie below, ${share(above)} above; values run from ${readable(least)} to ${readable(most)}.`;
}

class ColourKey {
  /** @param {(value: number | null) => void} onchoose  is told the label to highlight, null for all */
  constructor(place, onchoose) {
    Object.assign(this, { place, onchoose });
  }

  missing(count, total) {
    return count ? [element("p", { class: "hint key-missing" }, `Grey: no value at ${count} of ${total} vertices.`)] : [];
  }

  /** One value everywhere has one colour, the first, and no scale. */
  patch(layer, value, total, table) {
    const bar = element("div", { class: "key-bar", role: "img", "aria-label": `Colour of ${layer.name}: ${readable(value)} everywhere` });
    bar.style.background = `rgb(${table.slice(0, 3).join(" ")})`;
    const ticks = element("div", { class: "key-ticks" });
    ticks.append(element("span", {}, readable(value)));
    this.place.replaceChildren(element("p", { class: "key-name" }, layer.name), bar, ticks, ...this.missing(layer.missing, total));
  }

  /** Colours that join points with their images have no numbers. */
  matched(layer) {
    this.place.replaceChildren(element("p", { class: "key-name" }, layer.name), element("p", { class: "hint" },
      `A point and its image have one colour.${layer.missing ? " Grey parts are not carried anywhere." : ""}`));
  }

  bar(layer, values, { low, high, single, logarithmic, table }) {
    if (single) {
      this.patch(layer, values.find(Number.isFinite), values.length, table);
      return;
    }
    const half = (low + high) / 2;
    const middle = logarithmic ? Math.sqrt(low * high) : Math.abs(half) < 1e-9 * (high - low) ? 0 : half;
    const bar = element("div", { class: "key-bar", role: "img", "aria-label": `Colour bar, ${layer.name}: ${readable(low)} to ${readable(high)}` });
    bar.style.backgroundImage = gradient(table);
    const ticks = element("div", { class: "key-ticks" });
    ticks.append(...[low, middle, high].map((value) => element("span", {}, readable(Number(value.toPrecision(4))))));
    const name = element("p", { class: "key-name" }, logarithmic ? `${layer.name}, logarithmic` : layer.name);
    const notes = [clipped(values, low, high)].filter(Boolean).map((text) => element("p", { class: "hint key-clipped" }, text));
    this.place.replaceChildren(name, bar, ticks, ...notes, ...this.missing(layer.missing, values.length));
  }

  legend(layer, total, chosen) {
    const { values, names, counts, colours } = layer.labels;
    const list = element("ul", { class: "legend", "aria-label": `Labels of ${layer.name}` });
    values.forEach((value, i) => {
      if (!counts[i]) return;
      const swatch = element("span", { class: "swatch", "aria-hidden": "true" });
      swatch.style.background = colours[i];
      const button = element("button", { type: "button", "data-label": value, "aria-pressed": String(value === chosen) });
      button.append(swatch, element("span", { class: "label-name" }, names[i]), element("span", { class: "label-count" }, String(counts[i])));
      button.addEventListener("click", () => {
        this.onchoose(value === chosen ? null : value);
        this.place.querySelector(`[data-label="${value}"]`)?.focus();
      });
      const item = element("li");
      item.append(button);
      list.append(item);
    });
    const told = element("p", { class: "hint" }, chosen === null
      ? "Vertices with each label; choose one to see it alone." : "The others are pale; choose it again to see all.");
    this.place.replaceChildren(element("p", { class: "key-name" }, layer.name), list, told, ...this.missing(layer.missing, total));
  }
}
