// All parts together.
const THEMES = ["", "light", "dark"];
async function applyTheme() {
  readInk();
  await paintImages();
  redraw();
  if (chosen !== null) fillInspector();
}
byId("theme").addEventListener("click", () => {
  const root = document.documentElement, next = THEMES[(THEMES.indexOf(root.dataset.theme ?? "") + 1) % THEMES.length];
  if (next) root.dataset.theme = next; else delete root.dataset.theme;
  byId("theme").textContent = `Theme: ${next || "automatic"}`;
  applyTheme();
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", applyTheme);

document.documentElement.classList.add("scripted");
buildLayers();
buildReplay();
fillInspector();
say("");
document.addEventListener("click", (event) => { // links to places, wherever they stand
  const link = event.target.closest("[data-place]");
  if (!link) return;
  event.preventDefault();
  open(+link.dataset.place, true);
  if (!byId("inspector").contains(link)) stage.scrollIntoView({ block: "center" });
});
const asked2 = /^#P(\d+)$/.exec(location.hash);
readInk();
new ResizeObserver(resize).observe(stage);
applyTheme().then(() => {
  if (asked2 && +asked2[1] < place.n) open(+asked2[1], true);
  document.documentElement.dataset.ready = "yes";
});
// For scripts: where things are on the screen.
window.topogrid = { data: D, view, toScreen: (index) => toScreen(now.x[index], now.y[index]), pan, zoomAt, open };
