// The window on the map: `scale` pixels per metre, the map point (x, y) in its middle.
const stage = byId("stage"), canvas = byId("canvas"), pen = canvas.getContext("2d");
const view = { x: 0, y: 0, scale: 20, width: 0, height: 0 };
const toScreen = (x, y) => [view.width / 2 + (x - view.x) * view.scale, view.height / 2 - (y - view.y) * view.scale];
const toMap = (left, top) => [view.x + (left - view.width / 2) / view.scale, view.y - (top - view.height / 2) / view.scale];

function extent() { // everything that can be shown
  let [left, bottom, right, top] = [grid.left, grid.bottom, grid.left + grid.width, grid.bottom + grid.height];
  for (let i = 0; i < place.n; i++) {
    left = Math.min(left, place.x[i]); right = Math.max(right, place.x[i]);
    bottom = Math.min(bottom, place.y[i]); top = Math.max(top, place.y[i]);
  }
  return [left, bottom, right, top];
}
function fit() {
  const [left, bottom, right, top] = extent(), strip = 34; // the readout lies over the lower edge
  view.scale = Math.min(view.width / (right - left + 1), (view.height - strip) / (top - bottom + 1));
  view.x = (left + right) / 2;
  view.y = (bottom + top) / 2 - strip / 2 / view.scale;
  redraw();
}
function zoomAt(factor, left = view.width / 2, top = view.height / 2) {
  const [x, y] = toMap(left, top), scale = Math.min(Math.max(view.scale * factor, 0.05), 2000);
  view.x = x + (view.x - x) * view.scale / scale;
  view.y = y + (view.y - y) * view.scale / scale;
  view.scale = scale;
  redraw();
}
function pan(right, down) { view.x -= right / view.scale; view.y += down / view.scale; redraw(); }
function resize() {
  const dense = window.devicePixelRatio || 1, first = view.width === 0;
  view.width = stage.clientWidth; view.height = stage.clientHeight;
  canvas.width = Math.round(view.width * dense); canvas.height = Math.round(view.height * dense);
  if (first) fit(); else redraw();
}
let asked = false;
function redraw() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(() => { asked = false; draw(); });
}

// One finger or the mouse moves, two fingers zoom, a press without a move opens a place.
const fingers = new Map();
let pressed = null;
stage.addEventListener("pointerdown", (event) => {
  if (event.target.closest("button")) return;
  stage.setPointerCapture(event.pointerId);
  fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
  pressed = fingers.size === 1 ? [event.offsetX, event.offsetY] : null;
});
stage.addEventListener("pointermove", (event) => {
  const before = fingers.get(event.pointerId), now = [event.offsetX, event.offsetY];
  if (!before) return point(...now);
  if (pressed && Math.hypot(now[0] - pressed[0], now[1] - pressed[1]) > 4) { pressed = null; stage.classList.add("moving"); }
  if (fingers.size === 2) {
    const other = [...fingers].find(([id]) => id !== event.pointerId)[1], gap = (a) => Math.hypot(a[0] - other[0], a[1] - other[1]) || 1;
    zoomAt(gap(now) / gap(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
  } else if (!pressed) pan(now[0] - before[0], now[1] - before[1]);
  if (!pressed) fingers.set(event.pointerId, now);
});
const lift = (event) => {
  if (pressed && event.type === "pointerup") openNearest(...pressed, 16);
  pressed = null;
  fingers.delete(event.pointerId);
  stage.classList.remove("moving");
};
stage.addEventListener("pointerup", lift);
stage.addEventListener("pointercancel", lift);
stage.addEventListener("pointerleave", () => say(""));
stage.addEventListener("wheel", (event) => { event.preventDefault(); zoomAt(Math.exp(-event.deltaY / 400), event.offsetX, event.offsetY); }, { passive: false });
document.querySelectorAll("[data-zoom]").forEach((button) => button.addEventListener("click", () => {
  if (button.dataset.zoom === "fit") fit(); else zoomAt(button.dataset.zoom === "in" ? 1.5 : 1 / 1.5);
}));
const KEYS = {
  ArrowLeft: () => pan(60, 0), ArrowRight: () => pan(-60, 0), ArrowUp: () => pan(0, 60), ArrowDown: () => pan(0, -60),
  "+": () => zoomAt(1.3), "=": () => zoomAt(1.3), "-": () => zoomAt(1 / 1.3), 0: fit,
  Enter: () => openNearest(view.width / 2, view.height / 2, Infinity), n: () => step(1), p: () => step(-1),
  Escape: () => open(null), " ": () => playOrPause(),
};
stage.addEventListener("keydown", (event) => {
  const act = event.ctrlKey || event.metaKey || event.altKey || event.target !== stage ? null : KEYS[event.key];
  if (act) { event.preventDefault(); act(); }
});
