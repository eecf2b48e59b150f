// The player alone, in headless Chromium: node --test player.test.mjs, with CHROMIUM=/usr/bin/chromium. Every kind of ground, every view.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { launched } from "./browser.mjs";

const bundle = fileURLToPath(new URL("../../python/omnistep/assets/player.js", import.meta.url));
let browser;

before(async () => {
  browser = await launched();
});
after(() => browser?.close());

const wheel = (frame, name) => ({ frame, name, radius_m: 0.1, width_m: 0.05, axle: [0, 1, 0], roller_angle_rad: 0.785 });
const scene = {
  bodies: [{ frame: 0, at_m: [0, 0, 0.2], edges_m: [0.5, 0.3, 0.1] }],
  wheels: [wheel(1, "1"), wheel(2, "<b>2</b>")],
  ground: [{ kind: "box", half_m: [1000, 1000, 0.5], at_m: [0, 0, -0.5], turn_y_rad: 0 }],
  patches: [{ x_m: [0, 1], y_m: [-1, 1], friction: 0.2 }],
  runs: [{ name: "a" }, { name: "<i>b</i>" }],
};
const upright = (x, y, z) => [x, y, z, 0, 0, 0, 1];
const state = (x, push = [[0, 0, 50], [x, 0, 0]]) => ({
  poses: [upright(x, 0, 0.1), upright(x, -0.2, 0.1), upright(x, 0.2, 0.1)],
  wheels: [{ slip: 0.6, push, load_n: 50 }, { slip: 0, push: null, angle_rad: 1 }],
  path_m: [0, 0, 0, x, 0, 0],
});

async function opened() {
  const tab = await browser.newPage({ viewport: { width: 500, height: 400 } }), complaints = [];
  tab.on("console", (message) => { if (["error", "warning"].includes(message.type()) && !/GPU stall/.test(message.text())) complaints.push(message.text()); });
  tab.on("pageerror", (error) => complaints.push(String(error)));
  await tab.setContent("<!doctype html><body style='margin:0'><div id=here style='width:500px;height:400px'></div>");
  await tab.addScriptTag({ path: bundle });
  await tab.evaluate((next) => { window.player = new window.omnistepPlayer.Player(document.getElementById("here"), next); }, scene);
  return { tab, complaints };
}
const drawn = (tab) => tab.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 100)))));
const picture = async (tab) => (await tab.locator("#here").screenshot()).toString("base64");

test("each kind of ground is drawn, and one that is not known is left out", async () => {
  const { tab, complaints } = await opened();
  const grounds = [
    [], // nothing to stand on
    [{ kind: "moon" }],
    [{ kind: "box", half_m: [1, 1, 0.1], at_m: [0, 0, -0.1], turn_y_rad: -0.2 }],
    [{ kind: "bar", radius_m: 0.1, at_m: [0.5, 0, 0] }],
    [{ kind: "field", from_m: -1, extent_m: [2, 2], rows: 3, columns: 3, heights_m: [0, 0, 0, 0, 0.1, 0, 0, 0, 0] }],
    [{ kind: "profile", x_m: [-1, 0.4, 0.4, 1], z_m: [0, 0, 0.1, 0.1] }],
    [{ kind: "mesh", vertices_m: [[-1, -1, 0], [1, -1, 0], [0, 1, 0]], triangles: [[0, 1, 2]] }],
  ];
  const pictures = [];
  for (const ground of grounds) {
    await tab.evaluate(([next, states]) => { window.player.setScene(next); window.player.show(states); }, [{ ...scene, ground, patches: [] }, [state(0.2), null]]);
    await drawn(tab);
    pictures.push(await picture(tab));
  }
  assert.ok(pictures[0] === pictures[1]);
  assert.equal(new Set(pictures).size, grounds.length - 1);
  assert.deepEqual(complaints, []);
  await tab.close();
});

test("what a state says is seen: place, forces, slip, spin, and which runs are shown", async () => {
  const { tab, complaints } = await opened();
  const look = async (...states) => { await tab.evaluate((next) => window.player.show(next), states); await drawn(tab); return picture(tab); };
  const one = await look(state(0), null);
  assert.ok(await look(state(0), null) === one, "the same state is the same picture");
  const slipless = state(0), airborne = state(0, null), turned = state(0);
  slipless.wheels[0].slip = 0.05;
  turned.wheels[1].angle_rad = 1.5;
  const all = [one, await look(slipless, null), await look(airborne, null), await look(turned, null), await look(state(0), state(0.1)), await look(null, state(0))];
  assert.equal(new Set(all).size, all.length);
  // Names are text.
  const texts = await tab.locator(".osp-legend span").allTextContents();
  assert.equal(texts[0], "<i>b</i>");
  assert.deepEqual(await tab.locator(".osp-label").allTextContents(), ["1", "<b>2</b>"]);
  assert.equal(await tab.locator("#here b, #here i:not([style])").count(), 0);
  assert.deepEqual(complaints, []);
  await tab.close();
});

