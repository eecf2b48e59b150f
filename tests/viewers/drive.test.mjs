// The page of `omnistep drive` in headless Chromium: OMNISTEP=path/to/omnistep node --test drive.test.mjs, with CHROMIUM=/usr/bin/chromium.
// PICTURES=folder keeps screenshots.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { after, before, test } from "node:test";
import { chromium } from "playwright-core";

const pictures = process.env.PICTURES;
const runs = [];
let browser;
before(async () => { browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: ["--no-sandbox"] }); });
// Whatever failed, nothing goes on.
after(() => { runs.forEach((run) => run.kill("SIGKILL")); return browser?.close(); });

// A run and its page's address.
async function started(...args) {
  const run = spawn(process.env.OMNISTEP, args);
  runs.push(run);
  let said = "", printed = "";
  run.stdout.on("data", (data) => { printed += data; });
  const page = await new Promise((found, failed) => {
    run.stderr.on("data", (data) => {
      said += data;
      const match = /(http:\/\/127\.0\.0\.1:\d+) in a browser/.exec(said);
      if (match) found(match[1]);
    });
    run.on("exit", () => failed(new Error(`ended: ${said}`)));
  });
  return { run, page, printed: () => printed };
}

// The page, loaded, with the state of the run, and all that it complained of or asked others for.
async function opened(page, options = {}, script = undefined) {
  const context = await browser.newContext({ viewport: { width: 1200, height: 900 }, ...options });
  const tab = await context.newPage();
  if (script) await tab.addInitScript(script);
  tab.setDefaultTimeout(120_000); // a busy machine without a graphics card
  const complaints = [], elsewhere = [];
  tab.on("console", (message) => { if (["error", "warning"].includes(message.type())) complaints.push(message.text()); });
  tab.on("pageerror", (error) => complaints.push(String(error)));
  tab.on("request", (request) => { if (request.url() !== `${page}/` && !request.url().startsWith("data:")) elsewhere.push(request.url()); });
  const sockets = [];
  tab.on("websocket", (socket) => sockets.push(socket.url()));
  await tab.goto(page);
  await tab.waitForSelector("html[data-ready=true]", { state: "attached", timeout: 60_000 });
  return { context, tab, complaints, elsewhere, sockets };
}

const numbers = (text) => text.match(/-?\d+(\.\d+)?/g).map(Number);
const place = async (tab) => numbers(await tab.locator("#place").textContent());
// Looks until the numbers that are shown there are so: the Content Security Policy of the page forbids evaluation.
const until = async (tab, id, test, what) => {
  const from = performance.now();
  let shown = "";
  while (performance.now() - from < 60_000) {
    shown = await tab.locator(`#${id}`).textContent();
    if (test(numbers(shown))) return;
    await tab.waitForTimeout(20);
  }
  assert.fail(`not in time: ${what}, but ${shown}`);
};
const rests = (tab) => until(tab, "ahead", ([is, asked]) => is === 0 && asked === 0, "rest")
  .then(() => until(tab, "left", ([is, asked]) => is === 0 && asked === 0, "rest sideways"));
const ended = async ({ run }) => { run.kill("SIGINT"); await once(run, "exit"); };
const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2 };

