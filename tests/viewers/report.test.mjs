// A report in headless Chromium: node --test report.test.mjs, with REPORT=page.html (several policies over the step), MIXED=page.html (several
// vehicles and grounds), VEHICLES=page.html (chugo7 and mecanum4), PATHS=page.html (two paths, one of them with two policies) and CHROMIUM=/usr/bin/chromium. PICTURES=folder keeps screenshots.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { launched } from "./browser.mjs";

const page = pathToFileURL(process.env.REPORT).href, mixed = pathToFileURL(process.env.MIXED).href, vehicles = pathToFileURL(process.env.VEHICLES).href;
const paths = pathToFileURL(process.env.PATHS).href;
const pictures = process.env.PICTURES;
let browser;

before(async () => {
  browser = await launched();
});
after(() => browser?.close());

/** Runs of the largest page: those that a page lacks are left out. */
const ALL = "1.2.3.4.5.6";
// The page, loaded from its start with all runs, and all that it complained of or asked the network for.
async function opened(options = {}, { url = page, script } = {}) {
  const context = await browser.newContext({ viewport: { width: 1200, height: 1000 }, ...options });
  const tab = await context.newPage();
  tab.setDefaultTimeout(120_000); // a busy machine without a graphics card
  if (script) await tab.addInitScript(script);
  const complaints = [], requests = [];
  tab.on("console", (message) => { if (message.type() === "error") complaints.push(message.text()); });
  tab.on("pageerror", (error) => complaints.push(String(error)));
  tab.on("request", (request) => { if (!/^(file|data|blob):/.test(request.url())) requests.push(request.url()); });
  await tab.goto(url.includes("#") ? url : `${url}#t=0&runs=${ALL}`);
  await tab.waitForSelector("html[data-ready=true]", { state: "attached", timeout: 120_000 });
  await settled(tab);
  return { context, tab, complaints, requests };
}
const settled = (tab) => tab.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 400)))));

// What the page shows: the cursor's place in the plots as a part of their time axis, the first run's base in the scene, the clock.
const shown = (tab) => tab.evaluate(() => {
  const plots = document.getElementById("plots"), cursor = plots.querySelector(".cursor"), axis = plots._fullLayout.xaxis;
  const [lead] = document.getElementById("scene").player.states.filter(Boolean);
  return {
    cursor: axis.p2l(Number(/translateX\(([-\d.]+)px\)/.exec(cursor.style.transform)[1]) - axis._offset),
    across: [plots._fullLayout._size.h, cursor.offsetHeight],
    base: lead?.poses[0].slice(0, 3),
    runs: document.getElementById("scene").player.states.filter(Boolean).length,
    clock: document.getElementById("clock").textContent,
    panels: new Set(plots.data.map((trace) => trace.yaxis)).size,
    theme: document.documentElement.dataset.theme,
  };
});
const near = (value, wanted, by, what) => assert.ok(Math.abs(value - wanted) <= by, `${what}: ${value}, not ${wanted}`);
// How many colours the scene's picture has.
async function colours(tab) {
  const data = (await tab.locator("#scene canvas").screenshot()).toString("base64");
  return tab.evaluate(async (png) => {
    const image = Object.assign(new Image(), { src: `data:image/png;base64,${png}` }); // the page may not fetch
    await image.decode();
    const canvas = Object.assign(document.createElement("canvas"), { width: image.width, height: image.height }), context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    return new Set(new Uint32Array(context.getImageData(0, 0, image.width, image.height).data.buffer)).size;
  }, data);
}
const seek = async (tab, seconds) => {
  await tab.locator("#time").fill(String(seconds));
  await tab.evaluate(() => document.activeElement.blur());
  await settled(tab);
};
const fits = async (tab, width) => {
  const [wide, table, room] = await tab.evaluate(() => [document.documentElement.scrollWidth, document.querySelector("table").offsetWidth, document.querySelector(".wide").clientWidth]);
  assert.ok(wide <= width, `the page is ${wide} px wide on a screen of ${width}`);
  assert.ok(table <= room, `the table is ${table} px wide in ${room}`);
};

