// How the map grew. A moment is a number of links; places stand where the last relaxation before it put them, newer ones where
// they were put when the robot came.
const G = D.growth;
const growth = { x: metres(G.x), y: metres(G.y), offsets: Int16Array.from(words(G.offsets)), first: [] };
G.places.reduce((first, many) => { growth.first.push(first); return first + 2 * many; }, 0);
const placesAt = new Uint32Array(link.n + 1);
placesAt[0] = Math.min(1, place.n);
for (let i = 0; i < link.n; i++) placesAt[i + 1] = Math.max(placesAt[i], link.to[i] + 1, link.from[i] + 1);
placesAt[link.n] = place.n;

const now = { links: link.n, places: place.n, x: place.x.slice(), y: place.y.slice() };
const relaxedBy = (links) => compareSorted(G.links, links) - 1;
function moveTo(links) {
  now.links = links; now.places = placesAt[links];
  const last = links === link.n ? -2 : relaxedBy(links), settled = last < 0 ? 0 : G.places[last];
  for (let i = 0; i < now.places; i++) {
    const at = (growth.first[last] ?? 0) + 2 * i, known = i < settled;
    now.x[i] = last === -2 ? place.x[i] : known ? place.x[i] + growth.offsets[at] * G.unit / 1000 : growth.x[i];
    now.y[i] = last === -2 ? place.y[i] : known ? place.y[i] + growth.offsets[at + 1] * G.unit / 1000 : growth.y[i];
  }
  showMoment();
  stale();
}
const chart = byId("energy"), slider = byId("growth"), cursor = document.createElementNS("http://www.w3.org/2000/svg", "path");
const plot = { left: +chart.dataset.left, right: +chart.dataset.right };
function showMoment() {
  const last = relaxedBy(now.links), x = plot.left + (plot.right - plot.left) * now.links / Math.max(1, link.n);
  cursor.setAttribute("d", `M${x} 8V166`);
  slider.value = now.links;
  const energy = last < 0 ? "no loop yet" : `energy <b>${fixed(G.after[last])}</b>, ${G.expected[last]} expected`;
  byId("moment").innerHTML = `link <b>${now.links}</b> of ${link.n} · <b>${now.places}</b> places · ${energy}${G.of > G.links.length ? ` · ${G.links.length} of ${G.of} relaxations shown` : ""}`;
  slider.setAttribute("aria-valuetext", byId("moment").textContent);
}
let playing = null;
function stopPlaying() { playing = null; byId("play").textContent = "▶ Replay"; byId("play").setAttribute("aria-pressed", "false"); }
function playOrPause() {
  if (playing) return stopPlaying();
  const from = now.links >= link.n ? 0 : now.links, started = performance.now(), perLink = Math.max(14000 / link.n, 1);
  playing = (time) => {
    if (!playing) return;
    const at = Math.min(link.n, from + Math.floor(Math.max(0, time - started) / perLink));
    if (at !== now.links) moveTo(at);
    if (at < link.n) requestAnimationFrame(playing); else stopPlaying();
  };
  byId("play").textContent = "❚❚ Pause"; byId("play").setAttribute("aria-pressed", "true");
  requestAnimationFrame(playing);
}
function buildReplay() {
  slider.max = link.n; slider.value = link.n;
  cursor.setAttribute("class", "cursor");
  chart.append(cursor);
  slider.addEventListener("input", () => { stopPlaying(); moveTo(+slider.value); });
  byId("play").addEventListener("click", playOrPause);
  const scrub = (event) => {
    if (event.type !== "pointerdown" && !event.buttons) return;
    const { left, width } = chart.getBoundingClientRect(), at = (1000 * (event.clientX - left) / width - plot.left) / (plot.right - plot.left);
    stopPlaying();
    moveTo(Math.round(link.n * Math.min(Math.max(at, 0), 1)));
  };
  chart.addEventListener("pointerdown", (event) => { chart.setPointerCapture(event.pointerId); scrub(event); });
  chart.addEventListener("pointermove", scrub);
  showMoment();
}
