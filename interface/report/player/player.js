// SPDX-License-Identifier: BSD-3-Clause
//
// What the page does: time, camera, drawing, controls.  What the scene holds is said in scene.h.

const scene = JSON.parse(document.getElementById("scene").textContent);
const element = (selector) => document.querySelector(selector);
const canvas = element("canvas");
const first = scene.t[0], last = scene.t[scene.t.length - 1];

// ---- Time and motion --------------------------------------------------------------------------------------------------
let time = first, playing = false;

// The frame at or before a time, and how far the next one is on its way.
function frame_at(t) {
  const frames = scene.t.length;
  if (frames < 2 || !(last > first)) return {k: 0, next: 0, s: 0};
  const at = Math.min(Math.max((t - first) / (last - first) * (frames - 1), 0), frames - 1);
  const k = Math.min(Math.floor(at + 1e-9), frames - 1);
  return {k, next: Math.min(k + 1, frames - 1), s: Math.max(at - k, 0)};
}

const mixed = (a, b, s) => a + (b - a) * s;

function body_position(body, {k, next, s}) {
  const a = scene.poses[k], b = scene.poses[next], i = 7 * body;
  return [0, 1, 2].map((c) => mixed(a[i + c], b[i + c], s));
}

function body_placement(body, at) {
  if (body < 0) return identity;
  const i = 7 * body + 3, q = (frame) => scene.poses[frame].slice(i, i + 4);
  return placement(body_position(body, at), slerp(q(at.k), q(at.next), at.s));
}

// ---- Camera -------------------------------------------------------------------------------------------------------
const kAngle = 35 * Math.PI / 180;
const start = scene.bodies > 0 ? body_position(0, frame_at(first)) : [0, 0, 0];
const travels = scene.bodies > 0 && norm(sub(body_position(0, frame_at(last)), start)) > 4 * scene.size;  // leaves its first view
const camera = {};
function home() {
  const narrow = Math.min(1, canvas.clientWidth / Math.max(canvas.clientHeight, 1));
  camera.following = travels;
  const radius = camera.following ? 0.62 * scene.size : scene.radius;
  camera.azimuth = -Math.PI / 3, camera.elevation = Math.PI / 10;
  camera.target = scene.center.slice();
  if (camera.following) camera.target = start.slice();
  camera.distance = 1.12 * radius / Math.sin(kAngle / 2) / narrow;
  element("#follow input").checked = camera.following;
}

function carried(at) {
  return camera.following ? sub(body_position(0, at), start) : [0, 0, 0];
}

function outward() {
  const c = Math.cos(camera.elevation);
  return [c * Math.cos(camera.azimuth), c * Math.sin(camera.azimuth), Math.sin(camera.elevation)];
}

function eye_and_view(at) {
  const back = outward(), right = [-Math.sin(camera.azimuth), Math.cos(camera.azimuth), 0], up = cross(back, right);
  const eye = add(add(camera.target, carried(at)), times(back, camera.distance));
  const far = camera.distance + 20 * Math.max(scene.radius, scene.size);
  const turn = [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
                -dot(right, eye), -dot(up, eye), -dot(back, eye), 1];
  return {eye, view: product(perspective(kAngle, canvas.width / canvas.height, camera.distance / 100, far), turn)};
}

function turn(dx, dy) {
  camera.azimuth -= 0.008 * dx;
  camera.elevation = Math.min(Math.max(camera.elevation + 0.008 * dy, -1.55), 1.55);
}

function move(dx, dy) {
  const k = 2 * camera.distance * Math.tan(kAngle / 2) / canvas.clientHeight;
  const right = [-Math.sin(camera.azimuth), Math.cos(camera.azimuth), 0];
  camera.target = add(add(camera.target, times(right, -k * dx)), times(cross(outward(), right), k * dy));
}

function zoom(factor) {
  const far = 60 * Math.max(scene.radius, scene.size);
  camera.distance = Math.min(Math.max(camera.distance * factor, 0.05 * scene.size), far);
}