test("it loads without a complaint and without the network, and the cursor moves the scene and every plot", async () => {
  const { context, tab, complaints, requests } = await opened();
  const start = await shown(tab);
  assert.equal(start.panels, 5);
  near(start.cursor, 0, 0.01, "the cursor [s]"); // a pixel is 5 ms
  near(start.across[1], start.across[0], 1, "the cursor's height [px]"); // across all panels
  // Ground, bodies, wheels and arrows: an empty picture has one colour, the ground alone some hundred.
  assert.ok(await colours(tab) > 1000, "the scene is drawn");
  await seek(tab, 2.5);
  const later = await shown(tab);
  near(later.cursor, 2.5, 0.01, "the cursor [s]");
  assert.equal(later.clock, "2.50 s");
  assert.ok(later.base[0] - start.base[0] > 0.4 && later.base[2] - start.base[2] > 0.01, `the vehicle has gone ahead and up: ${JSON.stringify([start, later])}`);
  await fits(tab, 1200);
  if (pictures) {
    await tab.setViewportSize({ width: 1200, height: 1500 });
    await settled(tab);
    await tab.screenshot({ path: `${pictures}/report-light.png` });
  }
  assert.deepEqual(complaints, []);
  assert.deepEqual(requests, []);
  await context.close();
});

test("it opens at the step with two runs that end otherwise", async () => {
  const { context, tab, complaints } = await opened({}, { url: `${page}#` });
  const names = await tab.locator("#runs label").allTextContents(), verdicts = (await tab.locator("tr.verdict td").allTextContents());
  const chosen = await tab.locator("#runs input").evaluateAll((all) => all.flatMap((box, k) => (box.checked ? [k] : [])));
  assert.ok(names.length > 2 && chosen.length === 2 && chosen[0] === 0);
  assert.ok(verdicts[chosen[1]] !== verdicts[0] || new Set(verdicts).size === 1, verdicts.join());
  // On the step of 5 cm, the first of the two is half way up.
  const heights = await tab.evaluate(() => document.getElementById("scene").player.states.filter(Boolean).map(({ poses }) => poses[0]));
  const up = Math.max(...heights.map(([, , z]) => z)); // the base is on the ground at first
  assert.ok(up > 0.015 && up < 0.035, `${up} m up`);
  assert.ok((await shown(tab)).cursor > 0.5);
  // The button says what it brings.
  assert.equal(await tab.locator("#theme").textContent(), "Dark");
  await tab.locator("#theme").click();
  assert.equal(await tab.locator("#theme").textContent(), "Light");
  assert.deepEqual(complaints, []);
  await context.close();
});

test("title, legend and table name every policy, and reference and limits are in the legend", async () => {
  const { context, tab } = await opened();
  const names = await tab.locator("#runs label").allTextContents(), title = await tab.title();
  assert.ok(names.length >= 4);
  for (const name of names) assert.ok(title.includes(name) && /^step with chugo7: /.test(title), title);
  assert.deepEqual((await tab.locator("thead th").allTextContents()).slice(1), names);
  assert.deepEqual(await tab.locator("#legend .entry").allTextContents(), [...names, "reference speed", "torque limits"]);
  // One wheel: a line a run, its reference, and its two limits; colours tell the runs apart.
  const traces = await tab.evaluate(() => document.getElementById("plots").data.map(({ name, line }) => [name, line.color]));
  assert.equal(traces.length, names.length * (2 + 3 + 1 + 1 + 1));
  assert.equal(new Set(traces.map(([, colour]) => colour)).size, names.length);
  await context.close();
});

