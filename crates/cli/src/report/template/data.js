// What the page knows, taken out of its packing: metres in typed arrays, one entry per place or per link.
const D = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);
const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
const words = (text) => { // 16 bits, little end first, whatever the machine's own order
  const packed = bytes(text), numbers = new Uint16Array(packed.length >> 1);
  for (let i = 0; i < numbers.length; i++) numbers[i] = packed[2 * i] | (packed[2 * i + 1] << 8);
  return numbers;
};
const metres = (column) => Float64Array.from(column, (millimetres) => millimetres / 1000);
const element = (tag, attributes = {}, ...children) => {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
};
const fixed = (value, digits = 2) => value.toFixed(digits).replace("-", "−");
const compareSorted = (sorted, value) => { // how many entries of `sorted` are at most `value`
  let low = 0, high = sorted.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] <= value) low = middle + 1; else high = middle;
  }
  return low;
};

const P = D.places, K = D.links;
const place = {
  n: P.x.length, x: metres(P.x), y: metres(P.y), x0: metres(P.x0), y0: metres(P.y0),
  a: metres(P.a), b: metres(P.b), angle: P.angle.map((degrees) => degrees * Math.PI / 180), heading: metres(P.heading),
  name: (index) => P.names[index] ?? "",
};
const link = { n: K.from.length, from: K.from, to: K.to, length: metres(K.length), residual: metres(K.residual), bridges: new Set(K.bridges) };
const path = { x: metres(D.path.x), y: metres(D.path.y), x0: metres(D.path.x0), y0: metres(D.path.y0) };
const grid = { left: D.grid.left / 1000, bottom: D.grid.bottom / 1000, width: D.grid.columns * D.grid.cell, height: D.grid.rows * D.grid.cell };

// Links by place, in one pass: at ten thousand places a search for each click would be felt.
const linksOf = Array.from({ length: place.n }, () => []);
for (let i = 0; i < link.n; i++) { linksOf[link.from[i]].push(i); if (link.to[i] !== link.from[i]) linksOf[link.to[i]].push(i); }
const closuresOf = new Map();
D.closures.place.forEach((from, index) => {
  for (const end of [from, D.closures.known[index]]) (closuresOf.get(end) ?? closuresOf.set(end, []).get(end)).push(index);
});
// Readings: where those of each scan begin.
const scan = { n: D.scans.place.length, first: [], ranges: words(D.scans.ranges), x: metres(D.scans.x), y: metres(D.scans.y), heading: metres(D.scans.heading) };
const scansOf = new Map();
for (let i = 0, first = 0; i < scan.n; i++) {
  scan.first.push(first);
  first += D.scans.sensors[D.scans.sensor[i]].mounts.length;
  (scansOf.get(D.scans.place[i]) ?? scansOf.set(D.scans.place[i], []).get(D.scans.place[i])).push(i);
}
// How strained a link is: five classes that differ in width as well as in colour.
const STRAIN = [0.5, 1, 2, 3];
const strainOf = (index) => { const sigma = K.sigma[index] / 100; let at = 0; while (at < 4 && sigma >= STRAIN[at]) at++; return at; };
const ORIGIN = { t: "travelled", r: "recognised", p: "predicted" };