// ---- Programs of the graphics processor -----------------------------------------------------------------------------
const kSolid = [`#version 300 es
in vec3 position, normal;
uniform mat4 view, model;
uniform vec3 unscale;  // normals turn with the inverse of the scale
out vec3 place, direction;
void main() {
  vec4 p = model * vec4(position, 1.0);
  place = p.xyz, direction = mat3(model) * (normal * unscale);
  gl_Position = view * p;
}`, `#version 300 es
precision highp float;
in vec3 place, direction;
uniform vec3 eye, light;
uniform vec4 color;
uniform bool flat_color;
out vec4 result;
void main() {
  if (flat_color) { result = color; return; }
  vec3 to_eye = normalize(eye - place), n = normalize(direction);
  if (dot(n, to_eye) < 0.0) n = -n;
  float key = max(dot(n, light), 0.0), fill = 0.5 + 0.5 * dot(n, to_eye), sky = 0.5 + 0.5 * n.z;
  vec3 base = pow(color.rgb, vec3(2.2));
  float shine = 0.12 * pow(max(dot(n, normalize(light + to_eye)), 0.0), 40.0) * step(0.0, dot(n, light));
  vec3 lit = base * (0.22 * sky + 0.28 * fill + 0.62 * key + 0.05) + shine;
  result = vec4(pow(lit, vec3(1.0 / 2.2)), color.a);
}`];

const kGrid = [`#version 300 es
in vec3 position;
uniform mat4 view, model;
uniform float half_edge;
out vec2 place;
out vec3 world;
void main() {
  vec4 p = model * vec4(half_edge * position, 1.0);
  place = half_edge * position.xy, world = p.xyz;
  gl_Position = view * p;
}`, `#version 300 es
precision highp float;
in vec2 place;
in vec3 world;
uniform vec3 center, line;
uniform vec4 ground;
uniform float step_length, reach;
out vec4 result;
float lines(vec2 p) {
  vec2 width = fwidth(p), off = abs(fract(p - 0.5) - 0.5) / max(width, 1e-6);
  vec2 shown = (1.0 - min(off / 1.2, 1.0)) * (1.0 - smoothstep(0.2, 0.6, width));
  return max(shown.x, shown.y);
}
void main() {
  float far = 1.0 - smoothstep(0.35, 1.0, distance(world, center) / reach);
  float strength = max(0.45 * lines(place / step_length), 0.8 * lines(place / (5.0 * step_length)));
  result = vec4(mix(ground.rgb, line, strength), far * max(ground.a, strength));
}`];

function compiled(gl, [vertex, fragment]) {
  const program = gl.createProgram();
  for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.bindAttribLocation(program, 0, "position");
  gl.bindAttribLocation(program, 1, "normal");
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  const places = {};
  for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); ++i) {
    const name = gl.getActiveUniform(program, i).name;
    places[name] = gl.getUniformLocation(program, name);
  }
  return {program, places};
}

function uploaded(gl, corners) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, corners instanceof Float32Array ? corners : new Float32Array(corners), gl.STATIC_DRAW);
  for (const i of [0, 1]) {
    gl.enableVertexAttribArray(i);
    gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 24, 12 * i);
  }
  return {array, count: corners.length / 6};
}

// ---- Drawing ----------------------------------------------------------------------------------------------------------
const kLight = unit([0.35, -0.55, 0.9]);
const kTraceColors = [[0, 0.45, 0.7, 1], [0.84, 0.37, 0, 1], [0, 0.62, 0.45, 1], [0.8, 0.47, 0.65, 1]];
const kForceColor = [0.84, 0.15, 0.15, 1];
const kThemes = {
  light: {back: [0.93, 0.95, 0.97], ground: [0.86, 0.88, 0.9, 0.75], line: [0.55, 0.6, 0.65], shadow: 0.22},
  dark: {back: [0.09, 0.1, 0.12], ground: [0.14, 0.16, 0.18, 0.75], line: [0.42, 0.46, 0.5], shadow: 0.45},
};
const dark = window.matchMedia("(prefers-color-scheme: dark)");

// A length of 1, 2 or 5 times a power of ten.
function round_length(x) {
  const power = 10 ** Math.floor(Math.log10(x)), digit = x / power;
  return power * (digit < 2 ? 1 : digit < 5 ? 2 : 5);
}
const kGridStep = round_length(Math.max(Math.min(scene.radius, 2 * scene.size) / 4, 1e-6));
// One cell of the grid is a round number of newtons, and no arrow is longer than the scene asks for.
const kForceStep = scene.arrow > 0 ? 1 / round_length(scene.arrow / kGridStep) : 0;

