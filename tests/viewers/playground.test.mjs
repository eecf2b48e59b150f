// The playground in headless Chromium, from a plain web server: PLAYGROUND=folder node --test playground.test.mjs, with CHROMIUM=/usr/bin/chromium.
// PICTURES=folder keeps screenshots.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { basename, join } from "node:path";
import { after, before, test } from "node:test";
import { McapStreamReader } from "@mcap/core";
import { launched } from "./browser.mjs";

const folder = process.env.PLAYGROUND, pictures = process.env.PICTURES;
const TYPES = { html: "text/html", js: "text/javascript", css: "text/css", wasm: "application/wasm", jpg: "image/jpeg" };
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
  browser = await launched();
});
after(async () => {
  await browser?.close();
  server?.close();
});

// What the page's own policy forbade.
const violations = () => { window.violations = []; addEventListener("securitypolicyviolation", ({ violatedDirective, blockedURI }) => window.violations.push(`${violatedDirective} ${blockedURI}`)); };

// The page, loaded and ready, and all that it complained of or asked others for.
async function opened(hash = "", options = {}, script = undefined) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 1000 }, acceptDownloads: true, ...options });
  const tab = await context.newPage();
  tab.setDefaultTimeout(120_000); // a busy machine without a graphics card
  await tab.addInitScript(violations);
  if (script) await tab.addInitScript(script);
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
// Drives on until a test pauses it: what a scenario commands is over after some seconds, maybe before a busy machine looks.
const drivesFor = async (tab, seconds) => {
  await tab.keyboard.press("w");
  await until(tab, "time", ([time]) => time > seconds, `${seconds} s of a drive`);
};
const rests = (tab) => until(tab, "ahead", ([is, asked]) => Math.abs(is) < 0.01 && asked === 0, "rest");
// How many colours the scene's picture has.
async function colours(tab) {
  const data = (await tab.locator("#player canvas").screenshot()).toString("base64");
  return tab.evaluate(async (png) => {
    const image = Object.assign(new Image(), { src: `data:image/png;base64,${png}` });
    await image.decode();
    const canvas = Object.assign(document.createElement("canvas"), { width: image.width, height: image.height }), context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    return new Set(new Uint32Array(context.getImageData(0, 0, image.width, image.height).data.buffer)).size;
  }, data);
}
// The colour of a point of the scene's picture, and of its background.
async function pixel(tab, x, y) {
  const data = (await tab.locator("#player canvas").screenshot()).toString("base64");
  return tab.evaluate(async ([png, place]) => {
    const image = Object.assign(new Image(), { src: `data:image/png;base64,${png}` });
    await image.decode();
    const canvas = Object.assign(document.createElement("canvas"), { width: image.width, height: image.height }), context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    return [[...context.getImageData(...place.map(Math.round), 1, 1).data].slice(0, 3), getComputedStyle(document.getElementById("player")).backgroundColor.match(/\d+/g).map(Number)];
  }, [data, [x, y]]);
}
const drawn = (tab) => tab.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 30)))));
// Both runs have their name in the picture, beside each other, and so has the picture both colours.
async function bothInside(tab) {
  await drawn(tab);
  const [frame, ...names] = await tab.evaluate(() => [document.getElementById("player"), ...document.querySelectorAll("#player .osp-name")].map((each) => { const { left, right, top, bottom } = each.getBoundingClientRect(); return { left, right, top, bottom, text: each.textContent }; }));
  assert.deepEqual(names.map(({ text }) => text), ["traction", "independent"]);
  for (const { text, left, right, top, bottom } of names) assert.ok(left > frame.left && right < frame.right && top > frame.top && bottom < frame.bottom, `${text} is outside the picture`);
  const [one, other] = names;
  assert.ok(one.left > other.right || other.left > one.right || one.top > other.bottom || other.top > one.bottom, "names in one place");
}
const legend = (tab) => tab.locator(".osp-legend span").allTextContents();
// What the worker and the page tell each other: the page's messages can be changed, and the worker's are kept.
const spied = () => {
  window.received = [];
  window.Worker = class extends Worker {
    constructor(...sent) {
      super(...sent);
      this.addEventListener("message", ({ data }) => {
        window.received.push(data.type);
        if (data.type === "state" && window.slowly) data.slow = window.received.length % 2 === 0;
      });
    }
    postMessage(sent) { super.postMessage(window.changed?.(sent) ?? sent); }
  };
};
// A gamepad whose sticks a test moves.
const gamepad = () => {
  const pad = { connected: true, axes: [0, 0, 0, 0], buttons: [] };
  window.tilt = (axes) => { pad.axes = axes; };
  navigator.getGamepads = () => [null, pad];
};
// All texts that an element shows from now on.
const watch = (tab, id) => tab.evaluate((id_) => {
  const element = document.getElementById(id_), texts = window[`texts_${id_}`] = [];
  new MutationObserver(() => { if (texts.at(-1) !== element.textContent) texts.push(element.textContent); }).observe(element, { childList: true, characterData: true, subtree: true });
}, id);
const watched = (tab, id) => tab.evaluate((id_) => window[`texts_${id_}`], id);
const ended = (tab) => tab.waitForSelector("html[data-mode=ended]", { state: "attached", timeout: 120_000 });
const picture = async (tab, name) => { if (pictures) await tab.screenshot({ path: `${pictures}/playground-${name}.png`, fullPage: true }); };
const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2 };