test("seven wheels have seven colours and seven labels in the scene, and a selector for the plots", async () => {
  const { context, tab } = await opened();
  const labels = await tab.locator("#scene .osp-label").evaluateAll((all) => all.map((label) => [label.textContent, getComputedStyle(label).borderColor, label.style.visibility]));
  assert.deepEqual(labels.map(([text]) => text), [..."1234567"]);
  assert.equal(new Set(labels.map(([, colour]) => colour)).size, 7);
  assert.ok(labels.every(([, , visibility]) => visibility === ""), "all of them are in sight");
  const lines = () => tab.evaluate(() => new Set(document.getElementById("plots").data.filter(({ line }) => line.dash !== "longdash").map(({ line }) => line.color)).size);
  await tab.locator("#wheels button", { hasText: "All" }).click();
  await settled(tab);
  assert.equal(await lines(), 7); // a colour a wheel
  // By keyboard: the same boxes, and the same place.
  const boxes = tab.locator("#wheels input"), first = await boxes.first().elementHandle();
  await boxes.nth(2).uncheck();
  await tab.locator("#wheels button", { hasText: "All" }).focus();
  await tab.keyboard.press("Enter");
  await settled(tab);
  assert.equal(await tab.locator("#wheels input:checked").count(), 7);
  assert.equal(await tab.evaluate(() => document.activeElement.textContent), "All");
  await boxes.nth(3).focus();
  await tab.locator("#runs input").nth(1).evaluate((box) => box.click());
  await settled(tab);
  assert.ok(await first.evaluate((box) => box.isConnected), "other runs of the same vehicle have the same boxes");
  assert.equal(await tab.evaluate(() => document.activeElement.value), "4");
  for (const view of ["Side", "Plan", "Follow", "Orbit"]) {
    await tab.locator(".osp-views button", { hasText: view }).click();
    await settled(tab);
    assert.ok(await colours(tab) > 300, `${view} is drawn`);
    assert.equal(await tab.locator(".osp-views button[aria-pressed=true]").textContent(), view);
  }
  await context.close();
});

test("keys move the cursor and start and stop the run where the time and the scene have the focus", async () => {
  const { context, tab, complaints } = await opened();
  const clock = async () => { await settled(tab); return (await shown(tab)).clock; };
  for (const selector of ["#time", "#play", "#scene canvas", ".osp-views button"]) {
    await tab.locator(selector).first().focus();
    if (selector !== "#scene canvas") { // in the scene arrows turn the view
      for (let k = 0; k < 5; k += 1) await tab.keyboard.press("ArrowRight");
      assert.equal(await clock(), "0.10 s", selector);
      for (let k = 0; k < 5; k += 1) await tab.keyboard.press("ArrowLeft");
    } else await tab.keyboard.press("ArrowRight");
    assert.equal(await clock(), "0.00 s", selector);
    await tab.keyboard.press("PageDown");
    assert.equal(await clock(), "0.50 s", selector);
    await tab.keyboard.press("End");
    assert.notEqual(await clock(), "0.50 s", selector);
    await tab.keyboard.press("Home");
    assert.equal(await clock(), "0.00 s", selector);
  }
  for (const selector of ["#time", "#play", "#scene canvas"]) {
    await tab.locator(selector).focus();
    await tab.keyboard.press("Home");
    await tab.keyboard.press("Space");
    await tab.waitForFunction(() => parseFloat(document.getElementById("clock").textContent) > 0.3, null, { timeout: 60_000 });
    assert.equal(await tab.locator("#play").textContent(), "Pause");
    await tab.keyboard.press("Space");
    assert.equal(await tab.locator("#play").textContent(), "Play");
  }
  // Its text says what it does: a state besides would say the opposite.
  assert.equal(await tab.locator("#play").getAttribute("aria-pressed"), null);
  // Not every frame is announced; the slider says where it is.
  assert.equal(await tab.locator("output, [aria-live]:not([aria-live=off]), #clock[role]").count(), 0);
  assert.match(await tab.locator("#time").getAttribute("aria-valuetext"), /^\d\.\d\d seconds$/);
  assert.deepEqual(complaints, []);
  await context.close();
});

