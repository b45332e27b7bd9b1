// One place: its local grid with histograms and readings, its links, the loops in which it was weighed.
let chosen = null;
const S = D.signatures, sheets = new Map();
const CELL = 4, HISTOGRAM = 52; // pixels of a cell, and of the longest bar

function open(index, show = false) {
  chosen = index;
  if (index !== null && show && !inView(now.x[index], now.y[index], -30)) { view.x = now.x[index]; view.y = now.y[index]; }
  if (index !== null && index >= now.places) moveTo(link.n);
  history.replaceState(null, "", index === null ? "#" : `#P${index}`);
  fillInspector();
  redraw();
}
function openNearest(left, top, within) { const near = nearestPlace(left, top, within); if (near !== null || within < Infinity) open(near); }
function step(by) {
  let next = chosen === null ? (by > 0 ? -1 : place.n) : chosen;
  do next = (next + by + place.n) % place.n; while (P.state[next] === "m" && next !== chosen);
  open(next, true);
}

async function sheetOf(tile) { // the indices of the sheet that holds a tile
  const number = Math.floor(tile / (S.across * S.across));
  if (!sheets.has(number)) sheets.set(number, recolored(bytes(S.sheets[number]), (index) => [index, index, index, 255]).then((bitmap) => {
    const held = element("canvas", { width: bitmap.width, height: bitmap.height }).getContext("2d", { willReadFrequently: true });
    held.drawImage(bitmap, 0, 0);
    return held;
  }));
  return sheets.get(number);
}
function readingsOf(index) { // echoes as seen from the place, in its own axes
  const echoes = [], scans = scansOf.get(index) ?? [], cos = Math.cos(-place.heading[index]), sin = Math.sin(-place.heading[index]);
  let all = 0;
  for (const i of scans) {
    const { mounts } = D.scans.sensors[D.scans.sensor[i]], [c, s] = [Math.cos(scan.heading[i]), Math.sin(scan.heading[i])];
    mounts.forEach(([ahead, aside, turn], beam) => {
      const range = scan.ranges[scan.first[i] + beam];
      if (range < 65534) all++;
      if (range >= 65534) return;
      const length = range * D.scans.unit / 1000, bearing = scan.heading[i] + turn / 1000;
      const x = scan.x[i] + (c * ahead - s * aside) / 1000 + length * Math.cos(bearing) - place.x[index];
      const y = scan.y[i] + (s * ahead + c * aside) / 1000 + length * Math.sin(bearing) - place.y[index];
      echoes.push([cos * x - sin * y, sin * x + cos * y]);
    });
  }
  return { echoes, all, scans: scans.length };
}
let withReadings = true;
async function drawSignature(held, index) {
  const tile = S.tile[index], size = S.size, sheet = await sheetOf(tile), within = tile % (S.across * S.across);
  if (chosen !== index) return;
  const { data } = sheet.getImageData(within % S.across * size, Math.floor(within / S.across) * size, size, size);
  const edge = size * CELL, ink2 = held.getContext("2d"), rows = [], columns = [];
  for (let i = 0; i < size; i++) { rows.push([0, 0, 0]); columns.push([0, 0, 0]); }
  ink2.fillStyle = color("paper"); ink2.fillRect(0, 0, held.width, held.height);
  const paints = ["unexplored", "empty", "occupied"].map(color);
  for (let row = 0; row < size; row++) for (let column = 0; column < size; column++) {
    const kind = data[4 * (row * size + column)];
    rows[row][kind]++; columns[column][kind]++;
    ink2.fillStyle = paints[kind]; ink2.fillRect(column * CELL, row * CELL, CELL, CELL);
  }
  // Histograms: empty cells as a pale bar, occupied ones as a dark bar upon it, four times as long to be seen.
  const most = Math.max(1, ...rows.map((one) => one[1]), ...columns.map((one) => one[1])), length = HISTOGRAM / most;
  for (let i = 0; i < size; i++) {
    ink2.fillStyle = color("strain0"); ink2.globalAlpha = 0.45;
    ink2.fillRect(edge + 8, i * CELL, rows[i][1] * length, CELL - 1); ink2.fillRect(i * CELL, edge + 8, CELL - 1, columns[i][1] * length);
    ink2.globalAlpha = 1; ink2.fillStyle = color("strain3");
    ink2.fillRect(edge + 8, i * CELL, Math.min(4 * rows[i][2], most) * length, CELL - 1); ink2.fillRect(i * CELL, edge + 8, CELL - 1, Math.min(4 * columns[i][2], most) * length);
  }
  const put = (x, y) => [(x - S.left[tile] / 1000) / S.cell * CELL, edge - (y - S.bottom[tile] / 1000) / S.cell * CELL];
  ink2.save(); ink2.beginPath(); ink2.rect(0, 0, edge, edge); ink2.clip();
  if (withReadings) for (const [x, y] of readingsOf(index).echoes) {
    const [left, top] = put(x, y);
    ink2.fillStyle = color("halo"); ink2.beginPath(); ink2.arc(left, top, 3.4, 0, 7); ink2.fill();
    ink2.fillStyle = color("contradictory"); ink2.beginPath(); ink2.arc(left, top, 2.4, 0, 7); ink2.fill();
  }
  const [left, top] = put(0, 0);
  ink2.strokeStyle = color("place"); ink2.lineWidth = 2; ink2.beginPath(); ink2.moveTo(left - 7, top); ink2.lineTo(left + 7, top); ink2.moveTo(left, top - 7); ink2.lineTo(left, top + 7); ink2.stroke();
  ink2.restore();
}
function linkRow(i) {
  const other = link.from[i] === chosen ? link.to[i] : link.from[i], held = K.state[i] === "r" ? "dropped" : K.state[i] === "b" ? "blocked" : ORIGIN[K.origin[i]];
  return `<tr><td><span class="swatch" style="background:var(--strain${strainOf(i)})"></span><a href="#P${other}" data-place="${other}">P${other}</a></td><td>${held}${link.bridges.has(i) ? ", in no loop" : ""}</td><td class="n">${fixed(link.length[i])}</td><td class="n">${fixed(link.residual[i], 3)}</td><td class="n">${fixed(K.sigma[i] / 100)}</td></tr>`;
}
function closureItem(i) {
  const [a, b] = [D.closures.place[i], D.closures.known[i]], other = a === chosen ? b : a;
  return `<li><a href="#P${other}" data-place="${other}">P${other}</a> ${closureText(i)}</li>`;
}
function fillInspector() {
  const panel = byId("inspector"), choose = `<div class="steps"><button type="button" data-step="-1" aria-label="Previous place">←</button><button type="button" data-step="1" aria-label="Next place">→</button><input id="find" list="names" placeholder="number or name" aria-label="Open a place by its number or name"></div>`;
  if (chosen === null) {
    panel.innerHTML = `<h2>A place</h2>${choose}<p class="lead">Click a place on the map to see what it is recognised by: its local grid and histograms, the readings taken there, its links, and the loops in which it was weighed.</p>`;
    return wireInspector(panel);
  }
  const i = chosen, region = D.regions.find((one) => one.label === P.region[i]), seen = readingsOf(i), tile = S.tile[i];
  const kind = { v: "", p: "predicted", r: "refuted", m: "merged" }[P.state[i]], mine = closuresOf.get(i) ?? [];
  const side = S.size * CELL + 8 + HISTOGRAM, facts = [
    ["Position", `${fixed(place.x[i])}, ${fixed(place.y[i])} m`], ["σ", `${fixed(place.a[i], 3)} × ${fixed(place.b[i], 3)} m`],
    ["Moved by relaxation", `${fixed(Math.hypot(place.x[i] - place.x0[i], place.y[i] - place.y0[i]))} m`],
    ["Visits", P.visits[i]], ["Region", region ? escapeText(region.name) : "none"], ["Readings", `${seen.all} echoes in ${seen.scans} ${seen.scans === 1 ? "scan" : "scans"}`],
  ];
  panel.innerHTML = `<h2>${nameOf(i)} <small>${kind}</small></h2>${choose}<div class="sheet"><div>${tile < 0 ? "<p class=\"lead\">Nobody has been here, so there is no local grid.</p>" : `
    <canvas width="${side}" height="${side}" role="img" aria-label="Local grid of place ${i} with row and column histograms"></canvas>
    <p class="caption">${fixed(S.size * S.cell, 1)} m around the place; bars count <span style="color:var(--strain0)">empty</span> and (×4) <span style="color:var(--strain3)">occupied</span> cells of each row and column.
    </p><label class="tick"><input type="checkbox" id="readings"${withReadings ? " checked" : ""}> Echoes of the readings taken here${D.scans.every > 1 ? `, one scan in ${D.scans.every}` : ""}</label>`}
    <dl>${facts.map(([name, value]) => `<dt>${name}</dt><dd>${value}</dd>`).join("")}</dl></div>
    <div><h3>Links</h3><table><thead><tr><th>To</th><th></th><th>[m]</th><th>off [m]</th><th>[σ]</th></tr></thead><tbody>${linksOf[i].map(linkRow).join("")}</tbody></table>
    ${mine.length ? `<h3>Loops weighed</h3><ul>${mine.slice(0, 40).map(closureItem).join("")}</ul>` : ""}</div></div>`;
  wireInspector(panel);
  const held = panel.querySelector("canvas");
  if (held) drawSignature(held, i);
}
function wireInspector(panel) {
  panel.querySelectorAll("[data-step]").forEach((button) => button.addEventListener("click", () => step(+button.dataset.step)));
  panel.querySelector("#readings")?.addEventListener("change", (event) => { withReadings = event.target.checked; drawSignature(panel.querySelector("canvas"), chosen); });
  panel.querySelector("#find").addEventListener("change", (event) => {
    const wanted = event.target.value.trim().toLowerCase(), number = Number(wanted.replace(/^p/, ""));
    const named = Object.keys(P.names).find((key) => P.names[key].toLowerCase() === wanted);
    const found = named !== undefined ? Number(named) : wanted !== "" && Number.isInteger(number) && number >= 0 && number < place.n ? number : null;
    if (found === null) event.target.setCustomValidity(`places are numbered from 0 to ${place.n - 1}`); else open(found, true);
    event.target.reportValidity(); event.target.setCustomValidity("");
  });
}
