// node load.mjs MODULES ARTEFACTS report.html: how long a page takes to open, and a frame of it with every layer added.
import { pathToFileURL } from "node:url";
import { run } from "./browser.mjs";

const LAYERS = ["ellipses", "shift", "before", "accepted", "refused", "path", "regions", "numbers"];

async function panning(page) {
  await page.locator("[data-zoom=fit]").click();
  return page.evaluate(async () => {
    const times = [];
    let last = performance.now();
    for (let i = 0; i < 24; i++) {
      topogrid.pan(i % 2 ? 8 : -8, i % 2 ? 3 : -3);
      await new Promise(requestAnimationFrame);
      times.push(performance.now() - last);
      last = performance.now();
    }
    times.sort((a, b) => a - b);
    return `${Math.round(times[12])} ms, ${Math.round(times[23])} ms at worst`;
  });
}

await run(async ({ open, shoot }, file) => {
  const begun = performance.now(), page = await open(pathToFileURL(file).href);
  await page.waitForSelector("html[data-ready]", { state: "attached", timeout: 120_000 });
  const places = await page.evaluate(() => topogrid.data.places.x.length);
  console.log(`${places} places: open after ${Math.round(performance.now() - begun)} ms`);
  console.log(`panning as it opens: ${await panning(page)}`);
  for (const name of LAYERS) {
    const box = page.locator(`#layers input[value=${name}]:not([disabled])`);
    if (await box.count() === 0) continue;
    await box.click();
    console.log(`and with ${name}: ${await panning(page)}`);
  }
  await shoot(page, "load");
});
