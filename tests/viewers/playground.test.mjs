// The playground in headless Chromium, from a plain web server: PLAYGROUND=folder node --test playground.test.mjs, with CHROMIUM=/usr/bin/chromium.
// PICTURES=folder keeps screenshots.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { basename, join } from "node:path";
import { after, before, test } from "node:test";
import { McapStreamReader } from "@mcap/core";
import { chromium } from "playwright-core";

const folder = process.env.PLAYGROUND, pictures = process.env.PICTURES;
const TYPES = { html: "text/html", js: "text/javascript", css: "text/css", wasm: "application/wasm" };
let browser, server, page;

before(async () => {
  server = createServer(async ({ url }, answer) => {
    const name = basename(new URL(url, "http://localhost").pathname) || "index.html";
    try {
      const bytes = await readFile(join(folder, name));
      answer.writeHead(200, { "content-type": TYPES[name.split(".").pop()] ?? "application/octet-stream" }).end(bytes);
    } catch {
      answer.writeHead(404).end();
    }
  });
  await new Promise((done) => { server.listen(0, "127.0.0.1", done); });
  page = `http://127.0.0.1:${server.address().port}/`;
  browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    // WebGL without a graphics card.
    args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
  });
});
after(async () => {
  await browser?.close();
  server?.close();
});

// The page, loaded and ready, and all that it complained of or asked others for.
async function opened(hash = "", options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 1000 }, acceptDownloads: true, ...options });
  const tab = await context.newPage();
  tab.setDefaultTimeout(120_000); // a busy machine without a graphics card
  const complaints = [], elsewhere = [];
  tab.on("console", (message) => { if (message.type() === "error") complaints.push(message.text()); });
  tab.on("pageerror", (error) => complaints.push(String(error)));
  tab.on("request", (request) => { if (!request.url().startsWith(page) && !/^(data|blob):/.test(request.url())) elsewhere.push(request.url()); });
  await tab.goto(page + hash);
  await tab.waitForSelector("html[data-ready=true]", { state: "attached", timeout: 120_000 });
  return { context, tab, complaints, elsewhere };
}

const numbers = (text) => (text.match(/-?\d+(\.\d+)?/g) ?? []).map(Number);
const shown = async (tab, id) => numbers(await tab.locator(`#${id}`).textContent());
// Looks until the numbers that are shown there are so.
const until = async (tab, id, test_, what) => {
  const from = performance.now();
  let found = [];
  while (performance.now() - from < 120_000) {
    found = await shown(tab, id);
    if (test_(found)) return;
    await tab.waitForTimeout(20);
  }
  assert.fail(`not in time: ${what}, but ${found}`);
};
const ended = (tab) => tab.waitForSelector("html[data-mode=ended]", { state: "attached", timeout: 120_000 });
const picture = async (tab, name) => { if (pictures) await tab.screenshot({ path: `${pictures}/playground-${name}.png`, fullPage: true }); };
const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2 };

test("keys drive the vehicle, and the run can be taken along as log and commands", async () => {
  const { context, tab, complaints, elsewhere } = await opened("#scenario=flat&policy=paper");
  assert.deepEqual(await shown(tab, "place"), [0, 0]);
  await tab.keyboard.down("ArrowUp");
  await until(tab, "place", ([x]) => x > 0.15, "15 cm forward");
  const [, y] = await shown(tab, "place");
  assert.ok(Math.abs(y) < 0.02, `forward is forward, not ${y} m aside`);
  await tab.keyboard.up("ArrowUp");
  await until(tab, "ahead", ([is, asked]) => Math.abs(is) < 0.01 && asked === 0, "rest");
  await tab.keyboard.down("a");
  await until(tab, "place", ([, side]) => side > 0.1, "10 cm to the left");
  await tab.keyboard.up("a");
  await tab.locator("#run", { hasText: "Pause" }).click();
  await tab.locator("#commands pre", { hasText: "drive.csv" }).waitFor();
  await tab.locator("#outcome", { hasText: "driven" }).waitFor();
  const files = {};
  tab.on("download", async (download) => { files[download.suggestedFilename()] = await readFile(await download.path()); });
  await tab.getByRole("button", { name: "Download the log (MCAP)" }).click();
  await tab.locator("#writing", { hasText: "has" }).waitFor({ timeout: 120_000 });
  while (Object.keys(files).length < 2) await tab.waitForTimeout(20);
  assert.deepEqual(Object.keys(files).sort(), ["drive.csv", "flat-paper-articulated.mcap"]);
  assert.match(String(files["drive.csv"]), /^time_s,vx_m_s,vy_m_s,wz_rad_s\n/);
  const reader = new McapStreamReader({ validateCrcs: true });
  reader.append(files["flat-paper-articulated.mcap"]);
  let last = 0n;
  for (let record; (record = reader.nextRecord());) if (record.type === "Message") last = record.logTime;
  const [time] = await shown(tab, "time");
  // The page shows hundredths of a second.
  assert.ok(Math.abs(Number(last) * 1e-9 - time) <= 0.0051, `a log until ${last} ns of a run of ${time} s`);
  assert.deepEqual([complaints, elsewhere], [[], []]);
  await context.close();
});

