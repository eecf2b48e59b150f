// The module of the playground in node: MODULE=omnistep.wasm LOGS=folder ARTICULATED=folder node --test wasm.test.mjs. The folders have native
// logs of every built-in scenario: its first two seconds, and its first second with the articulated engine.
import assert from "node:assert/strict";
import { readdir, readFile } from "node:fs/promises";
import { join } from "node:path";
import { test } from "node:test";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { McapStreamReader } from "@mcap/core";
import { decompress } from "fzstd";
import { Engine, Refused } from "../../web/playground/engine.js";
import { aboutFile, opened, withFile } from "../../web/playground/own.js";
import { Path } from "../../web/playground/path.js";
import { address, again, commandLine, read, requests } from "../../web/playground/settings.js";

const module = await readFile(process.env.MODULE);
const FOLDERS = [[process.env.LOGS, { duration_s: 2, "physics.engine": "rapier" }], [process.env.ARTICULATED, { duration_s: 1, "physics.engine": "articulated" }]];
const engine = await Engine.from(module);
const decompressHandlers = { zstd: (data, size) => decompress(data, new Uint8Array(Number(size))) };

/** All records of a log that say something, checksums checked. */
function records(bytes) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(bytes);
  const found = { schemas: [], channels: [], messages: [], attachments: [], metadata: [] };
  const kinds = { Schema: "schemas", Channel: "channels", Message: "messages", Attachment: "attachments", Metadata: "metadata" };
  for (let record; (record = reader.nextRecord());) if (record.type in kinds) found[kinds[record.type]].push(record);
  assert.ok(reader.done(), "the log is whole");
  return found;
}

/** A log that the module wrote. */
async function logged(request) {
  const pieces = [];
  for await (const piece of engine.logged(request)) pieces.push(piece);
  return records(Buffer.concat(pieces));
}

const same = (a, b) => Buffer.compare(a, b) === 0;

const metadataOf = (log) => Object.fromEntries(log.metadata.find((each) => each.name === "run").metadata);
const logs = [];
for (const [folder, set] of FOLDERS) for (const name of (await readdir(folder)).filter((each) => each.endsWith(".mcap"))) {
  logs.push({ name, set, native: records(await readFile(join(folder, name))) });
}

test("the native logs are of every scenario that the module offers", () => {
  const offered = Object.keys(engine.offer().scenarios).sort();
  for (const [, set] of FOLDERS) assert.deepEqual(logs.filter((each) => each.set === set).map(({ native }) => metadataOf(native).scenario).sort(), offered, JSON.stringify(set));
});

for (const { name, set, native } of logs) {
  test(`${name}, ${set.duration_s} s: the module writes the same records`, async () => {
    const { scenario, policy } = metadataOf(native);
    const here = await logged({ scenario, policy, set });
    assert.ok(native.messages.length > 1000 * set.duration_s, "a state every period");
    assert.deepEqual(here.schemas, native.schemas);
    assert.deepEqual(here.channels, native.channels);
    assert.deepEqual(here.metadata, native.metadata);
    assert.deepEqual(here.attachments, native.attachments);
    assert.equal(here.messages.length, native.messages.length);
    const readers = new Map(native.channels.map(({ id, schemaId }) => {
      const { data } = native.schemas.find((schema) => schema.id === schemaId);
      return [id, new MessageReader(parse(new TextDecoder().decode(data), { ros2: true }))];
    }));
    native.messages.forEach((message, k) => {
      const other = here.messages[k], head = ({ channelId, sequence, logTime, publishTime }) => [channelId, sequence, logTime, publishTime];
      assert.deepEqual(head(other), head(message));
      // WebAssembly leaves open which bits a NaN has: other bytes have to be the same numbers.
      if (!same(other.data, message.data)) {
        const read_ = readers.get(message.channelId);
        assert.deepStrictEqual(read_.readMessage(other.data), read_.readMessage(message.data));
      }
    });
  });
}

