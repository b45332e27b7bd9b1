// Layers in the order in which they are drawn. The list is the legend at once: each entry shows how it looks.
const count = (letters, one) => letters.split(one).length - 1;
const line = (name, more = "") => `<line x1="1" y1="8" x2="29" y2="8" stroke="var(--${name})" stroke-width="2" ${more}/>`;
const dot = (name, more = "") => `<circle cx="15" cy="8" r="4.5" fill="var(--${name})" ${more}/>`;
const box = (name, more = "") => `<rect x="5" y="1" width="20" height="14" rx="1" fill="var(--${name})" stroke="var(--rule)" ${more}/>`;
const ramp = (a, b, c) => [a, b, c].map((name, i) => `<rect x="${3 + 8 * i}" y="1" width="8" height="14" fill="var(--${name})" stroke="var(--rule)"/>`).join("");
const hollow = (name) => `<circle cx="15" cy="8" r="4" fill="none" stroke="var(--${name})" stroke-width="1.6"/>`;
const cross = (name) => `<path d="M11 4l8 8m0-8l-8 8" stroke="var(--${name})" stroke-width="2" fill="none"/>`;
const dashes = 'stroke-dasharray="5 3"';
const n = (many, what) => `${many.toLocaleString("en")} ${what}`;

const times = (factor) => (factor > 1.05 ? `, evidence ×${factor.toFixed(1)}` : "");
const MAPS = [
  ["fuzzy", `Fuzzy sets${times(D.grid.exposure[0])}`, ramp("empty", "unknown", "occupied")],
  ["bayes", `Bayes${times(D.grid.exposure[1])}`, ramp("empty", "unknown", "occupied")],
  ["shafer", `Dempster–Shafer${times(D.grid.exposure[2])}`, ramp("empty", "unknown", "occupied")],
  ["none", "No gridmap", ""],
];
const accepted = D.closures.accepted.reduce((sum, one) => sum + one, 0);
const LAYERS = [ // name, label, legend, shown at first, how much there is of it
  ["Gridmap"],
  ["contradictory", "Contradictory", box("contradictory"), true, 1],
  ["unexplored", "Unexplored", box("unexplored"), true, 1],
  ["regions", "Regions and gateways", `<rect x="5" y="1" width="20" height="14" fill="var(--region)" fill-opacity=".2" stroke="var(--region)"/><line x1="15" y1="1" x2="15" y2="15" stroke="var(--gateway)" stroke-width="3"/>`, false, D.regions.length],
  ["Topological map"],
  ["places", "Places", dot("place"), true, place.n],
  ["links", "Links, by residual", line("strain1"), true, link.n],
  ["ellipses", "Uncertainty, 3 σ", `<ellipse cx="15" cy="8" rx="12" ry="6" fill="var(--place)" fill-opacity=".2" stroke="var(--place)"/>`, false, place.n],
  ["predicted", "Predicted, refuted places", hollow("predicted").replace('cx="15"', 'cx="8"') + cross("refuted").replace("M11", "M19"), false, count(P.state, "p") + count(P.state, "r")],
  ["numbers", "Numbers and names", `<text x="15" y="13" text-anchor="middle" style="font-size:12px">P7</text>`, false, place.n],
  ["Relaxation"],
  ["before", "Places before it", hollow("before"), false, place.n],
  ["shift", "Shift of each place", `<path d="M2 12L27 4m-6-1l6 1l-4 5" stroke="var(--shift)" fill="none" stroke-width="1.4"/>`, false, place.n],
  ["Loops"],
  ["accepted", `Accepted <small>${accepted}</small>`, line("accepted", 'stroke-width="3"'), false, accepted],
  ["refused", `Refused <small>${D.closures.place.length - accepted}</small>`, line("refused", dashes), false, D.closures.place.length - accepted],
  ["Path"],
  ["path", "Path in the map", line("path"), false, path.x.length],
  ["odometry", "Path by raw odometry", line("odometry", 'stroke-dasharray="2 3"'), false, path.x.length],
];
const shown = Object.fromEntries(LAYERS.filter((one) => one.length > 1).map(([name, , , first, many]) => [name, first && many > 0]));
let calculus = "fuzzy";