class Painter {
  constructor(gl) {
    this.gl = gl;
    this.solid = compiled(gl, kSolid);
    this.grid = compiled(gl, kGrid);
    this.units = {box: box(), sphere: sphere(), cylinder: cylinder(), cone: cone()};
    for (const kind in this.units) this.units[kind] = uploaded(gl, this.units[kind]);
    const meshes = scene.meshes.map((m) => uploaded(gl, mesh(m)));
    this.shapes = scene.shapes.map((shape) => ({
      ...shape, local: placement(shape.p, shape.q),
      drawn: shape.kind === "mesh" ? meshes[shape.mesh] : this.units[shape.kind]}));
    this.shapes.sort((a, b) => b.color[3] - a.color[3]);  // what one looks through comes last
    this.traces = scene.traces.map(({points}) => {
      const list = Array.from({length: points.length / 3}, (_, k) => points.slice(3 * k, 3 * k + 3));
      return uploaded(gl, tube(list, 0.004 * scene.size));
    });
    this.landscape = scene.heights && uploaded(gl, landscape(scene.heights));
    this.square = uploaded(gl, surface(1, 1, (u, v) => [[2 * u - 1, 2 * v - 1, 0], [0, 0, 1]]));
    const plane = scene.plane || {normal: [0, 0, 1], offset: scene.ground};
    this.plane = plane, this.shadow = flattened(plane.normal, plane.offset, kLight);
  }

  use({program, places}) {
    this.gl.useProgram(program);
    this.places = places;
  }

  // Of a solid: where, how far it is stretched along its axes, in which colour, which of its corners.
  put(drawn, model, scale, color, begin = 0, count = drawn.count - begin) {
    const {gl, places} = this, m = model.slice();
    for (let j = 0; j < 3; ++j) for (let i = 0; i < 3; ++i) m[4 * j + i] *= scale[j];
    gl.uniformMatrix4fv(places.model, false, this.before ? product(this.before, m) : m);
    gl.uniform3fv(places.unscale, scale.map((s) => 1 / (s * s)));
    gl.uniform4fv(places.color, color);
    gl.bindVertexArray(drawn.array);
    gl.drawArrays(gl.TRIANGLES, begin, count);
  }

  put_robot(bodies, color) {
    for (const shape of this.shapes) {
      const body = shape.body < 0 ? identity : bodies[shape.body], model = product(body, shape.local);
      if (!color && shape.color[3] < 1) this.put_depth(shape, model);
      this.put(shape.drawn, model, shape.scale, color || shape.color);
    }
  }

  // Of what one looks through only the nearest surface shows, not its own back.
  put_depth(shape, model) {
    this.gl.colorMask(false, false, false, false);
    this.put(shape.drawn, model, shape.scale, shape.color);
    this.gl.colorMask(true, true, true, true);
  }

  put_forces({k}) {
    const list = scene.contacts[k] || [], r = 0.008 * scene.size;
    for (let i = 0; i < list.length; i += 6) {
      const point = list.slice(i, i + 3), force = list.slice(i + 3, i + 6), length = norm(force) * kGridStep / kForceStep;
      this.put(this.units.sphere, axes([1, 0, 0], [0, 1, 0], [0, 0, 1], point), [2 * r, 2 * r, 2 * r], kForceColor);
      if (length < r) continue;
      const z = unit(force), [x, y] = across(z), tip = Math.min(7 * r, length), shaft = length - tip;
      this.put(this.units.cylinder, axes(x, y, z, add(point, times(z, shaft / 2))), [r, r, shaft || 1e-9], kForceColor);
      this.put(this.units.cone, axes(x, y, z, add(point, times(z, shaft))), [2.4 * r, 2.4 * r, tip], kForceColor);
    }
  }

  put_traces({k}) {
    const a_stretch = 6 * kTubeSides;
    this.traces.forEach((drawn, i) => {
      const color = kTraceColors[i % kTraceColors.length];
      if (k > 0) this.put(drawn, identity, [1, 1, 1], color, 0, k * a_stretch);
      this.put(drawn, identity, [1, 1, 1], [...color.slice(0, 3), 0.3], k * a_stretch);
    });
  }

