"use strict";

/* Programs of a SurfaceView: the surface, and round marks on it. */

const SURFACE_VERTEX = `#version 300 es
uniform mat3 rotation;
uniform vec3 centre;
uniform vec2 scale, pan;
uniform float reach;
in vec3 position, normal;
in vec2 colour;                 // place in the colour map, and 1 where there is a value
out vec3 turned;
out vec2 shown;
flat out vec2 own;              // of a label: the same all over a triangle, for there is nothing between two labels
void main() {
  vec3 seen = rotation * (position - centre);
  turned = rotation * normal;
  shown = colour;
  own = colour;
  gl_Position = vec4(seen.xy * scale + pan, -seen.z / reach, 1.0);
}`;

const SURFACE_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D table;
uniform vec3 missing;
uniform bool labelled;
in vec3 turned;
in vec2 shown;
flat in vec2 own;
out vec4 pixel;
const vec3 KEY = normalize(vec3(-0.38, 0.52, 0.77));
void main() {
  vec3 direction = normalize(gl_FrontFacing ? turned : -turned);
  float light = 0.30 + 0.46 * max(dot(direction, KEY), 0.0) + 0.30 * max(direction.z, 0.0);
  vec2 used = labelled ? own : shown;
  float place = (clamp(used.x, 0.0, 1.0) * 255.0 + 0.5) / 256.0;
  vec3 colour = used.y > 0.999 ? texture(table, vec2(place, 0.5)).rgb : missing;
  pixel = vec4(min(colour * light, 1.0), 1.0);
}`;

const MARKER_VERTEX = `#version 300 es
uniform mat3 rotation;
uniform vec3 centre, marked;
uniform vec2 scale, pan;
uniform float reach, size;
void main() {
  vec3 seen = rotation * (marked - centre);
  gl_Position = vec4(seen.xy * scale + pan, -seen.z / reach - 0.01, 1.0);
  gl_PointSize = size;
}`;

const MARKER_FRAGMENT = `#version 300 es
precision highp float;
uniform float opacity;
out vec4 pixel;
void main() {
  float radius = length(gl_PointCoord - 0.5) * 2.0;
  if (radius > 1.0) discard;
  vec3 colour = radius > 0.78 ? vec3(0.1) : (radius > 0.5 ? vec3(1.0) : vec3(0.78, 0.10, 0.16));
  pixel = vec4(colour * opacity, opacity);
}`;
