/* The bull's-eye of the left ventricle: 17 AHA segments, apex in the middle, base outside, anterior wall on top. */

const BULLSEYE = (() => {
  const rings = [[1, 6, 150, 110], [7, 6, 110, 70], [13, 4, 70, 30]], parts = [];
  for (const [first, count, outer, inner] of rings) {
    const width = 360 / count;
    // Segment 1, 7 and 13 are anterior (top); numbers go on towards the septum, which is on the left.
    for (let i = 0; i < count; i++) parts.push({ number: first + i, middle: 90 + i * width, width, outer, inner });
  }
  return parts;
})();

const onCircle = (radius, degrees) => [radius * Math.cos(degrees * Math.PI / 180), -radius * Math.sin(degrees * Math.PI / 180)];

function sector({ middle, width, outer, inner }) {
  const [a, b] = [middle - width / 2, middle + width / 2], at = (r, d) => onCircle(r, d).map((v) => v.toFixed(2)).join(" ");
  return `M ${at(outer, a)} A ${outer} ${outer} 0 0 0 ${at(outer, b)} L ${at(inner, b)} A ${inner} ${inner} 0 0 1 ${at(inner, a)} Z`;
}

/** Mean of the values in each segment, 1 to 17; NaN where a segment has none. */
function segmentMeans(values, segments) {
  const sums = new Float64Array(18), counts = new Float64Array(18);
  for (let i = 0; i < values.length; i++) {
    if (!Number.isFinite(values[i])) continue;
    sums[segments[i]] += values[i];
    counts[segments[i]] += 1;
  }
  return Array.from(sums, (sum, s) => (counts[s] ? sum / counts[s] : NaN));
}

/** Draw means by segment as SVG, in the colours given by a function of the value; `pick` is told the segment. */
function drawBullseye(means, colour, caption, pick) {
  const spoken = means.slice(1).map((mean, i) => `segment ${i + 1}: ${readable(mean)}`).join(", ");
  const svg = element("svg", { viewBox: "-160 -172 320 344", role: "img", "aria-label": `Bull's-eye of ${caption}. ${spoken}` });
  const add = (part, number, place) => {
    const fill = colour(means[number]);
    part.setAttribute("fill", fill.css);
    part.append(element("title", {}, `Segment ${number}: ${readable(means[number])}`));
    part.addEventListener("click", () => pick(number));
    svg.append(part, element("text", { x: place[0].toFixed(1), y: place[1].toFixed(1), style: `fill:${fill.dark ? "#fff" : "#1b1f24"}`, "pointer-events": "none" }, String(number)));
  };
  for (const part of BULLSEYE) {
    add(element("path", { d: sector(part) }), part.number, onCircle((part.outer + part.inner) / 2, part.middle));
  }
  add(element("circle", { r: 30 }), 17, [0, 0]);
  for (const [text, x, y] of [["anterior", 0, -163], ["inferior", 0, 163]]) svg.append(element("text", { x, y }, text));
  return svg;
}