  draw_ground(view, theme, at) {
    const {gl} = this, {normal, offset} = this.plane;
    const middle = camera.following ? add(start, carried(at)) : scene.center;
    const reach = 4 * Math.max(scene.size, camera.following ? 0 : scene.radius);
    const [x, y] = normal[2] > 0.999 ? [[1, 0, 0], [0, 1, 0]] : across(normal);
    const origin = times(normal, offset);
    this.use(this.grid);
    gl.uniformMatrix4fv(this.places.view, false, view);
    gl.uniformMatrix4fv(this.places.model, false, axes(x, y, normal, origin));
    gl.uniform3fv(this.places.center, sub(middle, times(normal, dot(normal, middle) - offset)));
    gl.uniform3fv(this.places.line, theme.line);
    gl.uniform4fv(this.places.ground, theme.ground);
    gl.uniform1f(this.places.step_length, kGridStep);
    gl.uniform1f(this.places.reach, reach);
    gl.uniform1f(this.places.half_edge, 3 * reach + norm(sub(middle, origin)));
    gl.bindVertexArray(this.square.array);
    gl.drawArrays(gl.TRIANGLES, 0, this.square.count);
  }

  draw(at) {
    const {gl} = this, theme = dark.matches ? kThemes.dark : kThemes.light, {eye, view} = eye_and_view(at);
    const bodies = Array.from({length: scene.bodies}, (_, body) => body_placement(body, at));
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...theme.back, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthFunc(gl.LEQUAL);
    gl.disable(gl.DEPTH_TEST);
    if (!this.landscape) this.draw_ground(view, theme, at);
    this.use(this.solid);
    gl.uniformMatrix4fv(this.places.view, false, view);
    gl.uniform3fv(this.places.eye, eye);
    gl.uniform3fv(this.places.light, kLight);
    if (!this.landscape && dot(this.plane.normal, eye) > this.plane.offset) this.draw_shadow(bodies, theme);
    gl.enable(gl.DEPTH_TEST);
    if (this.landscape) this.put(this.landscape, identity, [1, 1, 1], [...theme.ground.slice(0, 3), 1]);
    this.put_traces(at);
    this.put_forces(at);
    this.put_robot(bodies);
  }

  // Each point of the ground is darkened once, however many shapes are above it.
  draw_shadow(bodies, theme) {
    const {gl} = this;
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 0xff);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.uniform1i(this.places.flat_color, 1);
    this.before = this.shadow;
    this.put_robot(bodies, [0, 0, 0, theme.shadow]);
    this.before = null;
    gl.uniform1i(this.places.flat_color, 0);
    gl.disable(gl.STENCIL_TEST);
  }
}

// ---- The page -------------------------------------------------------------------------------------------------------
let painter = null, failure = "";

function fail(sentence) {
  failure = sentence;
  element("#failure").textContent = sentence;
  element("#failure").hidden = false;
}

function spelt(x) { return Math.abs(x) < 1e-12 ? "0" : String(Number(x.toPrecision(4))); }

function write_texts(at) {
  element("#time").value = time;
  element("output").textContent = `${time.toFixed(2)} s of ${last.toFixed(2)} s`;
  element("#play").textContent = playing ? "Pause" : "Play";
  document.querySelectorAll("#side [data-value]").forEach((cell) => {
    const {y, unit} = scene.values[cell.dataset.value];
    cell.textContent = `${spelt(mixed(y[at.k], y[at.next], at.s))} ${unit}`;
  });
}

function draw() {
  const at = frame_at(time), ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.max(1, Math.round(n * ratio)));
  if (canvas.width !== width || canvas.height !== height) canvas.width = width, canvas.height = height;
  write_texts(at);
  if (painter) painter.draw(at);
}

let asked = false, then = 0;
function redraw() {
  if (asked) return;
  asked = true;
  requestAnimationFrame((now) => {
    asked = false;
    if (playing) {
      time += (now - then) / 1000 * Number(element("#speed").value);
      if (time > last) time = first;
      then = now;
      redraw();
    }
    draw();
  });
}

function set_playing(on) {
  playing = on && last > first;
  then = performance.now();
  redraw();
}

function seek(t) {
  if (!Number.isFinite(t)) throw new RangeError(`seek: expected a time in seconds, got ${t}`);
  time = Math.min(Math.max(t, first), last);
  draw();
}

function add_row(color, name, index) {
  const row = element("#side table").insertRow(), cell = row.insertCell();
  if (color) {
    const key = document.createElement("span");
    key.className = "key";
    key.style.background = `rgb(${color.slice(0, 3).map((c) => Math.round(255 * c)).join(" ")})`;
    cell.append(key);
  }
  cell.append(name);
  const value = row.insertCell();
  if (index !== undefined) value.dataset.value = index;
  element("#side").hidden = false;
  return value;
}

