// node report.mjs MODULES ARTEFACTS report.html: everything that a reader of the report can do.
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { check, run } from "./browser.mjs";

const picture = (page) => page.locator("#canvas").evaluate(async (canvas) => {
  // Two frames: a change is drawn in the next one.
  for (let i = 0; i < 2; i++) await new Promise(requestAnimationFrame);
  return canvas.toDataURL();
});
const ready = (page) => page.waitForSelector("html[data-ready]", { state: "attached" });

await run(async ({ open, shoot }, file) => {
  const url = pathToFileURL(file).href, artefacts = process.argv[3];
  const page = await open(url);
  await ready(page);
  await shoot(page, "report");
  await shoot(page, "report-whole", { fullPage: true });

  await layers(page, shoot);
  await places(page, shoot);
  await replay(page, shoot);
  await keyboard(page);
  await page.context().close();

  await themes(open, shoot, url);
  await narrow(open, shoot, url);
  await withoutScript(open, shoot, url);
  await eyes(open, shoot, url);
  await paper(open, shoot, url);
  await large(open, shoot, file, artefacts);
});

async function layers(page, shoot) {
  const boxes = page.locator("#layers input:not([disabled])");
  const many = await boxes.count();
  check("there are layers to toggle", many >= 14, many);
  for (let i = 0; i < many; i++) {
    const box = boxes.nth(i), name = await box.getAttribute("value"), kind = await box.getAttribute("type");
    if (kind === "radio" && await box.isChecked()) continue;
    const before = await picture(page);
    await box.click();
    const after = await picture(page);
    check(`layer ${name} changes the map`, before !== after);
    if (kind === "radio") continue;
    await box.click();
    check(`layer ${name} goes as it came`, await picture(page) === before);
  }
  await page.locator("#layers input[value=fuzzy]").click();
  for (const name of ["ellipses", "before", "shift", "regions", "refused"]) await page.locator(`#layers input[value=${name}]:not([disabled])`).check();
  await shoot(page, "report-layers");
  for (const name of ["ellipses", "before", "shift", "regions", "refused"]) await page.locator(`#layers input[value=${name}]:not([disabled])`).uncheck();
}

async function places(page, shoot) {
  const middle = await page.evaluate(() => Math.floor(topogrid.data.places.x.length / 2));
  const [left, top] = await page.evaluate((index) => topogrid.toScreen(index), middle);
  const stage = await page.locator("#stage").boundingBox();
  await page.mouse.move(stage.x + 1 + left, stage.y + 1 + top);
  check("the place under the pointer is named", (await page.locator("#readout").textContent()).includes("click to open"));
  await page.mouse.click(stage.x + 1 + left, stage.y + 1 + top);
  const title = await page.locator("#inspector h2").textContent();
  check("a click opens a place", /^P\d+/.test(title), title);
  const index = Number(/\d+/.exec(title)[0]);
  await page.waitForFunction(() => { // the local grid is drawn once its sheet is unpacked
    const held = document.querySelector("#inspector canvas"), { data } = held.getContext("2d").getImageData(0, 0, held.width, held.height);
    return new Set(new Uint32Array(data.buffer)).size > 3;
  });
  const links = await page.locator("#inspector tbody tr").count();
  const expected = await page.evaluate((one) => topogrid.data.links.from.filter((from, i) => from === one || topogrid.data.links.to[i] === one).length, index);
  check("all its links are listed", links === expected && links > 0, `${links} of ${expected}`);
  const facts = await page.locator("#inspector dl").textContent();
  check("its readings are counted", /[1-9]\d* echoes in [1-9]\d* scans?/.test(facts), facts);
  await shoot(page, "report-place");
  const held = () => page.locator("#inspector canvas").evaluate((canvas) => canvas.toDataURL());
  const before = await held();
  await page.locator("#readings").click();
  await page.waitForFunction((old) => document.querySelector("#inspector canvas").toDataURL() !== old, before);
  await page.locator("#readings").click();
  await page.locator("#inspector tbody a").first().click();
  check("a link leads to the next place", await page.locator("#inspector h2").textContent() !== title);
  await page.locator("#find").fill("0");
  await page.locator("#find").press("Enter");
  check("a number opens its place", (await page.locator("#inspector h2").textContent()).startsWith("P0"));
  check("the address remembers the place", page.url().endsWith("#P0"), page.url());
}

