// The gridmap's images are PNGs whose palette index names a cell's degrees. They are coloured again for each theme and layer by
// writing another palette into the file; the browser's own decoder does the rest, so that large maps cost nothing here.
const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const rgb = (name) => { const hex = color(name); return [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)); };

const CRC = Uint32Array.from({ length: 256 }, (_, n) => { for (let k = 0; k < 8; k++) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1; return n; });
const crcOf = (data) => { let crc = -1; for (const byte of data) crc = CRC[(crc ^ byte) & 255] ^ (crc >>> 8); return ~crc >>> 0; };
const chunk = (type, data) => {
  const made = new Uint8Array(12 + data.length), view = new DataView(made.buffer);
  view.setUint32(0, data.length);
  for (let i = 0; i < 4; i++) made[4 + i] = type.charCodeAt(i);
  made.set(data, 8);
  view.setUint32(8 + data.length, crcOf(made.subarray(4, 8 + data.length)));
  return made;
};

// The same image in other colours; `paint(index)` gives red, green, blue and opacity, 0 to 255.
async function recolored(png, paint) {
  const view = new DataView(png.buffer), parts = [png.subarray(0, 8)];
  for (let at = 8; at < png.length;) {
    const length = view.getUint32(at), type = String.fromCharCode(...png.subarray(at + 4, at + 8)), end = at + 12 + length;
    if (type === "PLTE") {
      const colors = Array.from({ length: length / 3 }, (_, index) => paint(index));
      parts.push(chunk("PLTE", Uint8Array.from(colors.flatMap((one) => one.slice(0, 3)))), chunk("tRNS", Uint8Array.from(colors.map((one) => one[3]))));
    } else parts.push(png.subarray(at, end));
    at = end;
  }
  return createImageBitmap(new Blob(parts, { type: "image/png" }));
}

const degrees = (index) => [(index >> 4) / 15, (index & 15) / 15];
// As in map.png: how much evidence there is, `factor` times what was gathered, tells a cell from unexplored ground, and its
// occupied share whether it is floor or wall. A degree of 1 stands for all from 0.98 on: steps of a fifteenth tell no more.
const evidence = (factor) => (index) => {
  const [e, o] = degrees(index).map((degree) => -factor * Math.log(1 - Math.min(degree, 0.98)));
  return { known: 1 - Math.exp(-e - o), share: o / (e + o || 1) };
};
function cells(factor) {
  const [unknown, empty, occupied] = ["unknown", "empty", "occupied"].map(rgb), judge = evidence(factor);
  return (index) => {
    const { known, share } = judge(index), wall = Math.min(Math.max((share - 0.3) / 0.35, 0), 1);
    return [0, 1, 2].map((c) => Math.round((1 - known) * unknown[c] + known * ((1 - wall) * empty[c] + wall * occupied[c]))).concat(255);
  };
}
function overlay(name, degree) {
  const ink = rgb(name), judge = evidence(D.grid.exposure[0]);
  return (index) => [...ink, Math.round(255 * degree(judge(index)))];
}

const source = {
  fuzzy: bytes(byId("fuzzy").getAttribute("href").split(",")[1]),
  bayes: bytes(D.grid.bayes),
  shafer: bytes(D.grid.dempster_shafer),
};
// How much of its colour what is unexplored gets. The degree is squared ("very" unexplored), or a floor that was seen once would
// look as if nobody had been there.
const UNEXPLORED = 0.85;
let image = {};
async function paintImages() {
  const [fuzzy, bayes, shafer, contradictory, unexplored] = await Promise.all([
    ...[source.fuzzy, source.bayes, source.shafer].map((map, k) => recolored(map, cells(D.grid.exposure[k]))),
    recolored(source.fuzzy, overlay("contradictory", ({ known, share }) => known * Math.max(0, 1 - Math.abs(share - 0.5) / 0.175))),
    recolored(source.fuzzy, overlay("unexplored", ({ known }) => UNEXPLORED * (1 - known) ** 2)),
  ]);
  image = { fuzzy, bayes, shafer, contradictory, unexplored };
}

// The degrees under a point; the image is unpacked into indices when somebody first asks.
const indices = {};
async function unpack(name) {
  const bitmap = await recolored(source[name], (index) => [index, index, index, 255]);
  const canvas = element("canvas", { width: bitmap.width, height: bitmap.height });
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(bitmap, 0, 0);
  indices[name] = context;
}
function degreesAt(name, x, y) {
  if (!(name in indices)) { indices[name] = null; unpack(name); }
  const column = Math.floor((x - grid.left) / D.grid.cell), row = Math.floor((y - grid.bottom) / D.grid.cell);
  if (!indices[name] || column < 0 || row < 0 || column >= D.grid.columns || row >= D.grid.rows) return null;
  return degrees(indices[name].getImageData(column, D.grid.rows - 1 - row, 1, 1).data[0]);
}