test("keys drive the vehicle, and letting go, looking away and space stop it", async () => {
  const run = await started("drive", "flat", "--port", "0", "--no-keys", "--json");
  const { context, tab, complaints, elsewhere, sockets } = await opened(run.page);
  assert.equal(await tab.title(), "chugo7 on flat: omnistep");
  // No command has come yet.
  assert.deepEqual((await place(tab)).map((value) => Math.abs(value)), [0, 0, 0]);
  await tab.keyboard.down("ArrowUp");
  await until(tab, "place", ([x]) => x > 0.1, "10 cm ahead");
  const [x, y] = await place(tab);
  assert.ok(Math.abs(y) < 0.02, `ahead is ahead, not ${y} m aside`);
  await tab.keyboard.up("ArrowUp");
  await rests(tab);
  // Sideways, as only such vehicles do; WASD are the same.
  await tab.keyboard.down("a");
  await until(tab, "place", ([, side]) => side > y + 0.1, "10 cm to the left");
  // Looking away: the key is still down.
  await tab.evaluate(() => window.dispatchEvent(new Event("blur")));
  await rests(tab);
  await tab.keyboard.up("a");
  assert.ok(Math.abs((await place(tab))[0] - x) < 0.15, "sideways is not ahead");
  await tab.keyboard.down("q");
  await until(tab, "place", ([, , degrees]) => degrees > 10, "10 degrees to the left");
  // Space stops, though the key is still held, and repeats itself.
  await tab.keyboard.press("Space");
  await until(tab, "turning", ([is, asked]) => Math.abs(is) < 0.01 && asked === 0, "no turning");
  await tab.keyboard.down("q");
  await tab.waitForTimeout(300);
  assert.equal(numbers(await tab.locator("#turning").textContent())[1], 0, "a key that repeats itself drives again after the stop");
  await tab.keyboard.up("q");
  // A button of the pad that a screen reader presses drives for a moment.
  const turned = (await place(tab))[2];
  await tab.getByRole("button", { name: "Turn right" }).press("Enter");
  await until(tab, "place", ([, , degrees]) => degrees < turned - 3, "3 degrees to the right");
  await until(tab, "turning", ([is, asked]) => Math.abs(is) < 0.01 && asked === 0, "no turning after a moment");
  // Settings by buttons, and what is refused is said.
  await tab.getByRole("button", { name: "scale_torques", exact: true }).click();
  await tab.locator("#policies button[aria-pressed=true]", { hasText: "scale_torques" }).waitFor();
  await tab.locator("#torque").fill("1.25");
  await tab.locator("#torque").press("Enter");
  await tab.locator("#policy", { hasText: "scale_torques, 1.25 N.m at most" }).waitFor();
  await tab.locator("#torque").fill("-1");
  await tab.locator("#torque").press("Enter");
  await tab.locator("#said", { hasText: "vehicle.motor.stall_torque_n_m: -1" }).waitFor();
  assert.equal(await tab.locator("#wheels tbody tr").count(), 7);
  // Every bar is a number to a screen reader.
  const meters = await tab.locator("#wheels [role=meter]").evaluateAll((all) => all.map((each) => ["aria-label", "aria-valuenow", "aria-valuemin", "aria-valuemax"].map((name) => each.getAttribute(name))));
  assert.deepEqual(meters.slice(0, 3).map(([label]) => label), ["Torque of wheel 1", "Slip of wheel 1", "Load of wheel 1"]);
  assert.equal(new Set(meters.map(([label]) => label)).size, 7 * 3);
  for (const [label, now, low, high] of meters) assert.ok(Number(now) >= Number(low) && Number(now) <= Number(high), `${label}: ${now}`);
  assert.ok(meters.some(([label, now]) => /^Load/.test(label) && Number(now) > 0.1), "loads are shown");
  assert.deepEqual([complaints, elsewhere], [[], []]);
  assert.deepEqual(sockets, [`${run.page.replace("http", "ws")}/`]);
  await context.close();
  await ended(run);
  assert.ok(JSON.parse(run.printed()).final_y_m > 0.1);
});

