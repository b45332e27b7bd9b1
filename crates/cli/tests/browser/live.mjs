// node live.mjs MODULES ARTEFACTS URL: the page of a run that goes on.
import { check, run } from "./browser.mjs";

await run(async ({ open, shoot }, url) => {
  const page = await open(url);
  await page.waitForSelector("html[data-places]", { state: "attached" });
  const places = Number(await page.evaluate(() => document.documentElement.dataset.places));
  check("places are shown", places >= 10, places);
  const figures = await page.locator("#figures").textContent();
  check("figures are told", /places\d+/.test(figures) && /driven\d/.test(figures), figures);
  const drawn = await page.locator("#map").evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return data.filter((value, at) => at % 4 === 3 && value > 0).length;
  });
  check("the map is drawn", drawn > 1000, drawn);
  await shoot(page, "live");
  await page.context().close();
});
