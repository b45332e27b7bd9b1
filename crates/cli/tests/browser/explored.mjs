// node explored.mjs MODULES ARTEFACTS report.html: the page of a robot that explored, and was stopped before it knew all.
import { pathToFileURL } from "node:url";
import { check, run } from "./browser.mjs";

const picture = (page) => page.locator("#canvas").evaluate(async (canvas) => {
  for (let i = 0; i < 2; i++) await new Promise(requestAnimationFrame);
  return canvas.toDataURL();
});

await run(async ({ open, shoot }, file) => {
  const page = await open(pathToFileURL(file).href);
  await page.waitForSelector("html[data-ready]", { state: "attached" });
  const without = await picture(page);
  await page.locator("#layers input[value=predicted]").click();
  check("expected and refuted places are a layer", await picture(page) !== without);
  await shoot(page, "explored");
  // Each kind under the pointer says what it is.
  const states = await page.evaluate(() => topogrid.data.places.state);
  for (const [letter, word] of [["p", "predicted"], ["r", "refuted"]]) {
    if (!states.includes(letter)) continue; // most explorers refute nothing before they have been everywhere else
    const [left, top] = await page.evaluate((index) => topogrid.toScreen(index), states.indexOf(letter));
    const stage = await page.locator("#stage").boundingBox();
    await page.mouse.move(stage.x + 1 + left, stage.y + 1 + top);
    const told = await page.locator("#readout").textContent();
    check(`a ${word} place says so`, told.includes(word), told);
  }
  const slider = page.locator("#growth");
  await slider.focus();
  await slider.press("Home");
  check("the map grows from one place", await picture(page) !== without);
  const relaxed = await page.evaluate(() => topogrid.data.growth.links.length);
  check("coming back to known places relaxes the map", relaxed > 2, relaxed);
});