test("it drives over bumps in light and in dark, and on a phone with the pad", async () => {
  // Its motors hold it: without friction in its wheels it may otherwise roll to and fro between two bumps for ever.
  const run = await started("drive", "--port", "0", "--no-keys", "--set", "control.rest.hold_s=100", "--set", "control.rest.hold_torque_squared_n2m2s=1e6");
  const { context, tab, complaints } = await opened(run.page, { colorScheme: "light" });
  assert.equal(await tab.title(), "chugo7 on bumps: omnistep");
  await tab.keyboard.down("w");
  await until(tab, "place", ([x]) => x > 0.4, "nearly the first bump");
  await tab.keyboard.down("a");
  await until(tab, "place", ([x, y]) => x > 0.55 && y > 0.05, "slantwise over it");
  const inked = () => tab.evaluate(() => ["side", "plan"].map((id) => {
    const canvas = document.getElementById(id), { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const colours = new Set();
    for (let k = 0; k < data.length; k += 4) colours.add((data[k] << 16) | (data[k + 1] << 8) | data[k + 2]);
    return colours.size;
  }));
  // Ground, bodies, seven colours of wheels, forces, and their mixtures at edges.
  assert.ok((await inked()).every((count) => count > 50), "both views are drawn");
  if (pictures) await tab.screenshot({ path: `${pictures}/drive-light.png` });
  await tab.locator("#theme").click();
  if (pictures) { await tab.waitForTimeout(200); await tab.screenshot({ path: `${pictures}/drive-dark.png` }); }
  assert.equal(await tab.evaluate(() => document.documentElement.dataset.theme), "dark");
  // Sideways first, while it drives on: where its nose is on a bump its sideways wheels hang in the air, and its other
  // wheels roll sideways without friction, for ever.
  await tab.keyboard.up("a");
  await until(tab, "left", ([is, asked]) => Math.abs(is) < 0.01 && asked === 0, "rest sideways");
  await tab.keyboard.up("w");

  const phone = await opened(run.page, PHONE);
  await rests(phone.tab);
  const [before] = await place(phone.tab);
  const button = phone.tab.getByRole("button", { name: "Back" });
  await button.scrollIntoViewIfNeeded();
  const { x, y, width, height } = await button.boundingBox();
  const touch = await phone.context.newCDPSession(phone.tab);
  await touch.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: [{ x: x + width / 2, y: y + height / 2 }] });
  await until(phone.tab, "place", ([ahead]) => ahead < before - 0.05, "5 cm back");
  await touch.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  await rests(phone.tab);
  const wide = await phone.tab.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.ok(wide <= 0, `${wide} pixels are beyond the screen`);
  if (pictures) {
    await phone.tab.evaluate(() => scrollTo(0, 0));
    await phone.tab.screenshot({ path: `${pictures}/drive-phone.png`, fullPage: true });
  }
  assert.deepEqual([complaints, phone.complaints, phone.elsewhere], [[], [], []]);
  await context.close();
  await phone.context.close();
  await ended(run);
});

test("a page that goes leaves a vehicle at rest, and one of elsewhere cannot drive", async () => {
  const run = await started("drive", "flat", "--port", "0", "--no-keys");
  const driver = await opened(run.page), watcher = await opened(run.page);
  await driver.tab.keyboard.down("ArrowUp");
  await until(watcher.tab, "ahead", ([is]) => is > 0.2, "driving");
  await driver.context.close();
  await rests(watcher.tab);
  // A page that came from nowhere, and one that frames ours.
  const context = await browser.newContext();
  const tab = await context.newPage();
  tab.setDefaultTimeout(120_000); // a busy machine without a graphics card
  await tab.goto("data:text/html,<p>elsewhere</p>");
  const opens = await tab.evaluate((address) => new Promise((resolve) => {
    const socket = new WebSocket(address, "foxglove.sdk.v1");
    socket.addEventListener("open", () => resolve(true));
    socket.addEventListener("error", () => resolve(false));
  }), run.page.replace("http", "ws"));
  assert.equal(opens, false);
  await tab.setContent(`<iframe src="${run.page}"></iframe>`);
  await tab.waitForTimeout(500);
  assert.equal(await tab.frames()[1].locator("#plan").count(), 0, "the page is shown inside another");
  await context.close();
  await watcher.context.close();
  await ended(run);
});

test("a reset begins the run anew, and policy and torque limit stay", async () => {
  const run = await started("drive", "flat", "--port", "0", "--no-keys", "--json");
  const { context, tab, complaints } = await opened(run.page);
  const time = async () => numbers(await tab.locator("#time").textContent())[0];
  await tab.getByRole("button", { name: "scale_torques", exact: true }).click();
  await tab.locator("#about", { hasText: "the paper's eqs. (11) and (12)" }).waitFor();
  await tab.locator("#torque").fill("1.25");
  await tab.locator("#torque").press("Enter");
  await tab.locator("#policy", { hasText: "scale_torques, 1.25 N.m at most" }).waitFor();
  for (const resets of [() => tab.keyboard.press("r"), () => tab.locator("#reset").click()]) {
    await tab.keyboard.down("ArrowUp");
    await until(tab, "place", ([x]) => x > 0.2, "20 cm ahead");
    const before = await time();
    await resets();
    await until(tab, "place", ([x, y, degrees]) => [x, y, degrees].every((value) => Math.abs(value) < 0.01), "where it started");
    assert.ok(await time() < before, "the time begins anew");
    assert.equal(numbers(await tab.locator("#ahead").textContent())[1], 0, "a key that is held drives on");
    await tab.keyboard.up("ArrowUp");
    await tab.locator("#policy", { hasText: "scale_torques, 1.25 N.m at most" }).waitFor();
    assert.equal(await tab.locator("#policies button[aria-pressed=true]").textContent(), "scale_torques");
  }
  // In a field R is a letter.
  await tab.keyboard.down("ArrowUp");
  await until(tab, "place", ([x]) => x > 0.1, "10 cm ahead");
  await tab.keyboard.up("ArrowUp");
  await tab.locator("#torque").press("r");
  await tab.waitForTimeout(500);
  assert.ok((await place(tab))[0] > 0.1, "R in a field resets");
  assert.equal(await tab.locator("#said").textContent(), "");
  assert.deepEqual(complaints, []);
  await context.close();
  await ended(run);
  assert.ok(JSON.parse(run.printed()).final_x_m > 0.1);
});