async function replay(page, shoot) {
  const slider = page.locator("#growth"), last = Number(await slider.getAttribute("max"));
  const whole = await picture(page);
  await slider.focus();
  await slider.press("Home");
  check("the beginning is one place", (await page.locator("#moment").textContent()).includes("1 places"));
  await slider.evaluate((input, at) => { input.value = at; input.dispatchEvent(new Event("input")); }, Math.round(last / 2));
  check("the slider changes the map", await picture(page) !== whole);
  await shoot(page, "report-replay");
  const chart = await page.locator("#energy").boundingBox();
  await page.mouse.click(chart.x + 0.3 * chart.width, chart.y + 0.5 * chart.height);
  const near = Number(await slider.inputValue()) / last;
  check("a click on the chart goes to that moment", Math.abs(near - (0.3 * 1000 - 56) / 932) < 0.02, near);
  await page.locator("#play").click();
  await page.waitForFunction((from) => Number(document.getElementById("growth").value) > from, Math.round(near * last));
  await page.locator("#play").click();
  check("the replay pauses", await page.locator("#play").getAttribute("aria-pressed") === "false");
  await slider.focus();
  await slider.press("End");
  check("the end is the whole map", await picture(page) === whole);
}

async function keyboard(page) {
  await page.locator("#stage").focus();
  for (const key of ["ArrowRight", "ArrowUp", "+", "-"]) {
    const before = await picture(page);
    await page.keyboard.press(key);
    check(`${key} moves the map`, await picture(page) !== before);
  }
  await page.keyboard.press("0");
  await page.keyboard.press("Escape");
  check("Escape closes the place", (await page.locator("#inspector h2").textContent()) === "A place");
  await page.keyboard.press("Enter");
  check("Enter opens the nearest place", /^P\d+/.test(await page.locator("#inspector h2").textContent()));
  const title = await page.locator("#inspector h2").textContent();
  await page.keyboard.press("n");
  check("N opens the next one", await page.locator("#inspector h2").textContent() !== title);
  // Tab reaches every control, in the order of the page.
  await page.evaluate(() => document.getElementById("theme").focus());
  const reached = new Set();
  for (let i = 0; i < 40; i++) {
    reached.add(await page.evaluate(() => document.activeElement.id || document.activeElement.value || document.activeElement.dataset.zoom || ""));
    await page.keyboard.press("Tab");
  }
  for (const id of ["theme", "fuzzy", "contradictory", "links", "stage", "in", "find", "play", "growth"]) check(`Tab reaches ${id}`, reached.has(id), [...reached].join(" "));
}

async function themes(open, shoot, url) {
  const page = await open(url, { colorScheme: "dark" });
  await ready(page);
  const paper = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const dark = await paper(), drawn = await picture(page);
  await shoot(page, "report-dark");
  await page.locator("#theme").click(); // from automatic to light
  check("the theme can be chosen", await paper() !== dark, dark);
  await page.waitForFunction((old) => document.getElementById("canvas").toDataURL() !== old, drawn);
  await page.context().close();
}

async function narrow(open, shoot, url) {
  const page = await open(url, { viewport: { width: 400, height: 860 }, hasTouch: true });
  await ready(page);
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  check("a telephone need not scroll sideways", wide <= 400, wide);
  await shoot(page, "report-narrow", { fullPage: true });
  await page.context().close();
}

async function withoutScript(open, shoot, url) {
  const page = await open(url, { javaScriptEnabled: false });
  const image = await page.locator("#fuzzy").boundingBox();
  check("without a script there is the gridmap", image.width > 300 && image.height > 100, JSON.stringify(image));
  check("without a script there are tables", await page.locator("table:visible").count() >= 5);
  check("without a script there is the graph", await page.locator("svg.graph:visible").count() === 2);
  check("without a script nothing dead is shown", await page.locator("input:visible, button:visible").count() === 0);
  await shoot(page, "report-without-script", { fullPage: true });
  await page.context().close();
}

// What people see who lack a kind of cone; tests/palette.rs holds the numbers, these pictures are for looking at.
async function eyes(open, shoot, url) {
  for (const type of ["protanopia", "deuteranopia", "tritanopia", "achromatopsia"]) {
    const page = await open(url);
    await ready(page);
    for (const name of ["before", "shift", "regions", "refused"]) await page.locator(`#layers input[value=${name}]:not([disabled])`).check();
    const session = await page.context().newCDPSession(page);
    await session.send("Emulation.setEmulatedVisionDeficiency", { type });
    await picture(page);
    await shoot(page, `report-${type}`);
    await page.context().close();
  }
}