test("keys drive the vehicle, and the run can be taken along as log and commands", async () => {
  const { context, tab, complaints, elsewhere } = await opened("#scenario=flat&policy=scale_torques");
  assert.deepEqual(await shown(tab, "place"), [0, 0]);
  await tab.keyboard.down("ArrowUp");
  await until(tab, "place", ([x]) => x > 0.15, "15 cm forward");
  const [, y] = await shown(tab, "place");
  assert.ok(Math.abs(y) < 0.02, `forward is forward, not ${y} m aside`);
  await tab.keyboard.up("ArrowUp");
  await rests(tab);
  await tab.keyboard.down("a");
  await until(tab, "place", ([, side]) => side > 0.1, "10 cm to the left");
  await tab.keyboard.up("a");
  await tab.locator("#run", { hasText: "Pause" }).click();
  await tab.locator("#commands pre", { hasText: "drive.csv" }).waitFor();
  await tab.locator("#outcome", { hasText: "completed" }).waitFor();
  const files = {};
  tab.on("download", async (download) => { files[download.suggestedFilename()] = await readFile(await download.path()); });
  await watch(tab, "writing");
  await tab.getByRole("button", { name: "Download the log (MCAP)" }).click();
  await tab.locator("#writing", { hasText: "has" }).waitFor({ timeout: 120_000 });
  // A screen reader hears of its start and its end, and of nothing between them.
  assert.deepEqual((await watched(tab, "writing")).map((sent) => sent.replace(/[\d.]+ MB/, "? MB")), ["Simulating the run again for its log.", "flat-scale_torques.mcap has ? MB."]);
  assert.ok(await tab.locator("#part").isHidden());
  while (Object.keys(files).length < 2) await tab.waitForTimeout(20);
  assert.deepEqual(Object.keys(files).sort(), ["drive.csv", "flat-scale_torques.mcap"]);
  assert.match(String(files["drive.csv"]), /^time_s,vx_m_s,vy_m_s,wz_rad_s\n/);
  const reader = new McapStreamReader({ validateCrcs: true });
  reader.append(files["flat-scale_torques.mcap"]);
  let last = 0n;
  for (let record; (record = reader.nextRecord());) if (record.type === "Message") last = record.logTime;
  const [time] = await shown(tab, "time");
  // The page shows hundredths of a second.
  assert.ok(Math.abs(Number(last) * 1e-9 - time) <= 0.0051, `a log until ${last} ns of a run of ${time} s`);
  assert.deepEqual([complaints, elsewhere], [[], []]);
  await context.close();
});