function buildLayers() {
  const panel = byId("layers");
  let group;
  const entry = (input, legend, label) => {
    const row = element("label");
    row.innerHTML = `<svg viewBox="0 0 30 16" aria-hidden="true">${legend}</svg><span>${label}</span>`;
    row.prepend(input);
    if (input.disabled) { row.className = "none"; row.lastChild.insertAdjacentHTML("beforeend", " <small>none</small>"); }
    group.append(row);
  };
  const begin = (title) => { group = element("fieldset"); group.append(element("legend", {}, title)); panel.append(group); };
  for (const [name, label, legend, , many] of LAYERS) {
    if (!label) {
      begin(name);
      if (name === "Gridmap") for (const [key, title, ramp] of MAPS) {
        const input = element("input", { type: "radio", name: "calculus", value: key });
        input.checked = key === calculus;
        input.addEventListener("change", () => { calculus = key; redraw(); });
        entry(input, ramp, title);
      }
      continue;
    }
    const input = element("input", { type: "checkbox", value: name });
    input.checked = shown[name];
    input.disabled = many === 0;
    input.addEventListener("change", () => { shown[name] = input.checked; redraw(); });
    entry(input, legend, label);
    if (name === "links") group.insertAdjacentHTML("beforeend", `<div class="scale" aria-label="Residual of a link in standard deviations"><div>${
      [0, 1, 2, 3, 4].map((at) => `<i style="background:var(--strain${at});height:${WIDTHS[at] * 1.6}px;align-self:center"></i>`).join("")}</div><div>${
      ["<½", "<1", "<2", "<3", "≥3"].map((text) => `<span>${text} σ</span>`).join("")}</div></div>`);
  }
}

// Drawing. Geometry is collected in paths over map coordinates, once for each moment of the replay, so that panning only draws.
const WIDTHS = [1.2, 1.5, 2, 2.8, 4];
let shapes = null;
const stale = () => { shapes = null; redraw(); };
function collect() {
  const { x, y } = now, made = { travelled: [], recognised: [], blocked: new Path2D(), predictedLinks: new Path2D(), before: new Path2D(), shift: new Path2D(), accepted: new Path2D(), refused: new Path2D(), predicted: new Path2D(), refuted: [] };
  for (let at = 0; at < 5; at++) { made.travelled.push(new Path2D()); made.recognised.push(new Path2D()); }
  const segment = (into, ax, ay, bx, by) => { into.moveTo(ax, ay); into.lineTo(bx, by); };
  for (let i = 0; i < now.links; i++) {
    const a = link.from[i], b = link.to[i];
    const into = K.state[i] === "r" ? null : K.origin[i] === "p" ? made.predictedLinks : made[K.origin[i] === "r" ? "recognised" : "travelled"][strainOf(i)];
    if (into) segment(into, x[a], y[a], x[b], y[b]);
  }
  for (let i = 0; i < now.places; i++) {
    const state = P.state[i];
    if (state === "p") segment(made.predicted, x[i], y[i], x[i], y[i]);
    else if (state === "r") made.refuted.push(i);
    if (state !== "v") continue;
    segment(made.before, place.x0[i], place.y0[i], place.x0[i], place.y0[i]);
    segment(made.shift, place.x0[i], place.y0[i], x[i], y[i]);
  }
  D.closures.place.forEach((a, i) => {
    const b = D.closures.known[i];
    if (a < now.places && b < now.places) segment(D.closures.accepted[i] ? made.accepted : made.refused, x[a], y[a], x[b], y[b]);
  });
  return made;
}
const polyline = (xs, ys) => { const made = new Path2D(); xs.forEach((x, i) => made.lineTo(x, ys[i])); return made; };
const driven = polyline(path.x, path.y), believed = polyline(path.x0, path.y0);
const byArea = [...D.regions].sort((a, b) => b.area - a.area);
const floor = D.regions.map((region) => { // outlines of regions
  const made = new Path2D();
  for (const ring of region.rings) {
    ring.forEach(([x, y], i) => (i ? made.lineTo(x / 1000, y / 1000) : made.moveTo(x / 1000, y / 1000)));
    made.closePath();
  }
  return made;
});