function fill_page() {
  document.title = scene.title || scene.robot || "Motion";
  element("h1").textContent = scene.title;
  const texts = [scene.robot === scene.title ? "" : scene.robot, scene.heights ? "" : `grid ${spelt(kGridStep)} m`];
  element("#heading p").textContent = texts.filter((text) => text).join(", ");
  element("#heading details").hidden = !scene.notes.length;
  for (const note of scene.notes) {
    element("#heading details").append(Object.assign(document.createElement("p"), {textContent: note}));
  }
  scene.values.forEach(({name}, index) => add_row(null, name, index));
  scene.traces.forEach(({name}, i) => add_row(kTraceColors[i % kTraceColors.length], name));
  if (scene.arrow > 0) add_row(kForceColor, "force").textContent = `${spelt(kForceStep)} N: ${spelt(kGridStep)} m`;
  Object.assign(element("#time"), {min: first, max: last});
  element("#follow").hidden = !travels;
  if (last <= first) for (const id of ["#play", "#time", "#speed"]) element(id).disabled = true;
}

function listen_to_bar() {
  element("#play").onclick = () => set_playing(!playing);
  element("#time").oninput = (e) => seek(Number(e.target.value));
  element("#home").onclick = canvas.ondblclick = () => { home(); redraw(); };
  element("#follow input").onchange = (e) => {
    const before = carried(frame_at(time));
    camera.following = e.target.checked;
    camera.target = add(camera.target, sub(before, carried(frame_at(time))));
    redraw();
  };
  dark.onchange = window.onresize = redraw;
}

function listen_to_keys() {
  window.onkeydown = (e) => {
    if (["SELECT", "SUMMARY"].includes(e.target.tagName) || e.ctrlKey || e.altKey || e.metaKey) return;
    const step = (last - first) / Math.max(scene.t.length - 1, 1) * (e.shiftKey ? 10 : 1);
    const actions = {" ": () => set_playing(!playing), Home: () => seek(first), End: () => seek(last),
                     ArrowRight: () => seek(time + step), ArrowLeft: () => seek(time - step)};
    if (!actions[e.key]) return;
    e.preventDefault();
    actions[e.key]();
  };
  window.onkeyup = (e) => { if (e.key === " " && e.target.tagName === "BUTTON") e.preventDefault(); };
}

// One pointer turns (with shift or another button: moves), two move and zoom.
function listen_to_pointers() {
  const down = new Map();
  const mean = (i) => [...down.values()].reduce((sum, p) => sum + p[i] / down.size, 0);
  const middle = () => [mean(0), mean(1)];
  const spread = () => { const [a, b] = [...down.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
  canvas.onpointerdown = (e) => {
    canvas.setPointerCapture(e.pointerId);
    down.set(e.pointerId, [e.clientX, e.clientY]);
  };
  canvas.onpointerup = canvas.onpointercancel = (e) => down.delete(e.pointerId);
  canvas.onpointermove = (e) => {
    if (!down.has(e.pointerId)) return;
    const was = middle(), apart = down.size === 2 ? spread() : 0;
    down.set(e.pointerId, [e.clientX, e.clientY]);
    const [dx, dy] = [middle()[0] - was[0], middle()[1] - was[1]];
    if (down.size > 1 || e.shiftKey || (e.buttons & 6)) move(dx, dy); else turn(dx, dy);
    if (apart > 0 && spread() > 0) zoom(apart / spread());
    redraw();
  };
  canvas.onwheel = (e) => {
    e.preventDefault();
    zoom(Math.exp(0.0015 * e.deltaY * (e.deltaMode ? 20 : 1)));
    redraw();
  };
  canvas.oncontextmenu = (e) => e.preventDefault();
}

fill_page();
home();
listen_to_bar();
listen_to_keys();
listen_to_pointers();
const gl = canvas.getContext("webgl2", {alpha: false, antialias: true, stencil: true});
if (gl) painter = new Painter(gl);
else fail("This browser has no WebGL2, which the picture is drawn with; another one, or its setting for graphics, may help.");
draw();
window.dyntape_player = {
  seek: (t) => { set_playing(false); seek(t); },
  state: () => ({time, playing, first, last, frames: scene.t.length, shapes: scene.shapes.length, camera, failure,
                 gl_error: gl ? gl.getError() : null}),
};
