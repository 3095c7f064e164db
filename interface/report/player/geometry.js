// SPDX-License-Identifier: BSD-3-Clause
//
// Vectors, matrices, and surfaces as triangles.  Part of the page (player.html.in); knows nothing of robots.

// ---- Vectors, quaternions (x y z w) and 4 x 4 matrices, column by column -------------------------------------------
const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => times(a, 1 / (norm(a) || 1));

// Two directions across a unit vector, which with it are right-handed.
function across(n) {
  const x = unit(cross(Math.abs(n[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], n));
  return [x, cross(n, x)];
}

function slerp(a, b, s) {
  const c = Math.min(1, a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]);
  const angle = Math.acos(c), sine = Math.sin(angle);
  const [u, v] = sine < 1e-4 ? [1 - s, s] : [Math.sin((1 - s) * angle) / sine, Math.sin(s * angle) / sine];
  const q = [0, 1, 2, 3].map((i) => u * a[i] + v * b[i]), length = Math.hypot(...q);
  return q.map((x) => x / length);
}

// Of a frame at p turned by q.
function placement(p, [x, y, z, w]) {
  return [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0,
          2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0,
          2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0, p[0], p[1], p[2], 1];
}

const axes = (x, y, z, p) => [...x, 0, ...y, 0, ...z, 0, ...p, 1];
const identity = axes([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]);

function product(a, b) {
  const c = new Array(16);
  for (let j = 0; j < 4; ++j) {
    for (let i = 0; i < 4; ++i) {
      c[4 * j + i] = a[i] * b[4 * j] + a[4 + i] * b[4 * j + 1] + a[8 + i] * b[4 * j + 2] + a[12 + i] * b[4 * j + 3];
    }
  }
  return c;
}

function perspective(angle, aspect, near, far) {
  const f = 1 / Math.tan(angle / 2), d = near - far;
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / d, -1, 0, 0, 2 * far * near / d, 0];
}

// Shadows on the plane normal . x = offset of a light far away in the direction `light`.
function flattened(normal, offset, light) {
  const m = identity.slice(), k = 1 / dot(normal, light);
  for (let j = 0; j < 3; ++j) for (let i = 0; i < 3; ++i) m[4 * j + i] -= light[i] * normal[j] * k;
  for (let i = 0; i < 3; ++i) m[12 + i] = light[i] * offset * k;
  return m;
}

// ---- Geometry: positions and normals of triangles, six numbers a corner ----------------------------------------------
// A surface over a grid of (u, v) in [0, 1]^2; at(u, v) is [position, normal].
function surface(columns, rows, at) {
  const corners = [];
  const corner = (i, j) => corners.push(...at(i / columns, j / rows).flat());
  for (let i = 0; i < columns; ++i) {
    for (let j = 0; j < rows; ++j) {
      for (const [a, b] of [[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]]) corner(i + a, j + b);
    }
  }
  return corners;
}

const around = (u) => [Math.cos(2 * Math.PI * u), Math.sin(2 * Math.PI * u)];

function sphere() {
  return surface(32, 16, (u, v) => {
    const [c, s] = around(u), r = Math.sin(Math.PI * v), n = [r * c, r * s, -Math.cos(Math.PI * v)];
    return [n, n];
  });
}

function disc(z, up) {
  return surface(32, 1, (u, v) => [[around(u)[0] * v, around(u)[1] * v, z], [0, 0, up]]);
}

function cylinder() {
  const side = surface(32, 1, (u, v) => [[...around(u), v - 0.5], [...around(u), 0]]);
  return [...side, ...disc(-0.5, -1), ...disc(0.5, 1)];
}

// Radius 1, from z = 0 to its tip at 1.
function cone() {
  const side = surface(32, 1, (u, v) => [[around(u)[0] * (1 - v), around(u)[1] * (1 - v), v], [...around(u), 1]]);
  return [...side, ...disc(0, -1)];
}

function box() {
  const corners = [];
  for (let axis = 0; axis < 3; ++axis) {
    for (const side of [-0.5, 0.5]) {
      corners.push(...surface(1, 1, (u, v) => {
        const p = [0, 0, 0], n = [0, 0, 0];
        p[axis] = side, p[(axis + 1) % 3] = u - 0.5, p[(axis + 2) % 3] = v - 0.5, n[axis] = 2 * side;
        return [p, n];
      }));
    }
  }
  return corners;
}

// Smooth where faces meet at less than 40 degrees, sharp elsewhere.
function mesh({vertices, triangles}) {
  const corner = (k) => vertices.slice(3 * triangles[k], 3 * triangles[k] + 3);
  const faces = [], meeting = Array.from({length: vertices.length / 3}, () => []);
  for (let k = 0; k < triangles.length; k += 3) {
    const a = corner(k), n = cross(sub(corner(k + 1), a), sub(corner(k + 2), a));
    faces.push({n, unit: unit(n)});
    for (let i = 0; i < 3; ++i) meeting[triangles[k + i]].push(faces.length - 1);
  }
  const corners = new Float32Array(6 * triangles.length);
  for (let k = 0; k < triangles.length; ++k) {
    const own = faces[Math.floor(k / 3)];
    let n = [0, 0, 0];
    for (const f of meeting[triangles[k]]) if (dot(faces[f].unit, own.unit) > 0.77) n = add(n, faces[f].n);
    corners.set(corner(k), 6 * k);
    corners.set(unit(n), 6 * k + 3);
  }
  return corners;
}

// A tube along points; what belongs to one stretch of it stands together, so that a part of it can be drawn.
const kTubeSides = 6;
function tube(points, radius) {
  const corners = [], ring = [];
  for (let k = 0; k + 1 < points.length; ++k) {
    const [x, y] = across(unit(sub(points[Math.min(k + 1, points.length - 1)], points[k])));
    for (let i = 0; i <= kTubeSides; ++i) {
      const [c, s] = around(i / kTubeSides);
      ring[i] = add(times(x, c), times(y, s));
    }
    corners.push(...surface(kTubeSides, 1, (u, v) => {
      const n = ring[Math.round(u * kTubeSides)];
      return [add(points[k + v], times(n, radius)), n];
    }));
  }
  return corners;
}

function landscape({corner, step, rows, columns, z}) {
  const vertices = [], triangles = [];
  for (let i = 0; i < rows; ++i) {
    for (let j = 0; j < columns; ++j) {
      const a = i * columns + j;
      vertices.push(corner[0] + i * step[0], corner[1] + j * step[1], z[a]);
      if (i + 1 < rows && j + 1 < columns) triangles.push(a, a + columns, a + columns + 1, a, a + columns + 1, a + 1);
    }
  }
  return mesh({vertices, triangles});
}