let ink = {};
function readInk() {
  const names = "ink soft faint halo place before shift path odometry predicted refuted accepted refused region gateway unexplored unknown raised strain0 strain1 strain2 strain3 strain4".split(" ");
  ink = Object.fromEntries(names.map((name) => [name, color(name)]));
}
function draw() {
  const dense = canvas.width / view.width || 1;
  shapes ??= collect();
  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.fillStyle = ink.unknown;
  pen.fillRect(0, 0, canvas.width, canvas.height);
  if (shown.unexplored) { // the image ends, the unexplored does not
    pen.fillStyle = ink.unexplored; pen.globalAlpha = UNEXPLORED * faded();
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.globalAlpha = 1;
  }
  pen.setTransform(view.scale * dense, 0, 0, -view.scale * dense, dense * (view.width / 2 - view.x * view.scale), dense * (view.height / 2 + view.y * view.scale));
  pen.lineCap = "round"; pen.lineJoin = "round";
  drawGridmap(dense);
  if (shown.regions) drawRegions();
  if (shown.odometry) stroke(believed, ink.odometry, 1.2, [2, 3]);
  if (shown.path) stroke(driven, ink.path, 1.6);
  if (shown.shift) stroke(shapes.shift, ink.shift, 1);
  if (shown.before) ring(shapes.before, ink.before, 7);
  if (shown.links) {
    stroke(shapes.predictedLinks, ink.predicted, 1, [1, 4]);
    for (let at = 0; at < 5; at++) {
      stroke(shapes.recognised[at], ink[`strain${at}`], WIDTHS[at], [5, 4]);
      stroke(shapes.travelled[at], ink[`strain${at}`], WIDTHS[at]);
    }
  }
  if (shown.refused) stroke(shapes.refused, ink.refused, 1.4, [4, 3]);
  if (shown.accepted) stroke(shapes.accepted, ink.accepted, 3);
  if (shown.ellipses) drawEllipses();
  if (shown.places) drawPlaces(dense);
  if (shown.predicted) { ring(shapes.predicted, ink.predicted, 8); drawRefuted(); }
  drawChosen();
  pen.setTransform(dense, 0, 0, dense, 0, 0);
  if (shown.numbers) drawNumbers();
  if (shown.regions) drawRegionNames();
  drawFurniture();
}
function stroke(shape, style, width, dash = []) { // widths and dashes in pixels, whatever the zoom
  pen.strokeStyle = style; pen.lineWidth = width / view.scale;
  pen.setLineDash(view.scale < 6 ? [] : dash.map((length) => length / view.scale)); // from afar a dash is longer than its link
  pen.stroke(shape);
  pen.setLineDash([]);
}
// Ten thousand round caps take a browser a tenth of a second, ten thousand copies of one small picture a few milliseconds.
function drawPlaces(dense) {
  const size = Math.min(Math.max(view.scale * 0.36, 2.4), 12), rim = 1.3, edge = Math.ceil((size + 2 * rim) * dense) + 2;
  const stamp = element("canvas", { width: edge, height: edge }), dot = stamp.getContext("2d");
  for (const [radius, style] of [[size / 2 + rim, ink.raised], [size / 2, ink.place]]) { dot.fillStyle = style; dot.beginPath(); dot.arc(edge / 2, edge / 2, radius * dense, 0, 7); dot.fill(); }
  pen.save();
  pen.setTransform(1, 0, 0, 1, 0, 0);
  const small = size < 4, squares = new Path2D(), side = size * dense;
  for (let i = 0; i < now.places; i++) {
    if (P.state[i] !== "v" || !inView(now.x[i], now.y[i], 12)) continue;
    const [left, top] = toScreen(now.x[i], now.y[i]);
    if (small) squares.rect(Math.round(left * dense - side / 2), Math.round(top * dense - side / 2), side, side);
    else pen.drawImage(stamp, Math.round(left * dense - edge / 2), Math.round(top * dense - edge / 2));
  }
  pen.fillStyle = ink.place;
  pen.fill(squares);
  pen.restore();
}
function ring(shape, style, size) { stroke(shape, style, size); stroke(shape, ink.raised, size - 3); }
const faded = () => (now.links < link.n ? 0.45 : 1); // the gridmap is drawn from the end of the story
function drawGridmap(dense) {
  const put = (bitmap) => { if (bitmap) pen.drawImage(bitmap, 0, 0, D.grid.columns, D.grid.rows); };
  pen.save();
  pen.transform(D.grid.cell, 0, 0, -D.grid.cell, grid.left, grid.bottom + grid.height);
  pen.imageSmoothingEnabled = view.scale * dense * D.grid.cell < 1;
  pen.globalAlpha = faded();
  put(image[calculus]);
  if (shown.unexplored) put(image.unexplored);
  if (shown.contradictory) put(image.contradictory);
  pen.restore();
}
function drawRegions() {
  D.regions.forEach((region, index) => {
    pen.fillStyle = ink.region; pen.globalAlpha = region.corridor ? 0.1 : 0.2;
    pen.fill(floor[index], "evenodd");
    pen.globalAlpha = 1;
    stroke(floor[index], ink.region, 1.2);
  });
  for (const { ends: [a, b] } of D.gateways) {
    const door = new Path2D();
    door.moveTo(a[0] / 1000, a[1] / 1000); door.lineTo(b[0] / 1000, b[1] / 1000);
    stroke(door, ink.gateway, 4);
  }
}
const inView = (x, y, margin = 40) => { const [left, top] = toScreen(x, y); return left > -margin && top > -margin && left < view.width + margin && top < view.height + margin; };
// Thousands of ellipses upon each other take a second and show nothing: then each spot of the screen has its largest alone.
const CROWD = 1500, SPOT = 20;
function thinned(many) {
  if (many.length <= CROWD) return many;
  const largest = new Map();
  for (const i of many) {
    const [left, top] = toScreen(now.x[i], now.y[i]), spot = Math.floor(left / SPOT) * 65536 + Math.floor(top / SPOT);
    if (!largest.has(spot) || place.a[largest.get(spot)] < place.a[i]) largest.set(spot, i);
  }
  return [...largest.values()];
}
function drawEllipses() {
  const all = new Path2D(), many = [];
  for (let i = 0; i < now.places; i++) {
    if (P.state[i] === "v" && 3 * place.a[i] * view.scale >= 1 && inView(now.x[i], now.y[i], 400)) many.push(i);
  }
  for (const i of thinned(many)) {
    all.moveTo(now.x[i] + 3 * place.a[i] * Math.cos(place.angle[i]), now.y[i] + 3 * place.a[i] * Math.sin(place.angle[i]));
    all.ellipse(now.x[i], now.y[i], 3 * place.a[i], 3 * place.b[i], place.angle[i], 0, 2 * Math.PI);
  }
  pen.fillStyle = ink.place; pen.globalAlpha = 0.13; pen.fill(all); pen.globalAlpha = 1;
  stroke(all, ink.place, 1);
}
function drawRefuted() {
  const all = new Path2D(), half = 4 / view.scale;
  for (const i of shapes.refuted) for (const way of [1, -1]) { all.moveTo(now.x[i] - half, now.y[i] - way * half); all.lineTo(now.x[i] + half, now.y[i] + way * half); }
  stroke(all, ink.refuted, 1.8);
}
function drawChosen() {
  if (chosen === null || chosen >= now.places) return;
  const own = new Path2D(), x = now.x[chosen], y = now.y[chosen];
  for (const i of linksOf[chosen]) if (i < now.links) { own.moveTo(x, y); const other = link.from[i] === chosen ? link.to[i] : link.from[i]; own.lineTo(now.x[other], now.y[other]); }
  stroke(own, ink.ink, 1.4);
  const mark = new Path2D();
  mark.arc(x, y, Math.max(10, view.scale * 0.3) / view.scale, 0, 2 * Math.PI);
  stroke(mark, ink.halo, 5); stroke(mark, ink.ink, 2.2);
}
function label(text, left, top, style, size = 12) {
  pen.font = `${size}px ${color("sans")}`; pen.lineWidth = 3.5; pen.strokeStyle = ink.halo; pen.fillStyle = style;
  pen.strokeText(text, left, top); pen.fillText(text, left, top);
}
// Never two labels on one spot: the paper is divided into cells as large as a label, and each takes one.
function roomFor(taken, left, top, width) {
  const row = Math.round(top / 16), first = Math.floor((left - width / 2) / 22), last = Math.floor((left + width / 2) / 22), cells = [];
  for (let column = first; column <= last; column++) cells.push(`${column},${row}`);
  if (cells.some((cell) => taken.has(cell))) return false;
  cells.forEach((cell) => taken.add(cell));
  return true;
}
function drawNumbers() {
  const taken = new Set();
  pen.textAlign = "left";
  for (let i = 0; i < now.places; i++) {
    if (P.state[i] === "m" || !inView(now.x[i], now.y[i])) continue;
    const [left, top] = toScreen(now.x[i], now.y[i]);
    if (roomFor(taken, left + 22, top, 30)) label(place.name(i) || `P${i}`, left + 8, top - 5, ink.ink, 11.5);
  }
}
function drawRegionNames() {
  const taken = new Set();
  pen.textAlign = "center";
  for (const region of byArea) {
    const [left, top] = toScreen(region.x / 1000, region.y / 1000), text = `${region.name} · ${region.area} m²`;
    if (roomFor(taken, left, top, 7 * text.length)) label(text, left, top, ink.region, 12.5);
  }
}
function drawFurniture() { // a bar of a round length, and north
  const longest = 150 / view.scale, decade = 10 ** Math.floor(Math.log10(longest));
  const length = [5, 2, 1].map((step) => step * decade).find((one) => one <= longest) ?? decade;
  const base = view.height - 46, end = 14 + length * view.scale, shape = new Path2D(`M14 ${base - 6}v6H${end}v-6M24 58V22l-5 11M24 22l5 11`);
  pen.strokeStyle = ink.halo; pen.lineWidth = 5; pen.stroke(shape);
  pen.strokeStyle = ink.ink; pen.lineWidth = 1.8; pen.stroke(shape);
  pen.textAlign = "left"; label(length >= 1 ? `${length} m` : `${Math.round(length * 100)} cm`, end + 8, base + 3, ink.ink);
  pen.textAlign = "center"; label("N", 24, 74, ink.ink);
}