test("what is driven can be run again from the table of its commands, with the same bits", async () => {
  const request = { scenario: "step", policy: "independent", set: { "physics.engine": "articulated" } };
  const run = engine.open(request);
  // First as the scenario has it, then by hand, then at rest.
  for (const [periods, twist] of [[150, undefined], [700, [0.3, 0.1, -0.2]], [1, [0.1, -0, 0.3]], [400, [0, 0, 0]]]) assert.equal(engine.advance(run, periods, twist), periods);
  const driven = { csv: engine.commands(run), time_s: engine.outcome(run).time_s, wheels: engine.scene(run).settings.wheels };
  assert.equal(driven.time_s, 1.251);
  const repeated = again(request, driven), second = engine.open(repeated);
  assert.equal(engine.advance(second, 10_000), 1251, "it ends where it was left");
  assert.equal(engine.state(second), engine.state(run));
  assert.deepEqual(engine.outcome(second), engine.outcome(run));
  assert.equal(engine.outcome(run).outcome.wheel_model_valid, false, "a vehicle that turns meets the step with its rollers");
  const { messages } = await logged(repeated);
  assert.ok(messages.length > 1251);
  engine.close(run);
  engine.close(second);
});

test("metrics of a driven run are those of its repetition, on every ground", () => {
  for (const [scenario, { policy }] of Object.entries(engine.offer().scenarios)) {
    const request = { scenario, policy, set: { "physics.engine": "articulated" } }, run = engine.open(request);
    assert.equal(engine.advance(run, 200, undefined), 200);
    assert.equal(engine.advance(run, 500, [0.2, 0.05, 0]), 500);
    const driven = { csv: engine.commands(run), time_s: engine.outcome(run).time_s, wheels: engine.scene(run).settings.wheels }, second = engine.open(again(request, driven));
    engine.advance(second, 10_000);
    assert.equal(engine.state(second), engine.state(run), scenario);
    assert.deepEqual(engine.outcome(second), engine.outcome(run), scenario);
    engine.close(run);
    engine.close(second);
  }
});

test("two runs go on beside each other, and neither moves the other", () => {
  const request = { scenario: "flat", set: { "physics.engine": "articulated" } };
  const [alone, first, second] = [0, 1, 2].map(() => engine.open(request));
  engine.advance(alone, 500);
  for (let k = 0; k < 50; k += 1) {
    engine.advance(first, 10);
    engine.advance(second, 10, [0, 0.2, 0]);
  }
  assert.equal(engine.state(first), engine.state(alone));
  const [, y] = JSON.parse(engine.state(second)).poses[0];
  // 0.5 s at 0.2 m/s, less the time in which the wheels get there.
  assert.ok(y > 0.07 && y < 0.1, `${y} m to the left`);
  for (const run of [alone, first, second]) engine.close(run);
});