test("two policies run side by side to the end of the scenario, in light and in dark", async () => {
  const { context, tab, complaints, elsewhere } = await opened("", { colorScheme: "light" });
  await tab.locator("#run").click();
  await until(tab, "time", ([time]) => time > 2, "two seconds");
  await picture(tab, "light");
  await tab.locator("#theme").click();
  await until(tab, "time", ([time]) => time > 2.5, "half a second more");
  await picture(tab, "dark");
  await ended(tab);
  assert.deepEqual(await tab.locator("#outcome thead th").allTextContents(), ["figure", "steady", "independent"]);
  // The last state is drawn in the frame after.
  await until(tab, "time", ([time]) => time === 6, "the end of the scenario");
  // The names and the choice of the command's table: where a climb ends says nothing.
  const titles = await tab.locator("#outcome tbody th").allTextContents();
  assert.deepEqual(titles.slice(0, 4), ["verdict", "crossing time [s]", "peak pitch [deg]", "heading error [deg]"]);
  assert.ok(!titles.some((title) => /final|retries/.test(title)), String(titles));
  assert.deepEqual(await tab.locator("#meanings dt").allTextContents(), titles.slice(1));
  assert.ok(await tab.locator("#mark").isHidden());
  const work = numbers(await tab.locator("#outcome tr", { hasText: "work [J]" }).textContent());
  assert.ok(work.length === 2 && work[0] !== work[1], `two runs, two figures: ${work}`);
  assert.equal(await tab.locator("#wheels tbody tr").count(), 7);
  assert.equal(await tab.locator("#player canvas").count(), 1);
  assert.deepEqual([complaints, elsewhere], [[], []]);
  await context.close();
});

test("the address holds the settings, and a wrong one is a line", async () => {
  const { context, tab, complaints } = await opened("#scenario=step&policy=reach&against=paper&torque=1.5&height=0.03");
  await tab.locator("#friction").fill("0.5");
  await tab.locator("#friction").press("Enter");
  await tab.waitForURL(/friction=0\.5/);
  const chosen = () => tab.evaluate(() => Object.fromEntries([...document.querySelectorAll("#fields :is(input, select)")].map(({ id, value }) => [id, value])));
  const before = await chosen();
  assert.deepEqual(before, { scenario: "step", vehicle: "", policy: "reach", against: "paper", torque: "1.5", friction: "0.5", height: "0.03", engine: "articulated", model: "ball" });
  await tab.reload();
  await tab.waitForSelector("html[data-ready=true]", { state: "attached" });
  assert.deepEqual(await chosen(), before);
  assert.match(await tab.locator("#commands pre").first().textContent(), /omnistep run step .*--policy reach .*--set terrain\.height_m=0\.03/s);
  await tab.goto(`${page}#scenario=moon`);
  await tab.locator("#said", { hasText: 'scenario: "moon", allowed: step, flat' }).waitFor();
  await tab.goto(`${page}#scenario=step&friction=7`);
  await tab.locator("#friction-wrong", { hasText: "Friction: 7, allowed: 0 to 2" }).waitFor();
  assert.ok(await tab.locator("#run").isDisabled(), "nothing runs that the simulation refused");
  await tab.goto(`${page}#scenario=flat`);
  await tab.locator("html[data-mode=ready]").waitFor({ state: "attached" });
  assert.equal(await tab.locator("#said").textContent(), "");
  assert.deepEqual(complaints, []);
  await context.close();
});

test("a bad address names what is allowed, also when it is the first", async () => {
  const { context, tab } = await opened("#scenario=nosuch");
  assert.match(await tab.locator("#said").textContent(), /^scenario: "nosuch", allowed: step, flat, .*figure_eight$/);
  await context.close();
});