async function paper(open, shoot, url) {
  const page = await open(url);
  await ready(page);
  await page.emulateMedia({ media: "print" });
  check("on paper there is nothing to press", await page.locator("input:visible, button:visible").count() === 0);
  check("on paper there is the gridmap", (await page.locator("#fuzzy").boundingBox()).width > 300);
  check("on paper tables are whole", await page.locator(".long").evaluateAll((all) => all.every((one) => one.scrollHeight <= one.clientHeight + 1)));
  await shoot(page, "report-print", { fullPage: true });
  const pdf = await page.pdf({ format: "A4" });
  check("it prints", pdf.length > 20000, pdf.length);
  await page.context().close();
}

// A map of ten thousand places: the same one again and again, side by side.
async function large(open, shoot, file, artefacts) {
  const html = readFileSync(file, "utf8"), mark = '<script type="application/json" id="data">';
  const from = html.indexOf(mark) + mark.length, to = html.indexOf("</script>", from);
  const data = JSON.parse(html.slice(from, to)), many = data.places.x.length, copies = Math.ceil(10000 / many), across = Math.ceil(Math.sqrt(copies));
  const repeated = (column, change = (value) => value) => Array.from({ length: copies }, (_, k) => column.map((value) => change(value, k))).flat();
  const side = (k) => 30000 * (k % across), up = (k) => 30000 * Math.floor(k / across);
  const { places, links, closures, scans, growth } = data;
  for (const key of ["x", "x0"]) places[key] = repeated(places[key], (x, k) => x + side(k));
  for (const key of ["y", "y0"]) places[key] = repeated(places[key], (y, k) => y + up(k));
  for (const key of ["a", "b", "angle", "heading", "visits", "region"]) places[key] = repeated(places[key]);
  places.state = places.state.repeat(copies);
  for (const key of ["from", "to"]) links[key] = repeated(links[key], (place, k) => place + k * many);
  for (const key of ["length", "residual", "sigma", "against", "times"]) links[key] = repeated(links[key]);
  links.origin = links.origin.repeat(copies);
  links.state = links.state.repeat(copies);
  for (const key of ["place", "known"]) closures[key] = repeated(closures[key], (place, k) => place + k * many);
  for (const key of ["sigma", "shift", "score", "accepted", "reason"]) closures[key] = repeated(closures[key]);
  scans.place = scans.place.slice(0, 1);
  data.signatures.tile = repeated(data.signatures.tile);
  Object.assign(growth, { x: places.x, y: places.y, links: [links.from.length], places: [places.x.length], before: [1], after: [1], expected: [1], of: 1, offsets: Buffer.alloc(4 * places.x.length).toString("base64") });
  // A map that a robot explored has places that nobody has been to yet, and places that turned out to be none.
  places.state = places.state.replace(/./g, (state, i) => (i % 9 === 4 ? "p" : i % 9 === 7 ? "r" : state));
  const path = join(artefacts, "large.html");
  writeFileSync(path, html.slice(0, from) + JSON.stringify(data) + html.slice(to));

  const page = await open(pathToFileURL(path).href);
  await ready(page);
  await shoot(page, "report-large");
  const predicted = page.locator("#layers input[value=predicted]"), without = await picture(page);
  await predicted.click();
  check("predicted and refuted places change the map", await picture(page) !== without);
  await shoot(page, "report-predicted");
  await predicted.click();
  const frames = await page.evaluate(async () => {
    const times = [];
    let last = performance.now();
    for (let i = 0; i < 24; i++) {
      topogrid.pan(i % 2 ? 8 : -8, 3);
      await new Promise(requestAnimationFrame);
      times.push(performance.now() - last);
      last = performance.now();
    }
    return times.sort((a, b) => a - b);
  });
  console.log(`panning ${places.x.length} places: ${frames[12].toFixed(0)} ms a frame in the median, ${frames[23].toFixed(0)} ms at worst`);
  check("ten thousand places can be panned", frames[12] < 250, frames[12]);
  await page.locator("#stage").focus();
  await page.keyboard.press("Enter");
  check("ten thousand places can be opened", /^P\d+/.test(await page.locator("#inspector h2").textContent()));
  await page.context().close();
}