test("a run that is watched only has no pad, and a page whose run has ended says so", async () => {
  const run = await started("run", "flat", "--live", "--port", "0", "--set", "duration_s=600");
  const { context, tab, complaints } = await opened(run.page);
  await until(tab, "ahead", ([is, asked]) => is > 0.25 && asked === 0.3, "the scenario's command");
  assert.deepEqual([await tab.locator("#steering").isVisible(), await tab.locator("#watched").isVisible()], [false, true]);
  assert.deepEqual(complaints, []);
  await ended(run);
  await tab.locator("#link.gone").waitFor();
  await context.close();
});

test("Space stops whatever has the focus, a long press on the pad drives on, and a stop waits for a gamepad's stick", async () => {
  const run = await started("drive", "flat", "--port", "0", "--no-keys");
  const pad = () => {
    const gamepad = { connected: true, axes: [0, 0, 0, 0], buttons: [] };
    window.tilt = (axes) => { gamepad.axes = axes; };
    navigator.getGamepads = () => [null, gamepad];
  };
  const { context, tab, complaints } = await opened(run.page, {}, pad);
  const tilt = (...axes) => tab.evaluate((to) => window.tilt(to), axes);
  const driving = () => until(tab, "ahead", ([, asked]) => asked > 0, "driving");
  const button = tab.getByRole("button", { name: "Ahead" }), { x, y, width, height } = await button.boundingBox();
  for (const id of ["theme", "torque", "fast"]) {
    await tab.mouse.move(x + width / 2, y + height / 2);
    await tab.mouse.down();
    await driving();
    await tab.locator(`#${id}`).focus();
    const before = await tab.evaluate(() => document.documentElement.dataset.theme);
    await tab.keyboard.press("Space");
    await rests(tab);
    assert.equal(await tab.evaluate(() => document.documentElement.dataset.theme), before, "Space presses nothing");
    await tab.mouse.up();
  }
  await tab.mouse.down();
  await driving();
  const [from] = await place(tab);
  const menu = (selector) => tab.locator(selector).evaluate((element) => element.dispatchEvent(new MouseEvent("contextmenu", { bubbles: true, cancelable: true })));
  assert.equal(await menu("#pad button[aria-label=Ahead]"), false, "no menu opens");
  await until(tab, "place", ([at]) => at > from + 0.1, "10 cm more");
  assert.equal(await menu("#figures"), true);
  await rests(tab);
  await tab.mouse.up();
  await tilt(0, -1, 0, 0);
  const [start] = await place(tab);
  await until(tab, "place", ([at]) => at > start + 0.1, "10 cm ahead");
  await tilt(-1, 0, 0, 0);
  const [, side] = await place(tab);
  await until(tab, "place", ([, at]) => at > side + 0.1, "10 cm to the left");
  await tilt(0, -1, 0, 0);
  await driving();
  await tab.locator("#stop").click();
  await rests(tab);
  await tab.waitForTimeout(300);
  assert.equal(numbers(await tab.locator("#ahead").textContent())[1], 0, "the stick is still held");
  await tilt(0.1, -0.1, 0, 0); // a stick at rest is not exactly in the middle
  await tab.waitForTimeout(200);
  await tilt(0, -1, 0, 0);
  await driving();
  assert.deepEqual(complaints, []);
  await context.close();
  await ended(run);
});