test("what a field must not have is said below it, and no outcome of an earlier run stays", async () => {
  const { context, tab, complaints } = await opened("#scenario=step&policy=paper");
  await tab.locator("#run").click();
  await until(tab, "time", ([time]) => time > 0.2, "a fifth of a second");
  await tab.locator("#run", { hasText: "Pause" }).click();
  await tab.locator("#outcome").waitFor();
  await tab.locator("#height").fill("30");
  await tab.locator("#height").press("Enter");
  const line = tab.locator("#height-wrong", { hasText: "Height [m]: 30" });
  await line.waitFor();
  assert.equal(await line.textContent(), "Height [m]: 30, allowed: 0.0001 to 10");
  assert.deepEqual(await tab.locator("#height").evaluate((field) => [field.getAttribute("aria-invalid"), field.getAttribute("aria-describedby")]), ["true", "height-wrong"]);
  const [field, below] = [await tab.locator("#height").boundingBox(), await line.boundingBox()];
  assert.ok(below.y - field.y - field.height >= 0 && below.y - field.y - field.height < 20, "directly below the field");
  assert.ok(await tab.locator("#outcome").isHidden() && await tab.locator("#run").isDisabled());
  assert.equal(await tab.locator("#until").textContent(), "There is no run.");
  assert.equal(await tab.locator("#status").textContent(), "There is no run: a setting is not allowed.");
  assert.equal(await tab.locator("#player").evaluate((picture_) => getComputedStyle(picture_).opacity), "0.35", "the picture of the earlier run is faint");
  await picture(tab, "wrong");
  await tab.locator("#height").fill("0.03");
  await tab.locator("#height").press("Enter");
  await tab.locator("html[data-mode=ready]").waitFor({ state: "attached" });
  assert.deepEqual([await tab.locator("#height-wrong").textContent(), await tab.locator("#height").getAttribute("aria-invalid")], ["", null]);
  await tab.locator("#height").pressSequentially("e-");
  await tab.locator("#height").press("Enter");
  await tab.locator("#height-wrong", { hasText: "Height [m]: not a number" }).waitFor();
  assert.deepEqual(complaints, []);
  await context.close();
});

test("wheels are rollers where balls do not stand for them, unless balls are chosen, and then the outcome is marked", async () => {
  const { context, tab, complaints } = await opened("#scenario=step&vehicle=mecanum4&policy=paper");
  assert.equal(await tab.locator("#model").inputValue(), "rollers");
  assert.match(await tab.locator("#commands pre").first().textContent(), /physics\.wheel_model=rollers/);
  await tab.locator("#scenario").selectOption("flat");
  await tab.locator("html[data-mode=ready]").waitFor({ state: "attached" });
  await until(tab, "time", ([time]) => time === 0, "the start");
  assert.equal(await tab.locator("#model").inputValue(), "ball");
  await tab.goto(`${page}#scenario=step&vehicle=mecanum4&policy=paper&wheels=ball`);
  await tab.locator("#model-note", { hasText: "The balls do not stand for this vehicle's wheels on this ground." }).waitFor();
  await tab.locator("#run").click();
  await until(tab, "time", ([time]) => time > 0.2, "a fifth of a second");
  await tab.locator("#run", { hasText: "Pause" }).click();
  await tab.locator("#outcome td", { hasText: /^\w+ \*$/ }).waitFor();
  assert.ok(await tab.locator("#mark").isVisible());
  await picture(tab, "marked");
  assert.deepEqual(complaints, []);
  await context.close();
});

test("on a phone the buttons drive, and nothing is beyond the screen", async () => {
  const { context, tab, complaints, elsewhere } = await opened("#scenario=bumps&vehicle=mecanum4&policy=paper", { ...PHONE, colorScheme: "light" });
  const button = tab.getByRole("button", { name: "Forward" });
  await button.scrollIntoViewIfNeeded();
  const { x, y, width, height } = await button.boundingBox();
  const touch = await context.newCDPSession(tab);
  await touch.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: [{ x: x + width / 2, y: y + height / 2 }] });
  await until(tab, "place", ([ahead]) => ahead > 0.1, "10 cm forward");
  await touch.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  await until(tab, "ahead", ([is, asked]) => Math.abs(is) < 0.01 && asked === 0, "rest");
  const wide = await tab.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.ok(wide <= 0, `${wide} pixels are beyond the screen`);
  // A finger hits what is 40 pixels tall.
  const small = await tab.evaluate(() => [...document.querySelectorAll("main button, main input, main select")].filter((each) => each.closest("#player") === null && each.type !== "range" && each.getBoundingClientRect().height < 40).map(({ id, textContent }) => id || textContent));
  assert.deepEqual(small, []);
  await tab.evaluate(() => scrollTo(0, 0));
  await picture(tab, "phone");
  assert.deepEqual([complaints, elsewhere], [[], []]);
  await context.close();
});
