// The viewer of a case: one frame at a time in slabs along and across the wire, in 3D, and in projections; lengths in mm.
(() => {
  "use strict";
  const data = JSON.parse(document.getElementById("viewer-data").textContent);
  const $ = (id) => document.getElementById(id);
  const all = (selector) => [...document.querySelectorAll(selector)];
  const style = getComputedStyle(document.documentElement);
  const css = (name) => style.getPropertyValue(name).trim();
  const COLOUR = { traced: css("--traced"), simulated: css("--simulated"), true: css("--true"), far: css("--far"), unscored: css("--unscored"), lumen: css("--lumen") };
  const ORDER = ["traced", "true", "simulated"];
  const MARGIN_MM = 5, PAPER_WIDTH = 760;
  const shown = (name) => all(`[data-show="${name}"]`).every((box) => box.checked);
  const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

  // ---- vectors and curves
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const along = (a, b, t) => [a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => { const n = Math.hypot(...a) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };
  const points = (flat) => Array.from({ length: flat.length / 3 }, (_, i) => flat.slice(3 * i, 3 * i + 3));
  const arcOf = (curve) => { const arc = [0]; for (let i = 1; i < curve.length; i++) arc.push(arc[i - 1] + Math.hypot(...minus(curve[i], curve[i - 1]))); return arc; };
  const at = (curve, arc, s) => {
    let i = arc.findIndex((a) => a >= s);
    i = i < 1 ? (i === 0 ? 1 : curve.length - 1) : i;
    const step = arc[i] - arc[i - 1] || 1;
    return along(curve[i - 1], minus(curve[i], curve[i - 1]), clamp((s - arc[i - 1]) / step, 0, 1));
  };
  const hex = (colour) => [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));
  const NEAR = hex(COLOUR.simulated), FAR = hex(COLOUR.far);
  const scored = data.frames.some((f) => f.good); // a case without any error has no scale of them
  const colourOf = (error) => {
    if (error === null) return scored ? COLOUR.unscored : COLOUR.simulated;
    const [low, high] = data.scale_mm, t = clamp(Math.log(Math.max(error, low) / low) / Math.log(high / low), 0, 1);
    return `rgb(${NEAR.map((c, i) => Math.round(c + t * (FAR[i] - c))).join(",")})`;
  };
  // the error at arc length s, between the samples; none where nothing was compared (the clamp's reach)
  const errorAt = (frame, s) => {
    const { arc_mm: arc, error_mm: error } = frame;
    if (arc.length < 2 || s < arc[0] - 1e-6) return null;
    let i = arc.findIndex((a) => a >= s);
    if (i < 0) i = arc.length - 1;
    return error[i];
  };

  // ---- what is derived of a frame, once
  const pictures = new Map();
  const picture = (uri) => {
    if (!pictures.has(uri)) { const image = new Image(); image.onload = draw; image.src = uri; pictures.set(uri, image); }
    const image = pictures.get(uri);
    return image.complete && image.naturalWidth ? image : null;
  };
  const ready = (frame) => {
    if (frame.lines) return frame;
    frame.lines = Object.fromEntries(Object.entries(frame.curves).map(([name, flat]) => { const curve = points(flat); return [name, { curve, arc: arcOf(curve) }]; }));
    const sim = frame.lines.simulated;
    if (sim) sim.colours = sim.arc.map((s) => colourOf(errorAt(frame, s)));
    frame.offsets = frame.lines.traced && frame.lines.traced.curve.length > 1 ? offsets(frame) : null;
    return frame;
  };
  // Each curve's offset from the traced one in two directions at right angles, carried along it without turning.
  const offsets = (frame) => {
    const { curve, arc } = frame.lines.traced, last = curve.length - 1;
    const tangents = curve.map((_, i) => unit(minus(curve[Math.min(i + 1, last)], curve[Math.max(i - 1, 0)])));
    const least = [0, 1, 2].reduce((a, b) => (Math.abs(tangents[0][b]) < Math.abs(tangents[0][a]) ? b : a));
    let first = [0, 0, 0]; first[least] = 1;
    if (frame.straight) first = frame.straight.normal; // the directions of the slabs
    const normals = tangents.map((t) => { first = unit(along(first, t, -dot(first, t))); return first; });
    const against = (p) => {
      let best = Infinity, i = 1, u = 0;
      for (let k = 1; k <= last; k++) {
        const edge = minus(curve[k], curve[k - 1]), v = clamp(dot(minus(p, curve[k - 1]), edge) / (dot(edge, edge) || 1), 0, 1);
        const d = minus(p, along(curve[k - 1], edge, v)), size = dot(d, d);
        if (size < best) { best = size; i = k; u = v; }
      }
      const k = u < 0.5 ? i - 1 : i, foot = along(curve[i - 1], minus(curve[i], curve[i - 1]), u), d = minus(p, foot);
      const beyond = i === last && u === 1 ? dot(d, tangents[last]) : 0; // past the end the rest lies along the wire
      return [arc[i - 1] + u * (arc[i] - arc[i - 1]) + beyond, dot(d, normals[k]), dot(d, cross(tangents[k], normals[k]))];
    };
    const found = {};
    for (const name of ["true", "simulated"]) if (frame.lines[name]) found[name] = frame.lines[name].curve.map(against);
    return found;
  };

  // ---- state
  let now = data.start, paper = false; // on paper the ink is black, whatever the page's scheme
  const frame = () => ready(data.frames[now]);
  const wireOf = (f) => f.lines.simulated ?? f.lines.traced ?? f.lines.true ?? null;
  const place = () => {
    const wire = wireOf(frame());
    if (!wire) return null;
    const s = $("place").value * wire.arc[wire.arc.length - 1];
    return { s, p: at(wire.curve, wire.arc, s) };
  };
  const zoom = () => 2 ** Number($("zoom").value);

  // ---- projections: mm along the scan's array axes
  const scan = data.scan ?? { spacing_mm: [1, 1, 1], origin_mm: [0, 0, 0], direction: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], shape: null, aligned: true, lumen: {} };
  const inArray = (p) => { const d = minus(p, scan.origin_mm); return [0, 1, 2].map((a) => d[0] * scan.direction[0][a] + d[1] * scan.direction[1][a] + d[2] * scan.direction[2][a]); };
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const take = (p) => p.forEach((x, i) => { low[i] = Math.min(low[i], x); high[i] = Math.max(high[i], x); });
  data.frames.forEach((f) => Object.values(f.curves).forEach((flat) => points(flat).forEach((p) => take(inArray(p)))));
  const faces = scan.shape && [scan.spacing_mm.map((s) => -0.5 * s), scan.shape.map((n, i) => (n - 0.5) * scan.spacing_mm[i])];
  if (low[0] === Infinity && faces) { take(faces[0]); take(faces[1]); }
  for (let i = 0; i < 3; i++) {
    low[i] = faces ? Math.max(low[i] - MARGIN_MM, faces[0][i]) : low[i] - MARGIN_MM;
    high[i] = faces ? Math.min(high[i] + MARGIN_MM, faces[1][i]) : high[i] + MARGIN_MM;
  }
  const NAMES = scan.aligned ? ["x, to left", "y, to back", "z, to head"] : ["array axis 0", "array axis 1", "array axis 2"];

  const fitted = (canvas) => {
    // on paper the strips have one shape: a phone's, as high as wide, filled a sheet of their own and left one blank
    const ratio = window.devicePixelRatio || 1, width = paper && canvas.id === "straight" ? PAPER_WIDTH : canvas.clientWidth, height = canvas.clientHeight;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
    }
    return { ratio, width, height };
  };
  const cleared = (canvas, ground = "#101316") => {
    const box = fitted(canvas), pen = canvas.getContext("2d");
    pen.setTransform(box.ratio, 0, 0, box.ratio, 0, 0);
    pen.fillStyle = ground; // on paper, what is clear would be white
    pen.fillRect(0, 0, box.width, box.height);
    pen.lineJoin = pen.lineCap = "round";
    return { pen, ...box };
  };
  const trail = (pen, spots) => { pen.beginPath(); spots.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y))); pen.stroke(); };
  const stroke = (pen, name, spots, colours, width) => {
    pen.setLineDash(name === "true" ? [1, 4] : []);
    pen.lineWidth = width;
    if (!colours) { pen.strokeStyle = COLOUR[name]; trail(pen, spots); }
    else for (let i = 1; i < spots.length; i++) { pen.strokeStyle = colours[i]; pen.beginPath(); pen.moveTo(...spots[i - 1]); pen.lineTo(...spots[i]); pen.stroke(); }
    pen.setLineDash([]);
    const tip = spots[spots.length - 1];
    pen.fillStyle = colours ? colours[colours.length - 1] : COLOUR[name];
    pen.beginPath(); pen.arc(tip[0], tip[1], width + 1.2, 0, 7); pen.fill();
  };
  const ring = (pen, x, y) => { for (const [colour, width] of [["#000000", 3.6], ["#ffffff", 1.6]]) { pen.strokeStyle = colour; pen.lineWidth = width; pen.beginPath(); pen.arc(x, y, 8, 0, 7); pen.stroke(); } };
  const strokeAll = (pen, f, spot, width) => {
    const drawn = ORDER.filter((name) => f.lines[name] && shown(name)).map((name) => [name, f.lines[name].curve.map(spot), f.lines[name].colours, name === "traced" ? width + 1.6 : width]);
    // light rims below all curves, so that their colours stand out from every grey of a scan and hide no other curve
    for (const [, spots, , wide] of drawn) { pen.strokeStyle = "#ffffffb0"; pen.lineWidth = wide + 1.8; trail(pen, spots); }
    for (const one of drawn) stroke(pen, ...one);
  };

  const slab = (canvas) => {
    const axis = Number(canvas.dataset.axis), [a, b] = [0, 1, 2].filter((i) => i !== axis), turned = scan.aligned && b === 1 ? -1 : 1;
    const label = canvas.previousElementSibling;
    canvas.style.height = "340px";
    return () => {
      const { pen, width, height } = cleared(canvas), f = frame(), cursor = place();
      const scale = Math.min(width / (high[a] - low[a]), height / (high[b] - low[b])) * zoom();
      const middle = zoom() > 1 && cursor ? inArray(cursor.p) : low.map((x, i) => (x + high[i]) / 2);
      const X = (x) => width / 2 + (x - middle[a]) * scale, Y = (y) => height / 2 - turned * (y - middle[b]) * scale;
      const paint = (uri, alpha) => {
        const image = uri && faces && picture(uri);
        if (!image) return;
        pen.save();
        pen.globalAlpha = alpha;
        pen.imageSmoothingEnabled = scale * scan.spacing_mm[a] < 3;
        pen.translate(X(faces[0][a]), Y(faces[1][b]));
        pen.scale((X(faces[1][a]) - X(faces[0][a])) / image.naturalWidth, (Y(faces[0][b]) - Y(faces[1][b])) / image.naturalHeight);
        pen.drawImage(image, 0, 0);
        pen.restore();
      };
      if (shown("scan")) paint(f.pictures[axis], 1);
      if (shown("lumen")) { pen.globalCompositeOperation = "screen"; paint(scan.lumen[axis], f.pictures[axis] && shown("scan") ? 0.14 : 0.3); pen.globalCompositeOperation = "source-over"; }
      strokeAll(pen, f, (p) => { const q = inArray(p); return [X(q[a]), Y(q[b])]; }, 1.6);
      if (cursor) { const q = inArray(cursor.p); ring(pen, X(q[a]), Y(q[b])); }
      ruler(pen, width, height, scale);
      label.textContent = `across ${NAMES[a]}; ${turned < 0 ? "down" : "up"} ${NAMES[b]}`;
    };
  };
  const nice = (x) => { const power = 10 ** Math.floor(Math.log10(x)); return [1, 2, 5, 10].map((k) => k * power).find((k) => k >= x * 0.999); };
  const ruler = (pen, width, height, scale) => {
    const length = nice(width / scale / 8), text = `${Number(length.toPrecision(3))} mm`;
    pen.strokeStyle = "#ffffff"; pen.lineWidth = 2; pen.font = "11px system-ui, sans-serif"; pen.textAlign = "left";
    pen.fillStyle = "#101316b0"; pen.fillRect(6, height - 27, Math.max(length * scale, pen.measureText(text).width + 2) + 8, 22); // over bright bone
    pen.fillStyle = "#ffffff";
    pen.beginPath(); pen.moveTo(10, height - 10); pen.lineTo(10 + length * scale, height - 10); pen.stroke();
    pen.fillText(text, 12, height - 15);
  };

  // ---- 3D: the lumen by WebGL where there is one, the wires over it by hand
  const PRESETS = { front: [[1, 0, 0], [0, 0, 1]], side: [[0, 1, 0], [0, 0, 1]], top: [[-1, 0, 0], [0, -1, 0]] };
  let camera = PRESETS.front, near = 1;
  const centre = [0, 0, 0];
  { const seen = data.frames.flatMap((f) => Object.values(f.curves).flatMap(points)); const ends = [0, 1, 2].map((i) => [Math.min(...seen.map((p) => p[i])), Math.max(...seen.map((p) => p[i]))]); ends.forEach(([a, b], i) => { centre[i] = seen.length ? (a + b) / 2 : 0; }); }
  const radius = Math.max(10, 0.55 * Math.hypot(...high.map((x, i) => x - low[i])));
  const surface = data.lumen && (() => {
    const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
    const lattice = new Uint16Array(bytes(data.lumen.vertices)), corners = new Uint32Array(bytes(data.lumen.triangles));
    const place3 = Float32Array.from(lattice, (v, i) => data.lumen.low_mm[i % 3] + (v / 65535) * data.lumen.size_mm - centre[i % 3]);
    const normal = new Float32Array(place3.length), vertex = (i) => [place3[3 * i], place3[3 * i + 1], place3[3 * i + 2]];
    for (let t = 0; t < corners.length; t += 3) {
      const [a, b, c] = [corners[t], corners[t + 1], corners[t + 2]], n = cross(minus(vertex(b), vertex(a)), minus(vertex(c), vertex(a)));
      for (const k of [a, b, c]) for (let i = 0; i < 3; i++) normal[3 * k + i] += n[i];
    }
    const canvas = $("surface"), gl = canvas.getContext("webgl");
    if (!gl || !gl.getExtension("OES_element_index_uint")) return null;
    const shader = (kind, source) => { const s = gl.createShader(kind); gl.shaderSource(s, source); gl.compileShader(s); return s; };
    const program = gl.createProgram();
    gl.attachShader(program, shader(gl.VERTEX_SHADER, "attribute vec3 p, n; uniform vec3 right, up, toward; uniform vec2 scale; varying float facing; void main() { vec3 m = normalize(n); facing = abs(dot(m, toward)); gl_Position = vec4(dot(p, right) * scale.x, dot(p, up) * scale.y, -dot(p, toward) * 0.001, 1.0); }"));
    gl.attachShader(program, shader(gl.FRAGMENT_SHADER, "precision mediump float; uniform vec3 colour; varying float facing; void main() { float a = 0.04 + 0.42 * pow(1.0 - facing, 1.6); gl_FragColor = vec4(colour * a, a); }"));
    gl.linkProgram(program); gl.useProgram(program);
    const buffer = (kind, values) => { gl.bindBuffer(kind, gl.createBuffer()); gl.bufferData(kind, values, gl.STATIC_DRAW); };
    for (const [name, values] of [["p", place3], ["n", normal]]) { buffer(gl.ARRAY_BUFFER, values); const where = gl.getAttribLocation(program, name); gl.enableVertexAttribArray(where); gl.vertexAttribPointer(where, 3, gl.FLOAT, false, 0, 0); }
    buffer(gl.ELEMENT_ARRAY_BUFFER, corners);
    const uniform = (name) => gl.getUniformLocation(program, name);
    return (scale, width, height, seen) => {
      fitted(canvas);
      gl.viewport(0, 0, canvas.width, canvas.height); gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT);
      if (!seen) return;
      gl.enable(gl.BLEND); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      const [right, up] = camera;
      gl.uniform3fv(uniform("right"), right); gl.uniform3fv(uniform("up"), up); gl.uniform3fv(uniform("toward"), cross(right, up));
      gl.uniform2f(uniform("scale"), (2 * scale) / width, (2 * scale) / height); gl.uniform3fv(uniform("colour"), hex(COLOUR.lumen).map((c) => c / 255));
      gl.drawElements(gl.TRIANGLES, corners.length, gl.UNSIGNED_INT, 0);
    };
  })();
  const solid = () => {
    const { pen, width, height } = cleared($("wires")), f = frame(), cursor = place();
    const scale = (near * Math.min(width, height)) / (2 * radius), [right, up] = camera;
    const spot = (p) => { const d = minus(p, centre); return [width / 2 + dot(d, right) * scale, height / 2 - dot(d, up) * scale]; };
    if (surface) { surface(scale, width, height, shown("lumen")); pen.drawImage($("surface"), 0, 0, width, height); }
    strokeAll(pen, f, spot, 2);
    if (cursor) ring(pen, ...spot(cursor.p));
    ruler(pen, width, height, scale);
    pen.font = "12px system-ui, sans-serif"; pen.lineWidth = 2; pen.textAlign = "center"; // L, P, S: towards left, back and head
    [["L", [1, 0, 0]], ["P", [0, 1, 0]], ["S", [0, 0, 1]]].forEach(([name, axis]) => {
      const x = width - 44, y = 66, dx = 22 * dot(axis, right), dy = -22 * dot(axis, up);
      if (Math.hypot(dx, dy) < 5) return; // it points at the reader
      pen.strokeStyle = "#c8ced4"; pen.fillStyle = "#ffffff"; pen.beginPath(); pen.moveTo(x, y); pen.lineTo(x + dx, y + dy); pen.stroke(); pen.fillText(name, x + 1.45 * dx, y + 1.45 * dy + 4);
    });
  };
  const turn = (dx, dy) => {
    const toward = cross(...camera);
    const right = unit(along(camera[0].map((v) => v * Math.cos(dx)), toward, Math.sin(dx)));
    const face = cross(right, camera[1]), up = unit(along(camera[1].map((v) => v * Math.cos(dy)), face, -Math.sin(dy)));
    camera = [right, unit(along(up, right, -dot(up, right)))];
    draw();
  };
  const dragged = (element, move) => {
    let from = null;
    element.addEventListener("pointerdown", (e) => { from = e; element.setPointerCapture(e.pointerId); move(e, e); });
    element.addEventListener("pointermove", (e) => { if (from) { move(e, from); from = e; } });
    for (const end of ["pointerup", "pointercancel"]) element.addEventListener(end, () => { from = null; });
  };
  dragged($("wires"), (e, from) => turn((from.clientX - e.clientX) * 0.008, (e.clientY - from.clientY) * 0.008));
  $("wires").addEventListener("wheel", (e) => { e.preventDefault(); near = clamp(near * Math.exp(-0.0012 * e.deltaY), 0.3, 40); draw(); }, { passive: false });
  $("wires").addEventListener("keydown", (e) => {
    const step = { ArrowLeft: [0.12, 0], ArrowRight: [-0.12, 0], ArrowUp: [0, -0.12], ArrowDown: [0, 0.12] }[e.key];
    if (step) { e.preventDefault(); turn(...step); }
    if (e.key === "+" || e.key === "-") { near = clamp(near * (e.key === "+" ? 1.2 : 1 / 1.2), 0.3, 40); draw(); }
  });
  all("[data-view]").forEach((button) => button.addEventListener("click", () => { camera = PRESETS[button.dataset.view]; near = 1; draw(); }));

  // ---- along the wire: two slabs of the scan pulled straight, magnified across, and the plane across it at the place
  const LEFT = 62, RIGHT = 14, TOP = 20, STRIP = 140, GAP = 14;
  const tall = `${TOP + 2 * STRIP + GAP + 44}px`;
  $("straight").style.height = $("across").style.height = tall;
  const reach = (f) => f.lines.traced.arc[f.lines.traced.arc.length - 1];
  const sizesOf = (f) => Object.values(f.offsets).flat();
  // what of the wire the strips show: all of it, or around the place when zoomed
  const seen = (f, width) => {
    // places count along the simulated wire, which may be the longer: its last one is seen, too
    const whole = Math.max(reach(f), wireOf(f).arc[wireOf(f).arc.length - 1], ...sizesOf(f).map((o) => o[0])) || 1, length = whole / zoom(), cursor = place();
    const from = clamp((cursor ? cursor.s : 0) - length / 2, 0, whole - length), px = (width - LEFT - RIGHT) / length;
    return { from, length, px, X: (s) => LEFT + (s - from) * px };
  };
  const slabOf = (f, k) => shown("scan") && f.straight && picture(f.straight.slabs[k]);
  const straight = () => {
    const { pen, width, height } = cleared($("straight"), paper ? "#ffffff" : css("--card")), f = frame(), ink = paper ? "#000000" : css("--ink"), line = paper ? "#bbbbbb" : css("--line");
    pen.font = "12px system-ui, sans-serif"; pen.fillStyle = ink;
    if (!f.offsets) { pen.textAlign = "left"; ["No traced wire in this frame:", "nothing to measure offsets from."].forEach((text, i) => pen.fillText(text, 12, 28 + 17 * i)); return; }
    const { from, length, px, X } = seen(f, width), most = Number($("range").value); // the same in all frames
    const beyond = (f.offsets.simulated ?? []).some((o) => o[0] >= from && o[0] <= from + length && Math.max(Math.abs(o[1]), Math.abs(o[2])) > most);
    const high = (STRIP / 2 - 4) / most;
    for (const k of [0, 1]) {
      const zero = TOP + (k + 0.5) * STRIP + k * GAP, Y = (o) => zero - o * high, image = slabOf(f, k);
      pen.fillStyle = ink; pen.textAlign = "right";
      for (const o of [-most, 0, most]) pen.fillText(`${o > 0 ? "+" : o < 0 ? "\u2212" : ""}${Number(Math.abs(o).toPrecision(3))} mm`, LEFT - 6, Y(o) + 4);
      pen.save(); pen.beginPath(); pen.rect(LEFT, Y(most), width - LEFT - RIGHT, 2 * most * high); pen.clip();
      if (image) {
        const { along_mm, across_mm, samples } = f.straight, half = 0.5 * samples[1] * across_mm;
        const span = [X(-0.5 * along_mm), samples[0] * along_mm * px]; // beyond it nothing was sampled, which is not black
        pen.fillStyle = "#000000"; pen.fillRect(span[0], 0, span[1], height);
        pen.drawImage(image, span[0], Y(half), span[1], 2 * half * high);
      }
      if (shown("traced")) {
        pen.fillStyle = COLOUR.traced; pen.globalAlpha = 0.3;
        if (f.sigma_mm) pen.fillRect(X(0), Y(2 * f.sigma_mm), reach(f) * px, 4 * f.sigma_mm * high);
        pen.globalAlpha = 1; pen.strokeStyle = COLOUR.traced; pen.lineWidth = 2.4;
        trail(pen, [[X(0), zero], [X(reach(f)), zero]]);
      }
      for (const name of ["true", "simulated"]) if (f.offsets[name] && shown(name)) {
        const spots = f.offsets[name].map((o) => [X(o[0]), Y(o[k + 1])]);
        if (image) { pen.strokeStyle = "#ffffffb0"; pen.lineWidth = 3.8; trail(pen, spots); }
        stroke(pen, name, spots, f.lines[name].colours, 2);
      }
      pen.restore();
      pen.strokeStyle = line; pen.lineWidth = 1; pen.strokeRect(LEFT, Y(most), width - LEFT - RIGHT, 2 * most * high);
    }
    const bottom = TOP + 2 * STRIP + GAP, cursor = place(), step = nice(length / Math.max(3, width / 110));
    pen.fillStyle = ink; pen.textAlign = "center";
    for (let s = Math.ceil(from / step) * step; s <= from + length + 1e-9; s += step) { pen.strokeStyle = line; pen.lineWidth = 1; trail(pen, [[X(s), bottom], [X(s), bottom + 4]]); pen.fillText(String(Number(s.toPrecision(4))), X(s), bottom + 17); }
    pen.fillText("arc length along the traced wire, mm", LEFT + (width - LEFT - RIGHT) / 2, bottom + 33);
    const more = `${high > 1.2 * px ? `, \u00d7 ${Number((high / px).toPrecision(2))}` : ""}${beyond ? "; the simulated wire goes beyond" : ""}`;
    const titles = ["offset across the traced wire", "offset"].map((text) => text + more), room = width - LEFT - RIGHT;
    pen.textAlign = "left"; pen.fillText(titles.find((text) => pen.measureText(text).width <= room) ?? titles[1], LEFT, 13);
    if (cursor) { pen.strokeStyle = css("--mark"); pen.lineWidth = 1.5; trail(pen, [[X(cursor.s), TOP], [X(cursor.s), bottom]]); }
  };
  const across = () => {
    const { pen, width, height } = cleared($("across")), f = frame(), cursor = place(), title = $("across").previousElementSibling;
    if (!f.offsets || !cursor) { title.textContent = "across the wire: no traced wire in this frame"; return; }
    title.textContent = `across the wire at ${cursor.s.toFixed(1)} mm, seen from the entry`;
    const half = f.straight ? 0.5 * f.straight.samples[1] * f.straight.across_mm : 3, scale = (Math.min(width, height) / (2 * half)) * zoom();
    const spot = (o) => [width / 2 + o[2] * scale, height / 2 - o[1] * scale];
    const image = f.straight && shown("scan") && picture(f.straight.across);
    if (image) {
      const { planes, samples, along_mm } = f.straight, k = Math.round(clamp(cursor.s / (along_mm * (samples[0] - 1) || 1), 0, 1) * (planes - 1));
      pen.drawImage(image, 0, k * samples[1], samples[1], samples[1], ...spot([0, half, -half]), 2 * half * scale, 2 * half * scale);
    }
    const disc = (o, size, colour) => { pen.fillStyle = "#ffffffb0"; pen.beginPath(); pen.arc(...spot(o), size + 1.2, 0, 7); pen.fill(); pen.fillStyle = colour; pen.beginPath(); pen.arc(...spot(o), size, 0, 7); pen.fill(); };
    if (shown("traced")) {
      disc([0, 0, 0], 4, COLOUR.traced);
      if (f.sigma_mm) { pen.strokeStyle = COLOUR.traced; pen.lineWidth = 1.5; pen.beginPath(); pen.arc(...spot([0, 0, 0]), 2 * f.sigma_mm * scale, 0, 7); pen.stroke(); }
    }
    for (const name of ["true", "simulated"]) if (f.offsets[name] && shown(name)) {
      const i = f.offsets[name].findIndex((o) => o[0] >= cursor.s);
      const o = f.offsets[name][i < 0 ? f.offsets[name].length - 1 : i], [x, y] = spot(o);
      if (Math.abs(x - width / 2) > width / 2 || Math.abs(y - height / 2) > height / 2) title.textContent += `; the ${name} wire is beyond the frame, ${Math.hypot(o[1], o[2]).toFixed(2)} mm off`;
      disc(o, 4, f.lines[name].colours ? f.lines[name].colours[i < 0 ? f.lines[name].colours.length - 1 : i] : COLOUR[name]);
    }
    ruler(pen, width, height, scale);
  };
  // a click goes there; dragging follows the pointer, or pulls the zoomed strip along
  dragged($("straight"), (e, before) => {
    const f = frame(), wire = wireOf(f);
    if (!f.offsets || !wire) return;
    const box = $("straight").getBoundingClientRect(), { from, px } = seen(f, box.width);
    const s = zoom() > 1 && e !== before ? place().s - (e.clientX - before.clientX) / px : from + (e.clientX - box.left - LEFT) / px;
    $("place").value = clamp(s / wire.arc[wire.arc.length - 1], 0, 1);
    draw();
  });

  // ---- the same frame in the curves of the page
  const marks = all(".plot[data-marks]").flatMap((plot) => JSON.parse(plot.dataset.marks).map((mark) => {
    const line = document.createElement("i");
    line.hidden = true;
    plot.append(line);
    return { plot, line, ...mark };
  }));
  const markAll = (number) => marks.forEach(({ line, box, across, at }) => {
    const where = at[number];
    line.hidden = where === undefined;
    const [left, top, width, height] = box;
    Object.assign(line.style, across ? { left: `${where}%`, top: `${top}%`, width: "2px", height: `${height}%` } : { left: `${left}%`, top: `${where}%`, width: `${width}%`, height: "2px" });
  });
  const index = new Map(data.frames.map((f, i) => [String(f.frame), i]));
  new Set(marks.map((m) => m.plot)).forEach((plot) => {
    plot.style.cursor = "pointer";
    plot.addEventListener("click", (e) => {
      const box = plot.getBoundingClientRect(), mine = marks.find((m) => m.plot === plot);
      const at = mine.across ? (100 * (e.clientX - box.left)) / box.width : (100 * (e.clientY - box.top)) / box.height;
      const near = Object.entries(mine.at).filter(([n]) => index.has(n)).sort((a, b) => Math.abs(a[1] - at) - Math.abs(b[1] - at))[0];
      if (near) go(index.get(near[0]));
    });
  });

  // ---- everything together
  const slabs = all("canvas[data-axis]").map(slab);
  let asked = 0;
  const paint = () => {
    asked = 0;
    const f = frame(), cursor = place();
    const mm = (x, name) => (x === null || x === undefined ? "" : `, ${name}${x.toFixed(name ? 3 : 1)} mm`);
    $("frame-text").textContent = `frame ${f.frame} (${now + 1} of ${data.frames.length})${mm(f.insertion_mm, "")} deep, ${f.status || "no status"}${f.good ? mm(f.rms_mm, "rms ") + mm(f.p95_mm, "95th percentile ") : ""}`.replace(" deep", f.insertion_mm === null ? "" : " deep");
    const error = cursor && f.lines.simulated ? errorAt(f, cursor.s) : null;
    $("place-text").textContent = cursor ? `${cursor.s.toFixed(1)} mm from the entry${error === null ? "" : `, ${error.toFixed(3)} mm off`}` : "no wire in this frame";
    slabs.forEach((one) => one());
    solid(); straight(); across(); markAll(f.frame);
  };
  function draw() { asked ||= requestAnimationFrame(paint); }
  const go = (i) => { now = clamp(i, 0, data.frames.length - 1); $("frame").value = now; draw(); };
  $("frame").addEventListener("input", () => go(Number($("frame").value)));
  for (const id of ["place", "zoom", "range"]) $(id).addEventListener("input", draw);
  all(".viewer input[type=range]").forEach((slider) => slider.addEventListener("keydown", (e) => {
    const way = { PageUp: 10, PageDown: -10 }[e.key]; // of its own accord a slider moves a tenth of its range
    if (way) { e.preventDefault(); slider.value = Number(slider.value) + way * Number(slider.step); slider.dispatchEvent(new Event("input")); }
  }));
  all("[data-show]").forEach((box) => box.addEventListener("input", draw));
  all("a[data-frame]").forEach((link) => link.addEventListener("click", () => index.has(link.dataset.frame) && go(index.get(link.dataset.frame))));
  let timer = 0;
  $("play").addEventListener("click", () => {
    timer = timer ? (clearInterval(timer), 0) : setInterval(() => go((now + 1) % data.frames.length), 250);
    $("play").textContent = timer ? "Stop" : "Play";
    $("play").setAttribute("aria-pressed", String(Boolean(timer)));
  });
  const asLinked = () => {
    const wanted = /^#viewer=(\d+)$/.exec(location.hash);
    if (wanted && index.has(wanted[1])) { go(index.get(wanted[1])); $("viewer").scrollIntoView(); }
  };
  addEventListener("hashchange", asLinked);
  for (const [when, printed] of [["beforeprint", true], ["afterprint", false]]) addEventListener(when, () => { paper = printed; paint(); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  new ResizeObserver(draw).observe(document.querySelector(".viewer .views"));
  asLinked();
  draw();
})();
