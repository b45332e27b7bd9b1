// node compare.mjs MODULES ARTEFACTS compare.html: maps upon each other.
import { pathToFileURL } from "node:url";
import { check, run } from "./browser.mjs";

await run(async ({ open, shoot }, file) => {
  const url = pathToFileURL(file).href;
  for (const javaScriptEnabled of [true, false]) {
    const page = await open(url, { javaScriptEnabled });
    const seen = (name) => page.locator(`figure.${name}`).first().evaluate((one) => getComputedStyle(one).visibility === "visible");
    check("first one sees what changed", await seen("change") && !(await seen("before")) && !(await seen("after")));
    await page.locator("#first").check();
    check("the first map alone", await seen("before") && !(await seen("change")));
    await page.locator("#second").check();
    check("the other map alone", await seen("after") && !(await seen("before")));
    await page.locator("#blink").check();
    const moves = await page.locator("figure.after").first().evaluate((one) => getComputedStyle(one).animationName);
    check("the maps blink", moves === "blink", moves);
    await page.locator("#change").check();
    await shoot(page, javaScriptEnabled ? "compare" : "compare-without-script");
    if (javaScriptEnabled) await keys(page, seen);
    await page.context().close();
  }
});

async function keys(page, seen) {
  await page.locator("#table").focus();
  await page.keyboard.press(" ");
  check("space shows the first map", await seen("before"));
  await page.keyboard.press(" ");
  check("space again the other one", await seen("after"));
  await page.keyboard.press("d");
  check("D what changed", await seen("change"));
  const place = () => page.locator("#sheet").evaluate((sheet) => sheet.style.transform);
  await page.keyboard.press("+");
  const near = await place();
  await page.keyboard.press("ArrowLeft");
  check("keys move and zoom", near.includes("scale(1.3)") && await place() !== near, near);
}