// What lies under the pointer.
const say = (html) => { byId("readout").innerHTML = html || "Point at the map to read its cells, places, links and loops."; };
function nearestPlace(left, top, within) {
  let best = null, distance = within;
  for (let i = 0; i < now.places; i++) {
    if (P.state[i] === "m") continue;
    const [x, y] = toScreen(now.x[i], now.y[i]), away = Math.hypot(x - left, y - top);
    if (away < distance) { distance = away; best = i; }
  }
  return best;
}
function nearestOf(many, ends, left, top, within) {
  let best = null, distance = within;
  for (let i = 0; i < many; i++) {
    const pair = ends(i);
    if (!pair) continue;
    const [ax, ay] = toScreen(now.x[pair[0]], now.y[pair[0]]), [bx, by] = toScreen(now.x[pair[1]], now.y[pair[1]]);
    const dx = bx - ax, dy = by - ay, t = Math.min(Math.max(((left - ax) * dx + (top - ay) * dy) / (dx * dx + dy * dy || 1), 0), 1);
    const away = Math.hypot(left - ax - t * dx, top - ay - t * dy);
    if (away < distance) { distance = away; best = i; }
  }
  return best;
}
const escapeText = (text) => text.replace(/[&<>"]/g, (letter) => `&#${letter.charCodeAt(0)};`);
const nameOf = (i) => `P${i}${place.name(i) ? ` “${escapeText(place.name(i))}”` : ""}`;
function closureText(i) {
  return `${D.closures.accepted[i] ? "accepted" : "refused"}: ${escapeText(D.closures.reason[i])}; ${fixed(D.closures.sigma[i] / 100, 1)} σ from the rest of the map, likeness ${fixed(D.closures.score[i] / 1000)}, shift ${fixed(D.closures.shift[i] / 1000)} m`;
}
function describe(left, top) {
  const near = nearestPlace(left, top, 10);
  if (near !== null) return `<b>${nameOf(near)}</b> ${{ v: "", p: "predicted", r: "refuted" }[P.state[near]]} σ ${fixed(place.a[near], 3)} m · moved ${fixed(Math.hypot(place.x[near] - place.x0[near], place.y[near] - place.y0[near]))} m · click to open`;
  const isShown = (i) => shown[D.closures.accepted[i] ? "accepted" : "refused"];
  const closure = shown.accepted || shown.refused ? nearestOf(D.closures.place.length, (i) => isShown(i) && D.closures.place[i] < now.places ? [D.closures.place[i], D.closures.known[i]] : null, left, top, 6) : null;
  if (closure !== null) return `<b>P${D.closures.place[closure]}–P${D.closures.known[closure]}</b> ${closureText(closure)}`;
  const near2 = shown.links ? nearestOf(now.links, (i) => K.state[i] === "r" ? null : [link.from[i], link.to[i]], left, top, 5) : null;
  if (near2 !== null) return `<b>P${link.from[near2]}–P${link.to[near2]}</b> ${ORIGIN[K.origin[near2]]}, ${fixed(link.length[near2])} m · residual ${fixed(link.residual[near2], 3)} m, ${fixed(K.sigma[near2] / 100)} σ; ${fixed(K.against[near2] / 100)} σ from the rest of the map${link.bridges.has(near2) ? " · part of no loop" : ""}`;
  return "";
}
function point(left, top) {
  const [x, y] = toMap(left, top), about = describe(left, top);
  const known = calculus === "none" ? null : degreesAt(calculus, x, y);
  const values = known && { fuzzy: `empty ${fixed(known[0])}, occupied ${fixed(known[1])}`, bayes: `P(occupied) ${fixed((1 + known[1] - known[0]) / 2)}`, shafer: `m(empty) ${fixed(known[0])}, m(occupied) ${fixed(known[1])}` }[calculus];
  stage.classList.toggle("aim", about.startsWith("<b>P") && about.endsWith("open"));
  say([`x ${fixed(x)} m, y ${fixed(y)} m`, values, about].filter(Boolean).join(" &ensp;·&ensp; "));
}
