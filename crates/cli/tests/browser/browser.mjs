// A headless Chromium and the page in it, watched: console errors, page errors and requests that leave the disk are faults.
import { createRequire } from "node:module";
import { mkdirSync } from "node:fs";
import { join } from "node:path";

/** Starts the browser; `modules` is the folder whose node_modules hold playwright-core. */
export async function start(modules, artefacts) {
  const { chromium } = createRequire(join(modules, "/"))("playwright-core");
  mkdirSync(artefacts, { recursive: true });
  const browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"],
  });
  const faults = [];
  const open = async (url, options = {}) => {
    const context = await browser.newContext({ viewport: { width: 1500, height: 950 }, ...options });
    const page = await context.newPage();
    page.on("console", (message) => { if (message.type() === "error") faults.push(`console: ${message.text()}`); });
    page.on("pageerror", (error) => faults.push(`page: ${error.message}`));
    page.on("request", (request) => { if (!isHere(request.url(), url)) faults.push(`request: ${request.url()}`); });
    await page.goto(url);
    return page;
  };
  const shoot = (page, name, options = {}) => page.screenshot({ path: join(artefacts, `${name}.png`), ...options });
  return { browser, faults, open, shoot };
}

/** The page itself, what it carries within it, and its own server where it has one. */
function isHere(url, page) {
  if (/^(data|blob):/.test(url)) return true;
  return page.startsWith("http") ? new URL(url).origin === new URL(page).origin : url.split("#")[0] === page.split("#")[0];
}

/** Checks with names; the first that fails ends the test with its name. */
export function check(what, holds, seen = "") {
  if (!holds) throw new Error(`${what}${seen === "" ? "" : `: saw ${seen}`}`);
  console.log(`ok ${what}`);
}

/** Runs a test, closes the browser whatever happens, and tells the caller by the exit code. */
export async function run(test) {
  const [modules, artefacts, ...rest] = process.argv.slice(2);
  const session = await start(modules, artefacts);
  try {
    await test(session, ...rest);
    check("nothing was complained of, and nothing asked of a network", session.faults.length === 0, session.faults.join("; "));
  } catch (error) {
    console.log(`not ok ${error.message}`);
    process.exitCode = 1;
  } finally {
    await session.browser.close();
  }
}