test("elsewhere keys scroll the page, the table and long settings, and move no cursor", async () => {
  const { context, tab } = await opened({ viewport: { width: 500, height: 600 } });
  const still = async () => { await settled(tab); assert.equal((await shown(tab)).clock, "0.00 s"); };
  await tab.evaluate(() => document.activeElement.blur());
  await tab.keyboard.press("PageDown");
  await still();
  assert.ok(await tab.evaluate(() => scrollY) > 200, "Page Down scrolls the page");
  await tab.evaluate(() => {
    document.querySelector("table").style.minWidth = "3000px"; // as of many runs
    document.querySelector("header").insertAdjacentHTML("beforeend", `<details open><summary>s</summary><pre tabindex="0">${"x\n".repeat(99)}</pre></details>`);
  });
  await tab.locator(".wide").focus();
  for (let k = 0; k < 3; k += 1) await tab.keyboard.press("ArrowRight");
  await still();
  assert.ok(await tab.locator(".wide").evaluate((part) => part.scrollLeft) > 20, "an arrow scrolls the table");
  await tab.locator("header pre").focus();
  await tab.keyboard.press("End");
  await still();
  assert.ok(await tab.locator("header pre").evaluate((part) => part.scrollTop) > 200, "End scrolls long settings");
  await context.close();
});

test("a ring is where keys have put the focus, and not where a mouse clicked", async () => {
  const { context, tab } = await opened();
  const ring = (selector) => tab.locator(selector).evaluate((element) => getComputedStyle(element).outlineStyle);
  await tab.locator("#theme").click();
  assert.equal(await ring("#theme"), "none");
  await tab.locator("#scene canvas").click();
  assert.equal(await ring("#scene canvas"), "none");
  await tab.locator("#play").click();
  await tab.locator("#play").click();
  assert.equal(await ring("#play"), "none");
  await tab.keyboard.press("Tab");
  assert.equal(await ring("#time"), "solid");
  await context.close();
});

test("every metric says what it is, by mouse, by keyboard and to a screen reader", async () => {
  const { context, tab } = await opened();
  const tips = tab.locator("table .tip"), tip = tab.locator("#tip");
  assert.ok(await tips.count() >= 10);
  for (const text of await tips.evaluateAll((all) => all.map((each) => document.getElementById(each.getAttribute("aria-describedby")).textContent))) {
    assert.match(text, /^[A-Z].*\. (Unit: \S+\.|No unit\.)( (Lower|Nearer to zero) is better\.)?$/);
  }
  const work = tips.filter({ hasText: "work [J]" });
  await work.hover();
  assert.equal(await tip.textContent(), "Mechanical work of the motors. Unit: J. Lower is better.");
  await tab.mouse.move(5, 5);
  assert.ok(await tip.isHidden());
  await work.focus();
  assert.ok(await tip.isVisible());
  await tab.keyboard.press("Escape");
  assert.ok(await tip.isHidden());
  assert.equal(await tab.locator("#panels .tip").count(), 5);
  await context.close();
});

test("the address keeps the time, the runs, the wheels and the view", async () => {
  const { context, tab, complaints } = await opened();
  const boxes = tab.locator("#runs input"), count = await boxes.count();
  await boxes.nth(0).uncheck();
  await seek(tab, 1.25);
  await tab.locator("#wheels label", { hasText: "7" }).click();
  await tab.locator(".osp-views button", { hasText: "Plan" }).click();
  await tab.waitForFunction(() => location.hash.includes("view=plan"));
  await tab.reload();
  await tab.waitForSelector("html[data-ready=true]", { state: "attached", timeout: 120_000 });
  await settled(tab);
  const after_ = await shown(tab);
  assert.deepEqual([after_.clock, after_.runs], ["1.25 s", count - 1]);
  assert.equal(await boxes.nth(0).isChecked(), false);
  assert.deepEqual(await tab.locator("#wheels input:checked").evaluateAll((all) => all.map(({ value }) => value)), ["5", "7"]);
  assert.equal(await tab.locator(".osp-views button[aria-pressed=true]").textContent(), "Plan");
  // The column of a run that is not shown is faint; the last run cannot be taken away.
  assert.equal(await tab.locator("tbody tr").first().locator("td.out").count(), 1);
  for (let k = 1; k < count; k += 1) await boxes.nth(k).click();
  assert.equal(await tab.locator("#runs input:checked").count(), 1);
  assert.deepEqual(complaints, []);
  await context.close();
  // An address that says nonsense is as none.
  const odd = await opened({}, { url: `${page}#t=x&runs=0.99.-1&wheels=<b>&view=moon` });
  const plain = await opened({}, { url: `${page}#` });
  assert.deepEqual([await shown(odd.tab), odd.complaints], [await shown(plain.tab), []]);
  await plain.context.close();
  await odd.context.close();
});

