// A report in headless Chromium: node --test report.test.mjs, with REPORT=page.html and CHROMIUM=/usr/bin/chromium.
// PICTURES=folder keeps screenshots.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const page = pathToFileURL(process.env.REPORT).href;
const pictures = process.env.PICTURES;
let browser;

before(async () => {
  browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    // WebGL without a graphics card.
    args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
  });
});
after(() => browser?.close());

// The page, loaded, and all that it complained of or asked the network for.
async function opened(options = {}) {
  const context = await browser.newContext({ viewport: { width: 1200, height: 1000 }, ...options });
  const tab = await context.newPage();
  const complaints = [], requests = [];
  tab.on("console", (message) => { if (message.type() === "error") complaints.push(message.text()); });
  tab.on("pageerror", (error) => complaints.push(String(error)));
  tab.on("request", (request) => { if (!/^(file|data|blob):/.test(request.url())) requests.push(request.url()); });
  await tab.goto(page);
  await tab.waitForSelector("html[data-ready=true]", { state: "attached", timeout: 120_000 });
  return { context, tab, complaints, requests };
}

// What the page shows: the cursor's line in the plots, the mean height of the vehicle's vertices, the clock.
const shown = (tab) => tab.evaluate(() => {
  const mean = (values) => Array.from(values).reduce((sum, v) => sum + v, 0) / values.length;
  const vehicle = document.getElementById("scene").data[1];
  return {
    cursor: document.getElementById("plots").layout.shapes.map(({ x0, x1, yref }) => [x0, x1, yref]),
    x: mean(vehicle.x), z: mean(vehicle.z),
    clock: document.getElementById("clock").textContent,
    panels: new Set(document.getElementById("plots").data.map((trace) => trace.yaxis)).size,
    theme: document.documentElement.dataset.theme,
  };
});
const settled = (tab) => tab.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 200)))));



test("it loads without a complaint and without the network, and the cursor moves the scene and every plot", async () => {
  const { context, tab, complaints, requests } = await opened();
  const start = await shown(tab);
  assert.equal(start.panels, 5);
  assert.deepEqual(start.cursor, [[0, 0, "paper"]]); // one line across all panels
  const webgl = await tab.evaluate(() => document.querySelectorAll("#scene canvas").length);
  assert.ok(webgl > 0, "the scene is drawn");
  await tab.locator("#time").fill("2.5");
  await settled(tab);
  const later = await shown(tab);
  assert.deepEqual(later.cursor, [[2.5, 2.5, "paper"]]);
  assert.equal(later.clock, "2.50 s");
  assert.ok(later.x - start.x > 0.4 && later.z - start.z > 0.01, `the vehicle has gone ahead and up: ${JSON.stringify([start, later])}`);
  if (pictures) await tab.screenshot({ path: `${pictures}/report-light.png` });
  assert.deepEqual(complaints, []);
  assert.deepEqual(requests, []);
  await context.close();
});

test("keys move the cursor and start and stop the run", async () => {
  const { context, tab, complaints } = await opened();
  for (let k = 0; k < 5; k += 1) await tab.keyboard.press("ArrowRight");
  await settled(tab);
  assert.equal((await shown(tab)).clock, "0.10 s");
  await tab.keyboard.press("PageDown");
  await settled(tab);
  assert.equal((await shown(tab)).clock, "0.60 s");
  await tab.keyboard.press("Space");
  await tab.waitForFunction(() => parseFloat(document.getElementById("clock").textContent) > 0.9, null, { timeout: 60_000 });
  await tab.keyboard.press("Space");
  assert.equal(await tab.locator("#play").getAttribute("aria-pressed"), "false");
  await tab.keyboard.press("Home");
  await settled(tab);
  assert.equal((await shown(tab)).clock, "0.00 s");
  assert.deepEqual(complaints, []);
  await context.close();
});

test("another run is chosen from the table, and a tap on a phone moves the cursor, in the dark", async () => {
  const { context, tab, complaints } = await opened({ viewport: { width: 412, height: 915 }, hasTouch: true, isMobile: true, colorScheme: "dark" });
  assert.equal((await shown(tab)).theme, "dark");
  const rows = tab.locator("tbody tr");
  assert.ok((await rows.count()) >= 2);
  await rows.nth(1).locator("button").tap();
  await settled(tab);
  assert.equal(await rows.nth(1).getAttribute("aria-current"), "true");
  const box = await tab.locator("#time").boundingBox();
  await tab.touchscreen.tap(box.x + box.width / 2, box.y + box.height / 2);
  await settled(tab);
  assert.ok(parseFloat((await shown(tab)).clock) > 1);
  const wide = await tab.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(wide <= 412, `the page is ${wide} px wide on a screen of 412`);
  if (pictures) await tab.screenshot({ path: `${pictures}/report-dark.png` });
  await tab.locator("#theme").tap();
  await settled(tab);
  assert.equal((await shown(tab)).theme, "light");
  assert.deepEqual(complaints, []);
  await context.close();
});