test("whatever a page gives, the answer is one line, and the module goes on", () => {
  const refused = (what) => {
    let line;
    assert.throws(what, (error) => { line = error.message; return error instanceof Refused; });
    assert.ok(line.length > 0 && line.length < 400 && !line.includes("\n"), line);
    return line;
  };
  const open = (request) => refused(() => engine.open(request));
  assert.match(open({ scenario: "../etc/passwd" }), /^scenario: "..\/etc\/passwd", allowed: step, hard_step, flat, /);
  assert.match(open({ scenario: "x".repeat(1e6) }), /^scenario: "x{40}", allowed/);
  assert.match(open({ scenario: "step", policy: "best" }), /best.*independent/);
  assert.match(open({ scenario: "step", set: { "terrain.friction": -1 } }), /terrain.friction: -1(\.0)?, allowed: 0 to 2/);
  assert.match(open({ scenario: "step", set: { "terrain.friction": null } }), /^request: /);
  assert.match(open({ scenario: "step", set: { "terrain.height_m": "high" } }), /terrain.height_m/);
  assert.match(open({ scenario: "step", set: { vehicle: "some.toml" } }), /some.toml/);
  assert.match(open({ scenario: "step", set: { "command": { file: "drive.csv" } } }), /drive.csv/);
  assert.match(open({ scenario: "step", set: { "": 1 } }), /./);
  assert.match(open({ scenario: "step", more: 1 }), /more/);
  assert.match(open([]), /^request: /);
  assert.match(open({ scenario: "step", set: { x: "y".repeat(1 << 24) } }), /16777216 bytes/);
  for (const run of [-1, 0, 7, 8, 2 ** 31 - 1, NaN]) {
    for (const what of ["scene", "state", "outcome", "commands", "log", "finishLog"]) assert.match(refused(() => engine[what](run)), /^no run has the number /);
    engine.close(run);
  }
  const run = engine.open({ scenario: "flat" });
  for (const twist of [[NaN, 0, 0], [0, Infinity, 0], [1e9, 0, 0], [0, 0, -1e4]]) assert.match(refused(() => engine.advance(run, 1, twist)), /allowed: -\d+ to \d+/);
  assert.match(refused(() => engine.log(run)), /no log/);
  assert.equal(engine.advance(run, 10, [0.3, 0, 0]), 10);
  const more = [];
  assert.match(refused(() => { for (;;) more.push(engine.open({ scenario: "flat" })); }), /^8 runs are open/);
  for (const each of [run, ...more]) engine.close(each);
});

test("an address is a state of the page, and what is wrong with one is a line", () => {
  const offer = engine.offer();
  for (const scenario of Object.keys(offer.scenarios)) {
    const { settings, wrong } = read(address({ scenario, vehicle: "omni3", policy: "scale_torques", against: "traction", engine: "rapier", wheels: "rollers", torque: 1.5, friction: 0.4 }), offer);
    assert.equal(wrong, "");
    assert.deepEqual(read(address(settings), offer).settings, settings);
  }
  const line = (hash) => read(hash, offer).wrong;
  assert.match(line("#scenario=moon"), /^scenario: "moon", allowed: step, /);
  assert.match(line("#torque=much"), /^torque: "much", allowed: a number$/);
  assert.match(line("#torque="), /^torque: "", allowed: a number$/);
  assert.match(line("#__proto__=1"), /^__proto__: no such setting/);
  assert.match(line(`#policy=${"p".repeat(500)}`), /^policy: "p{40}\.\.\.", allowed/);
  assert.equal(line("#%zz"), line("#%25zz"));
  assert.deepEqual(requests({ scenario: "flat", policy: "scale_torques", against: "scale_torques", engine: "rapier" }).length, 1);
  const [request] = requests(read("#scenario=step&policy=scale_torques&friction=0.5", offer).settings);
  assert.equal(commandLine(request, { time_s: 2.5, wheels: "ball" }).replaceAll(" \\\n ", ""), "omnistep run step --policy scale_torques --set physics.engine=articulated --set terrain.friction=0.5 --set physics.wheel_model=ball --set 'command={ file = \"drive.csv\" }' --set duration_s=2.5");
});

test("without a wheel model the module's own judgement of balls decides", () => {
  const model = (scenario, set = {}) => {
    const run = engine.open({ scenario, set });
    try { return engine.scene(run).settings.wheels; } finally { engine.close(run); }
  };
  assert.equal(model("step"), "ball");
  assert.equal(model("step", { vehicle: "mecanum4" }), "rollers");
  assert.equal(model("flat", { vehicle: "mecanum4" }), "ball");
  assert.equal(model("step", { vehicle: "mecanum4", "physics.wheel_model": "ball" }), "ball");
});

test("metrics have the names and texts of the command's tables", () => {
  const { metrics } = engine.offer();
  assert.deepEqual(metrics.find(({ key }) => key === "work_j"), { key: "work_j", heading: "work [J]", meaning: "Mechanical work of the motors.", better: "lower" });
  const run = engine.open({ scenario: "flat", set: { "physics.engine": "articulated" } });
  engine.advance(run, 1000);
  const { outcome, shown } = engine.outcome(run);
  assert.deepEqual(Object.keys(shown).sort(), metrics.map(({ key }) => key).sort());
  // A position is shown to the millimetre.
  assert.deepEqual(shown.final_x_m, [outcome.final_x_m.toFixed(3), true]);
  assert.deepEqual(shown.crossing_s, [null, false]);
  engine.close(run);
});