test("on a phone runs are chosen and a tap moves the cursor, in the dark, and nothing is wider than the screen", async () => {
  const { context, tab, complaints } = await opened({ viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, colorScheme: "dark" });
  assert.equal((await shown(tab)).theme, "dark");
  const count = await tab.locator("#runs label").count();
  await tab.locator("#runs label").nth(1).tap();
  await settled(tab);
  assert.equal((await shown(tab)).runs, count - 1);
  const box = await tab.locator("#time").boundingBox();
  await tab.touchscreen.tap(box.x + box.width / 2, box.y + box.height / 2);
  await settled(tab);
  assert.ok(parseFloat((await shown(tab)).clock) > 1);
  await fits(tab, 390);
  const turned = await tab.locator(".verdict td *, .verdict td").evaluateAll((all) => all.filter((each) => getComputedStyle(each).writingMode !== "horizontal-tb").length);
  assert.equal(turned, 0, "verdicts are read without turning the phone");
  // The names of the logs do not fit into the columns: a list has them.
  assert.ok(await tab.locator(".logs dl").isHidden());
  await tab.locator(".logs summary").tap();
  assert.deepEqual(await tab.locator(".logs dd:visible").allTextContents(), await tab.locator("tr.file td").allTextContents());
  await fits(tab, 390);
  if (pictures) {
    await tab.evaluate(() => scrollTo(0, 0));
    await settled(tab);
    await tab.screenshot({ path: `${pictures}/report-dark.png` });
  }
  await tab.locator("#theme").tap();
  await settled(tab);
  assert.equal((await shown(tab)).theme, "light");
  assert.deepEqual(complaints, []);
  await context.close();
});

test("without WebGL the page says so, and plots and cursor work", async () => {
  const script = () => { const original = HTMLCanvasElement.prototype.getContext; HTMLCanvasElement.prototype.getContext = function (kind, ...rest) { return /webgl/.test(kind) ? null : original.call(this, kind, ...rest); }; };
  const { context, tab, complaints } = await opened({}, { script });
  assert.match(await tab.locator("#scene").textContent(), /needs WebGL 2/);
  await tab.locator("#play").focus();
  await tab.keyboard.press("PageDown");
  await settled(tab);
  const now = await shown(tab);
  near(now.cursor, 0.5, 0.01, "the cursor [s]");
  await tab.locator("#theme").click();
  await settled(tab);
  assert.deepEqual([now.clock, complaints], ["0.50 s", []]);
  await context.close();
});

test("runs of other vehicles or grounds are in the plots, and the page names them", async () => {
  const { context, tab, complaints } = await opened({}, { url: mixed });
  assert.match(await tab.locator("#note").textContent(), /^In the plots only, because vehicle or ground differ from those of /);
  const boxes = tab.locator("#runs input"), count = await boxes.count();
  const first = await shown(tab);
  assert.ok(first.runs < count);
  // Alone, each of them is in the scene.
  for (let k = 1; k < count; k += 1) if (await boxes.nth(k).isChecked()) await boxes.nth(k).uncheck();
  assert.ok(await tab.locator("#note").isHidden());
  for (let k = 1; k < count; k += 1) {
    await boxes.nth(k).check();
    await boxes.nth(k - 1).uncheck();
    await settled(tab);
    assert.equal((await shown(tab)).runs, 1);
    assert.ok(await colours(tab) > 300, `run ${k} is drawn`);
  }
  await fits(tab, 1200);
  assert.deepEqual(complaints, []);
  await context.close();
});