test("it opens with README's experiment, which runs by itself: plain PID stalls, traction control climbs, both in the picture", async () => {
  const { context, tab, complaints, elsewhere } = await opened("", { colorScheme: "light" });
  assert.match(await tab.locator("#commands pre").first().textContent(), /^omnistep run hard_step .*--policy traction .*--set physics\.engine=articulated$/s);
  assert.match(await tab.locator("#lead").textContent(), /With plain PID \(independent\) the wheels slip and the vehicle stalls; with traction control \(traction\) it climbs\.$/);
  assert.equal(await tab.locator("#examples [aria-current]").textContent(), "Plain PID stalls, traction control climbs");
  await bothInside(tab);
  await until(tab, "time", ([time]) => time > 4, "four seconds");
  await bothInside(tab);
  await until(tab, "time", ([time]) => time > 2, "two seconds");
  // Ground, two vehicles, wheels and arrows: an empty picture has one colour, the ground alone some hundred.
  assert.ok(await colours(tab) > 1000, "the scene is drawn");
  assert.deepEqual(await legend(tab), ["traction", "independent", "wheel slip", "ground force"]);
  await picture(tab, "light");
  await tab.locator("#theme").click();
  await until(tab, "time", ([time]) => time > 2.5, "half a second more");
  await picture(tab, "dark");
  await ended(tab);
  await bothInside(tab);
  assert.equal(await tab.locator("#status").textContent(), "The run has ended: traction climbed, independent stalled.");
  assert.deepEqual(await tab.locator("#outcome thead th").allTextContents(), ["metric", "traction", "independent"]);
  // The last state is drawn in the frame after.
  await until(tab, "time", ([time]) => time === 6, "the end of the scenario");
  // The names and the choice of the command's table: where a climb ends says nothing.
  const titles = await tab.locator("#outcome tbody th").allTextContents();
  assert.deepEqual(titles.slice(0, 4), ["verdict", "stalled at x [m]", "stalled row", "crossing time [s]"]);
  assert.ok(!titles.some((title) => /final/.test(title)), String(titles));
  assert.deepEqual(await tab.locator("#meanings dt").allTextContents(), titles.slice(1));
  const work = numbers(await tab.locator("#outcome tr", { hasText: "work [J]" }).textContent());
  assert.ok(work.length === 2 && work[0] !== work[1], `two runs, two metrics: ${work}`);
  assert.equal(await tab.locator("#wheels tbody tr").count(), 7);
  // Every bar of it is a number to a screen reader, and slip is one in every view.
  const meters = await tab.locator("#wheels [role=meter]").evaluateAll((all) => all.map((each) => ["aria-label", "aria-valuenow", "aria-valuemin", "aria-valuemax"].map((name) => each.getAttribute(name))));
  assert.equal(meters.length, 7 * 3 * 2);
  assert.equal(new Set(meters.map(([label]) => label)).size, meters.length);
  assert.equal(meters[0][0], "Torque of wheel 1, traction");
  for (const [label, now, low, high] of meters) assert.ok(Number(now) >= Number(low) && Number(now) <= Number(high), `${label}: ${now}`);
  assert.ok(meters.some(([label, now]) => /^Load/.test(label) && Number(now) > 0.1), "loads are shown");
  const slips = await tab.locator("#wheels .numbered span").allTextContents();
  assert.ok(slips.length === 14 && slips.every((slip) => /^-?\d\.\d\d$/.test(slip)), String(slips));
  assert.deepEqual([complaints, elsewhere], [[], []]);
  await context.close();
});

test("the address holds the settings, and a wrong one is a line", async () => {
  const { context, tab, complaints } = await opened("#scenario=step&policy=traction_runup&against=scale_torques&torque=1.5&height=0.03");
  await tab.locator("#friction").fill("0.5");
  await tab.locator("#friction").press("Enter");
  await tab.waitForURL(/friction=0\.5/);
  const chosen = () => tab.evaluate(() => Object.fromEntries([...document.querySelectorAll("#fields :is(input, select)")].map(({ id, value }) => [id, value])));
  const before = await chosen();
  assert.deepEqual(before, { scenario: "step", vehicle: "", policy: "traction_runup", against: "scale_torques", torque: "1.5", friction: "0.5", height: "0.03", engine: "articulated", model: "ball" });
  await tab.reload();
  await tab.waitForSelector("html[data-ready=true]", { state: "attached" });
  assert.deepEqual(await chosen(), before);
  assert.match(await tab.locator("#commands pre").first().textContent(), /omnistep run step .*--policy traction_runup .*--set terrain\.height_m=0\.03/s);
  await tab.goto(`${page}#scenario=moon`);
  await tab.locator("#said", { hasText: 'scenario: "moon", allowed: step, hard_step, flat' }).waitFor();
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
  assert.match(await tab.locator("#said").textContent(), /^scenario: "nosuch", allowed: step, hard_step, flat, .*figure_eight$/);
  await context.close();
});