test("a path keeps its start and where it is, and at most some thousand points however long it is", () => {
  const path = new Path(), long = 1000; // [m]
  for (let x = 0; x <= long; x += 0.015) path.add([x, 2 * x, 0.1]);
  const points = Array.from({ length: path.points.length / 3 }, (_, k) => path.points.slice(3 * k, 3 * k + 3));
  assert.ok(points.length > 1000 && points.length <= 3000, `${points.length} points`);
  assert.deepEqual(points[0], [0, 0, 0.1 + 0.002]);
  // Spread evenly: each is as far from the one before, but for the last ones.
  const steps = points.slice(1).map(([x], k) => x - points[k][0]), longest = Math.max(...steps);
  assert.ok(longest < 2 * long / 1000 && long - points.at(-1)[0] <= longest, `${longest} m between two points`);
  // Standing still adds nothing, and another array says that something has changed.
  const { points: before } = path;
  path.add(points.at(-1));
  assert.ok(path.points === before);
  path.add([long + 10, 0, 0]);
  assert.ok(path.points !== before && before.length < path.points.length);
});

test("a log ends where its reader says so, and its run is closed", async () => {
  let slices = 0;
  const pieces = [];
  for await (const piece of engine.logged({ scenario: "flat", set: { "physics.engine": "articulated" } }, () => { slices += 1; return slices < 3; })) pieces.push(piece);
  assert.deepEqual([slices, pieces.length], [3, 3], "three slices, and no last piece");
  const open = [];
  assert.throws(() => { for (;;) open.push(engine.open({ scenario: "flat" })); }, /^Error: 8 runs are open|8 runs are open/);
  assert.equal(open.length, 8);
  open.forEach((run) => engine.close(run));
});

test("a built-in file as a file of one's own gives the same run, and a fault in it has its name", async () => {
  const assets = new URL("../../crates/omni-config/assets/", import.meta.url), set = { "physics.engine": "articulated" };
  const file = async (path) => opened(new File([await readFile(new URL(path, assets))], path.split("/").pop()));
  const after = (request) => {
    const run = engine.open(request);
    engine.advance(run, 500);
    const state = engine.state(run);
    engine.close(run);
    return state;
  };
  const offer = engine.offer();
  for (const name of Object.keys(offer.scenarios)) {
    const own = await file(`scenarios/${name}.toml`), request = { policy: "traction", set };
    assert.equal(own.kind, "scenario");
    assert.ok(after({ scenario: name, ...request }) === after(withFile({ scenario: "step", ...request }, own)), name);
  }
  for (const name of Object.keys(offer.vehicles)) {
    const own = await file(`vehicles/${name}.toml`), request = { scenario: "stairs", policy: "traction" };
    assert.equal(own.kind, "vehicle");
    assert.ok(after({ ...request, set: { ...set, vehicle: name } }) === after(withFile({ ...request, set }, own)), name);
  }
  await assert.rejects(opened(new File(["duration_s = 1"], "a.toml")), /^Error: a\.toml: missing field `schema_version`$/);
  await assert.rejects(opened(new File(["a = ["], "a.toml")), /^Error: a\.toml: line 1: /);
  await assert.rejects(opened(new File([" ".repeat((1 << 20) + 1)], "a.toml")), /allowed: up to 1048576 bytes$/);
  const own = { ...await file("scenarios/stairs.toml"), name: "mine.toml" };
  own.table.terrain = { ...own.table.terrain, friction: 7 };
  assert.throws(() => engine.open(withFile({ scenario: "step", set }, own)), (error) => /^mine\.toml: terrain\.friction: 7/.test(aboutFile(error.message, own)));
});