test("each wheel of several vehicles has its own colour, and every run has curves from the start", async () => {
  const { context, tab } = await opened({}, { url: vehicles });
  const dots = await tab.locator("#wheels label").evaluateAll((all) => all.map((label) => [label.textContent, label.querySelector("i").style.background]));
  assert.deepEqual(dots.map(([name]) => name), [..."1234567", "front_left", "front_right", "rear_left", "rear_right"]);
  assert.equal(new Set(dots.map(([, colour]) => colour)).size, dots.length);
  // No wheel is in both vehicles: one of each is chosen, and its line has the colour of its dot.
  const chosen = await tab.locator("#wheels input:checked").evaluateAll((all) => all.map(({ value }) => value));
  assert.deepEqual(chosen, ["5", "front_left"]);
  const speeds = await tab.evaluate(() => document.getElementById("plots").data.filter(({ yaxis, name }) => yaxis === "y" && !/: reference$/.test(name)).map(({ name, line }) => [/wheel (\w+)$/.exec(name)[1], Object.assign(document.createElement("i").style, { color: line.color }).color]));
  assert.deepEqual(speeds.map(([wheel]) => wheel).sort(), ["5", "front_left"]);
  for (const [wheel, colour] of speeds) assert.equal(colour, new Map(dots).get(wheel));
  await context.close();
  // Vehicles that have a wheel in common show that one.
  const mixture = await opened({}, { url: mixed });
  assert.equal(await mixture.tab.locator("#wheels input:checked").count(), 1);
  const lines = await mixture.tab.evaluate(() => document.getElementById("plots").data.filter(({ yaxis, name }) => yaxis === "y" && !/: reference$/.test(name)).length);
  assert.equal(lines, await mixture.tab.locator("#runs input:checked").count());
  await mixture.context.close();
});

test("from above each command is drawn once, and each run's ellipses are, in its colour", async () => {
  const { context, tab, complaints } = await opened({}, { url: paths });
  const names = await tab.locator("#runs label").allTextContents();
  assert.equal(names.length, 3);
  const drawn = () => tab.evaluate(() => document.getElementById("above").data.map(({ name, line }) => [name, line?.color]));
  const of = async (pattern) => (await drawn()).filter(([name]) => pattern.test(name));
  const odometry = new Map((await of(/: odometry$/)).map(([name, colour]) => [name.replace(/: odometry$/, ""), colour]));
  assert.deepEqual([...odometry.keys()], names);
  const commands = await of(/^command/);
  assert.deepEqual(commands, [[`command of ${names[0]}`, odometry.get(names[0])], [`command of ${names[1]}; ${names[2]}`, odometry.get(names[1])]]);
  assert.deepEqual(await of(/standard deviations/), names.map((name) => [`${name}: 2 standard deviations`, odometry.get(name)]));
  const legend = () => tab.locator("#ways .entry").allTextContents();
  assert.deepEqual((await legend()).slice(3), ["true position", "odometry", ...commands.map(([name]) => name), "ellipses: 2 standard deviations of odometry"]);
  // Of one command it goes without saying whose it is.
  await tab.locator("#runs input").nth(0).uncheck();
  await settled(tab);
  assert.deepEqual((await of(/^command/)).map(([name]) => name), ["command"]);
  assert.deepEqual((await legend()).slice(2), ["true position", "odometry", "command", "ellipses: 2 standard deviations of odometry"]);
  assert.deepEqual(complaints, []);
  await context.close();
});