test("what a field must not have is said below it, and no outcome of an earlier run stays", async () => {
  const { context, tab, complaints } = await opened("#scenario=step&policy=scale_torques");
  await drivesFor(tab, 0.2);
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

test("wheels are rollers where balls are not a valid model of them, unless balls are chosen, and then a line says so", async () => {
  const { context, tab, complaints } = await opened("#scenario=step&vehicle=mecanum4&policy=scale_torques");
  assert.equal(await tab.locator("#model").inputValue(), "rollers");
  assert.match(await tab.locator("#model-note").textContent(), /^The wheel model is rollers, because balls are not a valid model/);
  await tab.locator("#scenario").selectOption("flat");
  await tab.locator("html[data-mode=ready]").waitFor({ state: "attached" });
  await until(tab, "time", ([time]) => time === 0, "the start");
  assert.equal(await tab.locator("#model").inputValue(), "ball");
  await tab.goto(`${page}#scenario=step&vehicle=mecanum4&policy=scale_torques&wheels=ball`);
  await tab.locator("#model-note", { hasText: "Balls are not a valid model of this vehicle's wheels on this ground." }).waitFor();
  await picture(tab, "invalid-balls");
  assert.deepEqual(complaints, []);
  await context.close();
});

test("on a phone the buttons drive, and nothing is beyond the screen", async () => {
  const { context, tab, complaints, elsewhere } = await opened("#scenario=bumps&vehicle=mecanum4&policy=scale_torques", { ...PHONE, colorScheme: "light" });
  const button = tab.getByRole("button", { name: "Forward" });
  await button.scrollIntoViewIfNeeded();
  const { x, y, width, height } = await button.boundingBox();
  const touch = await context.newCDPSession(tab);
  await touch.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: [{ x: x + width / 2, y: y + height / 2 }] });
  await until(tab, "place", ([ahead]) => ahead > 0.1, "10 cm forward");
  await touch.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  await rests(tab);
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

test("the page's policy forbids what the page does not do, and nothing that it does", async () => {
  const { context, tab, complaints } = await opened("#scenario=ice&policy=scale_torques");
  assert.deepEqual(await tab.evaluate(() => window.violations), []);
  // It has a picture for a shared link, which is there, and an icon that is not loaded.
  const preview = await tab.locator('meta[property="og:image"]').getAttribute("content");
  assert.equal((await context.request.get(page + preview)).status(), 200);
  assert.match(await tab.locator("link[rel=icon]").getAttribute("href"), /^data:image\/svg\+xml,/);
  // What is tinted there has its name.
  assert.ok((await legend(tab)).includes("friction 0.05"), String(await legend(tab)));
  await tab.evaluate(async () => {
    document.head.append(Object.assign(document.createElement("script"), { textContent: "window.inserted = true" }));
    await fetch("https://example.org/").catch(() => {});
  });
  assert.deepEqual(await tab.evaluate(() => [window.inserted, window.violations.map((each) => each.split(" ")[0])]), [undefined, ["script-src-elem", "connect-src"]]);
  assert.equal(complaints.length > 0, true);
  // Alone it has no site to link to: its links are settings.
  assert.deepEqual(await tab.locator("a").evaluateAll((all) => all.map((link) => link.getAttribute("href")).filter((href) => !href.startsWith("#"))), []);
  await context.close();
});

test("without a clipboard the command is selected", async () => {
  const { context, tab, complaints } = await opened("#scenario=flat&policy=scale_torques", {}, () => Object.defineProperty(Navigator.prototype, "clipboard", { get: () => undefined }));
  await tab.getByRole("button", { name: "Copy the command" }).click();
  await tab.locator("#writing", { hasText: "the command is selected" }).waitFor();
  assert.match(await tab.evaluate(() => String(getSelection())), /^omnistep run flat .*--policy scale_torques/s);
  assert.deepEqual(complaints, []);
  await context.close();
});

test("a log that is refused leaves the run as it is, and another run ends the log of the one before", async () => {
  const { context, tab, complaints } = await opened("#scenario=flat&policy=scale_torques", {}, spied);
  await drivesFor(tab, 0.2);
  await tab.locator("#run", { hasText: "Pause" }).click();
  await tab.locator("#outcome").waitFor();
  await tab.evaluate(() => { window.changed = (sent) => (sent.type === "log" ? { ...sent, which: 9 } : sent); });
  const download = tab.getByRole("button", { name: "Download the log (MCAP)" });
  await download.click();
  await tab.locator("#writing", { hasText: "There is no log: there is no run to log" }).waitFor();
  const now = () => tab.evaluate(() => ({ mode: document.documentElement.dataset.mode, said: document.getElementById("said").textContent, outcome: document.getElementById("outcome").checkVisibility(), bar: document.getElementById("part").hidden }));
  assert.deepEqual(await now(), { mode: "paused", said: "", outcome: true, bar: true });
  assert.ok(await download.isEnabled() && await tab.locator("#run").isEnabled());
  // A log of 24 s with the slow engine: it would go on for long.
  await tab.evaluate(() => { window.changed = undefined; });
  await tab.goto(`${page}#scenario=figure_eight&policy=scale_torques&engine=rapier`);
  await tab.locator("#commands pre", { hasText: "figure_eight" }).waitFor();
  await download.click();
  await tab.waitForFunction(() => window.received.includes("writing"));
  await tab.goto(`${page}#scenario=flat&policy=scale_torques`);
  await tab.locator("#commands pre", { hasText: "flat" }).waitFor();
  await tab.evaluate(() => { window.received = []; });
  await tab.waitForTimeout(500);
  assert.deepEqual(await tab.evaluate(() => window.received.filter((type) => ["writing", "log"].includes(type))), []);
  assert.equal(await tab.locator("#writing").textContent(), "");
  // That of a new run is whole.
  await tab.locator("#run").click();
  await until(tab, "time", ([time]) => time > 0.2, "a fifth of a second");
  const [file] = await Promise.all([tab.waitForEvent("download"), download.click()]);
  assert.equal(file.suggestedFilename(), "flat-scale_torques.mcap");
  const reader = new McapStreamReader({ validateCrcs: true });
  reader.append(await readFile(await file.path()));
  while (reader.nextRecord());
  assert.ok(reader.done());
  assert.deepEqual(complaints, []);
  await context.close();
});

test("a machine that is too slow is announced once", async () => {
  const { context, tab } = await opened("#scenario=flat&policy=scale_torques", {}, spied);
  await tab.evaluate(() => { window.slowly = true; });
  await watch(tab, "status");
  await drivesFor(tab, 1);
  await tab.locator("#run", { hasText: "Pause" }).click();
  await tab.locator("#status", { hasText: "Paused." }).waitFor();
  assert.deepEqual(await watched(tab, "status"), ["You drive.", "This machine is too slow: it simulates slower than real time.", "Paused."]);
  await context.close();
});

test("keys drive on after a choice by pointer, and Space stops whatever has the focus", async () => {
  const { context, tab, complaints } = await opened("#scenario=flat&policy=scale_torques");
  const focus = () => tab.evaluate(() => document.activeElement.id || document.activeElement.tagName);
  await tab.locator("#policy").dispatchEvent("pointerdown");
  await tab.locator("#policy").focus();
  await tab.locator("#policy").selectOption("traction");
  await tab.locator("html[data-mode=ready]").waitFor({ state: "attached" });
  assert.equal(await focus(), "BODY");
  await tab.keyboard.down("w");
  await until(tab, "place", ([x]) => x > 0.1, "10 cm forward");
  assert.equal(await tab.locator("#policy").inputValue(), "traction");
  await tab.keyboard.up("w");
  await rests(tab);
  // Who chooses by keyboard stays in the field.
  await tab.locator("#policy").focus();
  await tab.keyboard.press("ArrowUp");
  await tab.locator("html[data-mode=ready]").waitFor({ state: "attached" });
  assert.notEqual(await tab.locator("#policy").inputValue(), "traction");
  assert.equal(await focus(), "policy");
  // Something drives while something else has the focus.
  const button = tab.getByRole("button", { name: "Forward" });
  for (const id of ["policy", "theme", "reset", "torque"]) {
    const { x, y, width, height } = await button.boundingBox();
    await tab.mouse.move(x + width / 2, y + height / 2);
    await tab.mouse.down();
    await until(tab, "ahead", ([, asked]) => asked > 0, "driving");
    await tab.locator(`#${id}`).focus();
    const before = await tab.evaluate(() => [document.documentElement.dataset.theme, document.getElementById("policy").value]);
    await tab.keyboard.press("Space");
    await rests(tab);
    assert.deepEqual(await tab.evaluate(() => [document.documentElement.dataset.theme, document.getElementById("policy").value]), before, id);
    assert.ok((await shown(tab, "time"))[0] > 0, `${id}: Space presses nothing`);
    await tab.mouse.up();
  }
  // Enter does.
  const { theme } = await tab.evaluate(() => ({ ...document.documentElement.dataset }));
  await tab.locator("#theme").focus();
  await tab.keyboard.press("Enter");
  assert.notEqual(await tab.evaluate(() => document.documentElement.dataset.theme), theme);
  assert.deepEqual(complaints, []);
  await context.close();
});

test("a long press on a button drives on, and a menu elsewhere lets go", async () => {
  const { context, tab } = await opened("#scenario=flat&policy=scale_torques");
  const button = tab.getByRole("button", { name: "Forward" }), { x, y, width, height } = await button.boundingBox();
  await tab.mouse.move(x + width / 2, y + height / 2);
  await tab.mouse.down();
  await until(tab, "ahead", ([, asked]) => asked > 0, "driving");
  const menu = (selector) => tab.locator(selector).evaluate((element) => element.dispatchEvent(new MouseEvent("contextmenu", { bubbles: true, cancelable: true })));
  assert.equal(await menu("#pad button[aria-label=Forward]"), false, "no menu opens");
  const [from] = await shown(tab, "place");
  await until(tab, "place", ([at]) => at > from + 0.1, "10 cm more");
  assert.equal(await menu("#until"), true);
  await rests(tab);
  assert.equal(await button.getAttribute("aria-pressed"), null);
  await tab.mouse.up();
  await context.close();
});

test("a gamepad drives, and after a stop only when its stick was back in the middle", async () => {
  const { context, tab, complaints } = await opened("#scenario=flat&policy=scale_torques", {}, gamepad);
  const tilt = (...axes) => tab.evaluate((to) => window.tilt(to), axes);
  await tilt(0.1, -0.1, 0.1, 0); // a stick at rest is not exactly in the middle
  await tab.waitForTimeout(300);
  assert.deepEqual(await shown(tab, "time"), [0]);
  await tilt(0, -1, 0, 0);
  await until(tab, "place", ([x]) => x > 0.1, "10 cm forward");
  assert.ok(Math.abs((await shown(tab, "place"))[1]) < 0.02, "forward is forward");
  const [, full] = await shown(tab, "ahead");
  await tilt(0, -0.5, 0, 0);
  await until(tab, "ahead", ([, asked]) => Math.abs(asked - full / 2) < 0.011, "half as fast");
  await tilt(0, 0, 0, 0);
  await rests(tab);
  const [, y] = await shown(tab, "place");
  await tilt(-1, 0, 0, 0);
  await until(tab, "place", ([, side]) => side > y + 0.1, "10 cm to the left");
  await tilt(0, -1, 0, 0);
  await until(tab, "ahead", ([, asked]) => asked > 0, "driving");
  await tab.locator("#stop").click();
  await rests(tab);
  await tab.waitForTimeout(300);
  assert.equal((await shown(tab, "ahead"))[1], 0, "the stick is still held");
  await tilt(0, 0, 0, 0);
  await tab.waitForTimeout(200);
  await tilt(0, -1, 0, 0);
  await until(tab, "ahead", ([, asked]) => asked > 0, "driving again");
  assert.deepEqual(complaints, []);
  await context.close();
});

test("there is ground below a wheel in each of the four views, on every ground, with both engines", async () => {
  const { context, tab, complaints } = await opened("#scenario=flat", { viewport: { width: 700, height: 600 }, colorScheme: "dark" });
  const scenarios = await tab.locator("#scenario option").evaluateAll((all) => all.map(({ value }) => value));
  assert.ok(scenarios.length > 10, String(scenarios));
  for (const scenario of scenarios) for (const engine of ["articulated", "rapier"]) {
    await tab.goto(`${page}#scenario=${scenario}&engine=${engine}`);
    await tab.locator("#commands pre", { hasText: new RegExp(`run ${scenario} .*engine=${engine}`, "s") }).waitFor();
    for (const view of ["Orbit", "Side", "Plan", "Follow"]) {
      await tab.locator(".osp-views button", { hasText: view }).click();
      await drawn(tab);
      // The wheel farthest to the right: legend and buttons are at the left. Its label's line begins in its middle.
      const [x, y, tall] = await tab.evaluate(() => {
        const lines = [...document.querySelectorAll("#player svg line")].filter((line) => line.style.visibility !== "hidden").map((line) => [line.x1.baseVal.value, line.y1.baseVal.value]);
        return [...lines.sort((a, b) => b[0] - a[0])[0], document.getElementById("player").clientHeight];
      });
      const [colour, background] = await pixel(tab, x, (y + tall) / 2);
      assert.ok(colour.some((part, k) => Math.abs(part - background[k]) > 5), `${scenario}, ${engine}, ${view}: ${colour} below the wheel at ${x}, ${y}`);
    }
  }
  assert.deepEqual(complaints, []);
  await context.close();
});

test("Run, two sentences and the picture are in the first view of a window, a phone and a phone on its side", async () => {
  for (const [width, height] of [[1280, 800], [390, 844], [844, 390]]) {
    const phone = width < 1000 ? { ...PHONE, viewport: { width, height } } : {};
    const { context, tab } = await opened("#scenario=step&policy=traction", { viewport: { width, height }, ...phone });
    const box = (id) => tab.locator(`#${id}`).boundingBox();
    const run = await box("run"), lead = await box("lead"), player = await box("player");
    for (const [name, each] of Object.entries({ run, lead })) assert.ok(each.y >= 0 && each.y + each.height <= height && each.x >= 0 && each.x + each.width <= width, `${name} at ${width} x ${height}: ${JSON.stringify(each)}`);
    assert.ok(height - player.y > 150, `${height - player.y} pixels of the picture at ${width} x ${height}`);
    assert.equal((await tab.locator("#lead").textContent()).match(/\.( |$)/g).length, 2);
    assert.equal(await tab.locator("#run").textContent(), "Run");
    assert.ok(await tab.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
    await picture(tab, `${width}x${height}`);
    await context.close();
  }
});

test("who wants no motion presses Run, and each of four links runs its example", async () => {
  const { context, tab, complaints, elsewhere } = await opened("", { reducedMotion: "reduce", viewport: { width: 700, height: 600 } });
  assert.equal(await tab.evaluate(() => document.documentElement.dataset.mode), "ready");
  const links = await tab.locator("#examples a").allTextContents(), leads = new Set();
  assert.equal(links.length, 4);
  for (const name of links) {
    await tab.locator("#examples a", { hasText: name }).click();
    await tab.locator("#examples [aria-current]", { hasText: name }).waitFor();
    await tab.locator("#run", { hasText: /Pause|Run again/ }).waitFor();
    leads.add(await tab.locator("#lead").textContent());
    assert.equal(await tab.locator("#said").textContent(), "");
  }
  assert.equal(leads.size, 4);
  assert.ok([...leads].every((lead) => lead.match(/\.( |$)/g).length === 2), [...leads].join("\n"));
  // The one that is there runs again when it is chosen again.
  await tab.locator("#reset").click();
  await tab.locator("html[data-mode=ready]").waitFor({ state: "attached" });
  await tab.locator("#examples [aria-current]").click();
  await tab.locator("#run", { hasText: /Pause|Run again/ }).waitFor();
  assert.deepEqual([complaints, elsewhere], [[], []]);
  await context.close();
});

test("arrow keys drive after a drag on the picture, with Shift they turn it; R resets, the full stop steps", async () => {
  const { context, tab, complaints } = await opened("#scenario=flat&policy=scale_torques", { viewport: { width: 700, height: 600 } });
  const { x, y, width, height } = await tab.locator("#player canvas").boundingBox();
  await tab.mouse.move(x + width / 2, y + height / 2);
  await tab.mouse.down();
  await tab.mouse.move(x + width / 2 + 60, y + height / 2, { steps: 4 });
  await tab.mouse.up();
  assert.equal(await tab.evaluate(() => document.activeElement.tagName), "CANVAS");
  await drawn(tab);
  const wheels = () => tab.locator("#player svg line").evaluateAll((all) => all.map((line) => line.x1.baseVal.value));
  const before = await wheels();
  await tab.keyboard.press("Shift+ArrowLeft");
  await drawn(tab);
  assert.notDeepEqual(await wheels(), before, "the view has turned");
  assert.deepEqual(await shown(tab, "time"), [0], "and nothing drives");
  await tab.keyboard.press(".");
  await until(tab, "time", ([time]) => time === 0.01, "a step of 10 ms");
  await tab.locator("#step").click();
  await until(tab, "time", ([time]) => time === 0.02, "another one");
  assert.equal(await tab.evaluate(() => document.documentElement.dataset.mode), "paused");
  await tab.locator("#player canvas").focus();
  await tab.keyboard.down("ArrowUp");
  await until(tab, "place", ([at]) => at > 0.1, "10 cm forward");
  await tab.keyboard.up("ArrowUp");
  await tab.keyboard.press("r");
  await until(tab, "time", ([time]) => time === 0, "the start");
  assert.deepEqual(await shown(tab, "place"), [0, 0]);
  assert.equal(await tab.evaluate(() => document.documentElement.dataset.mode), "ready");
  assert.deepEqual(complaints, []);
  await context.close();
});

test("a machine that draws slowly says so", async () => {
  const slowly = () => { window.requestAnimationFrame = (call) => setTimeout(() => call(performance.now()), 250); };
  const { context, tab } = await opened("#scenario=flat&policy=scale_torques", { viewport: { width: 400, height: 400 } }, slowly);
  assert.equal(await tab.locator("#drawing").textContent(), "");
  await watch(tab, "status");
  await tab.locator("#run").click();
  await tab.locator("#drawing", { hasText: /^This machine draws slowly, [1-4] pictures? a second\./ }).waitFor();
  assert.equal((await watched(tab, "status"))[0], "The command of the scenario drives.");
  await context.close();
});

test("a vehicle or a scenario can be opened or dropped as a file, and what is wrong with it is a line", async () => {
  const { context, tab, complaints, elsewhere } = await opened("#scenario=step&policy=scale_torques", { viewport: { width: 700, height: 600 } });
  const assets = new URL("../../crates/omni-config/assets/", import.meta.url), toml = (text) => Buffer.from(text);
  const file = (name, buffer) => tab.locator("#own").setInputFiles({ name, mimeType: "application/toml", buffer });
  const vehicle = String(await readFile(new URL("vehicles/omni3.toml", assets)));
  await file("my_robot.toml", toml(vehicle));
  await tab.locator("#commands pre", { hasText: "vehicle=my_robot.toml" }).waitFor();
  await until(tab, "time", ([time]) => time === 0, "the start");
  assert.match(await tab.locator("#commands pre").textContent(), /^omnistep run step .*--policy scale_torques .*--set vehicle=my_robot\.toml$/s);
  assert.equal(await tab.locator("#wheels tbody tr").count(), 3);
  assert.ok(await tab.locator("#vehicle").isDisabled());
  await tab.keyboard.down("w");
  await until(tab, "place", ([x]) => x > 0.05, "5 cm forward");
  await tab.keyboard.up("w");
  // By dropping.
  const scenario = String(await readFile(new URL("scenarios/hard_step.toml", assets)));
  await tab.evaluate((text) => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([text], "my_step.toml"));
    document.body.dispatchEvent(new DragEvent("drop", { bubbles: true, cancelable: true, dataTransfer }));
  }, scenario);
  await tab.locator("#commands pre", { hasText: "my_step.toml" }).waitFor();
  assert.match(await tab.locator("#commands pre").textContent(), /^omnistep run my_step\.toml [\\\n ]*--policy traction [\\\n ]*--set physics\.engine=articulated$/);
  assert.deepEqual(await tab.evaluate(() => ["torque", "friction", "height"].map((id) => document.getElementById(id).placeholder)), ["1.4", "0.55", "0.05"]);
  await file("bad.toml", toml("terrain = {\n"));
  await tab.locator("#said", { hasText: /^bad\.toml: line \d+: / }).waitFor();
  await file("short.toml", toml(scenario.replace(/\[command\][^[]*/, "")));
  await tab.locator("#said", { hasText: "short.toml: missing field `command`" }).waitFor();
  await file("wrong.toml", toml(`nosuch = 1\n${vehicle}`));
  await tab.locator("#said", { hasText: "wrong.toml: nosuch: unknown field" }).waitFor();
  await tab.getByRole("button", { name: "Remove the file" }).click();
  await tab.locator("#commands pre", { hasText: "omnistep run step" }).waitFor();
  assert.ok(await tab.locator("#vehicle").isEnabled() && await tab.locator("#own-name").isHidden());
  assert.deepEqual([complaints, elsewhere], [[], []]);
  await context.close();
});