test("the legend names forces as soon as a state has some, and what the patches are", async () => {
  const { tab, complaints } = await opened();
  const look = async (...states) => { await tab.evaluate((next) => window.player.show(next), states); await drawn(tab); return tab.locator(".osp-legend span").allTextContents(); };
  const first = { ...state(0), wheels: undefined }; // before its first period a run knows nothing of its wheels
  assert.deepEqual(await look(first, first), ["a", "<i>b</i>", "wheel slip", "friction 0.2"]);
  assert.deepEqual(await look(state(0), state(0)), ["a", "<i>b</i>", "wheel slip", "ground force", "friction 0.2"]);
  assert.deepEqual(await look(state(0, null), state(0, null)), ["a", "<i>b</i>", "wheel slip", "friction 0.2"]);
  assert.deepEqual(await look(state(0, null), state(0)), ["a", "<i>b</i>", "wheel slip", "ground force", "friction 0.2"]);
  const patches = [{ x_m: [0, 1], y_m: [0, 1], friction: 0.05 }, { x_m: [1, 2], y_m: [0, 1], friction: 0.3 }, { x_m: [2, 3], y_m: [0, 1], friction: 0.05 }];
  await tab.evaluate((next) => window.player.setScene(next), { ...scene, patches });
  assert.deepEqual(await look(state(0, null), null), ["a", "wheel slip", "friction 0.05, 0.3"]);
  await tab.evaluate((next) => window.player.setScene(next), { ...scene, patches: [] });
  assert.deepEqual(await look(state(0, null), null), ["a", "wheel slip"]);
  assert.deepEqual(complaints, []);
  await tab.close();
});

test("there is ground below a vehicle however far it goes, and a patch is seen at the height of its ground", async () => {
  const { tab, complaints } = await opened();
  const look = async (next, x, y, view) => {
    const moved = state(x);
    moved.poses.forEach((pose) => { pose[1] += y; });
    await tab.evaluate(([next_, state_, name]) => { window.player.setScene(next_); window.player.show([state_, null]); window.player.setView(name); }, [{ ...scene, runs: [scene.runs[0]], ...next }, moved, view]);
    await drawn(tab);
    return picture(tab);
  };
  // A plain, a ramp whose middle is far away, and a bar across: as far as the simulation has them.
  const grounds = [
    [scene.ground, 100, 0], [scene.ground, -100, 150],
    [[{ kind: "box", half_m: [1000, 1000, 0.5], at_m: [0, 0, -0.5], turn_y_rad: 1e-4 }], 100, 100],
    [[{ kind: "bar", radius_m: 0.3, at_m: [100, 0, -0.3] }], 100, 100],
  ];
  for (const [ground, x, y] of grounds) for (const view of ["orbit", "plan"]) {
    assert.notEqual(await look({ ground, patches: [] }, x, y, view), await look({ ground: [], patches: [] }, x, y, view), `${view}: nothing below ${x}, ${y} m: ${JSON.stringify(ground)}`);
  }
  // Without another scene in between: the vehicle drives there.
  await look({ patches: [] }, 0, 0, "plan");
  const drive = async (x) => { await tab.evaluate((next) => window.player.show([next]), state(x)); await drawn(tab); return picture(tab); };
  for (let x = 10; x < 100; x += 10) await drive(x);
  assert.notEqual(await drive(100), await look({ ground: [], patches: [] }, 100, 0, "plan"));
  const high = [{ kind: "box", half_m: [2, 2, 0.5], at_m: [0, 0, -0.2], turn_y_rad: 0 }]; // its top is at 0.3 m
  for (const view of ["orbit", "plan"]) assert.notEqual(await look({ ground: high }, 0, 0, view), await look({ ground: high, patches: [] }, 0, 0, view), `${view}: the patch is hidden in the ground`);
  assert.deepEqual(complaints, []);
  await tab.close();
});

test("the camera goes with the vehicle in every view, and dispose leaves nothing", async () => {
  const { tab, complaints } = await opened();
  for (const view of await tab.evaluate(() => window.omnistepPlayer.Player.views)) {
    const places = [];
    for (const x of [0, 5]) {
      await tab.evaluate(([name, states, again]) => { window.player.show(states); if (again) window.player.setView(name); }, [view, [state(x), null], x === 0]);
      await drawn(tab);
      places.push(await tab.locator(".osp-label").first().boundingBox());
    }
    // After 5 m the first wheel is where it was in the picture, to a pixel.
    assert.ok(Math.hypot(places[0].x - places[1].x, places[0].y - places[1].y) < 1, `${view}: ${JSON.stringify(places)}`);
  }
  await tab.evaluate(() => { window.player.setTheme(true); window.player.zoom(2); window.player.home(); window.player.dispose(); });
  await drawn(tab);
  assert.equal(await tab.locator("#here *").count(), 0);
  assert.deepEqual(complaints, []);
  await tab.close();
});
