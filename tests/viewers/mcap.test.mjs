// Logs by @mcap/core, the reader of Foxglove and Lichtblick: LOGS=folder node --test mcap.test.mjs
import assert from "node:assert/strict";
import { open, readdir, readFile } from "node:fs/promises";
import { join } from "node:path";
import { test } from "node:test";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { decompress } from "fzstd";

const folder = process.env.LOGS;
const logs = (await readdir(folder)).filter((name) => name.endsWith(".mcap"));
const decompressHandlers = { zstd: (data, size) => decompress(data, new Uint8Array(Number(size))) };
const topics = ["/cmd_vel", "/ground_truth/odom", "/joint_states", "/markers", "/odom", "/robot_description", "/sensors", "/terrain/robot_description", "/tf", "/vehicle_state"];

test("there are logs to read", () => assert.ok(logs.length >= 11, `${logs.length} in ${folder}`));

for (const name of logs) {
  test(`${name}: every record and message is read, checksums included`, async () => {
    const file = await open(join(folder, name));
    const readable = {
      size: async () => BigInt((await file.stat()).size),
      read: async (offset, length) => {
        const buffer = new Uint8Array(Number(length));
        await file.read(buffer, 0, buffer.length, Number(offset));
        return buffer;
      },
    };
    const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
    assert.equal(reader.header.profile, "ros2");
    const readers = new Map(), counts = new Map();
    for (const [id, channel] of reader.channelsById) {
      const schema = reader.schemasById.get(channel.schemaId);
      assert.equal(schema.encoding, "ros2msg");
      readers.set(id, new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true })));
    }
    let last = -1n;
    for await (const message of reader.readMessages({ validateCrcs: true })) {
      assert.ok(message.logTime >= last);
      last = message.logTime;
      const topic = reader.channelsById.get(message.channelId).topic;
      counts.set(topic, (counts.get(topic) ?? 0) + 1);
      const decoded = readers.get(message.channelId).readMessage(message.data);
      if (topic === "/vehicle_state") {
        assert.ok(decoded.wheels.length >= 3 && Number.isFinite(decoded.wheels[0].measured_rad_s));
      } else if (topic === "/sensors") {
        assert.ok(decoded.wheels_rad_s.length >= 3 && Number.isFinite(decoded.specific_force_m_s2.z));
      } else if (topic === "/markers") {
        assert.equal(decoded.markers[0].ns, "ground_force");
      } else if (topic.endsWith("robot_description")) {
        assert.match(decoded.data, /^<robot name="/);
      }
    }
    // Traction control has signals of its own, and so has who follows a path.
    const own = /-traction|^square|^figure_eight/.test(name) ? ["/controller_signals"] : [];
    assert.deepEqual([...counts.keys()].sort(), [...topics, ...own].sort());
    assert.equal(reader.statistics.messageCount, BigInt([...counts.values()].reduce((a, b) => a + b, 0)));
    await file.close();

    // And from front to back, as a stream.
    const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
    stream.append(new Uint8Array(await readFile(join(folder, name))));
    let messages = 0;
    for (let record; (record = stream.nextRecord()) !== undefined; ) messages += record.type === "Message" ? 1 : 0;
    assert.ok(stream.done());
    assert.equal(BigInt(messages), reader.statistics.messageCount);
  });
}

test("the layout for Foxglove and Lichtblick shows panels, topics and fields that are there", async () => {
  const layout = JSON.parse(await readFile(new URL("../../viewers/foxglove-layout.json", import.meta.url)));
  const shown = [];
  const walk = (node) => { if (typeof node === "string") shown.push(node); else { walk(node.first); walk(node.second); } };
  walk(layout.layout);
  assert.deepEqual(shown.sort(), Object.keys(layout.configById).sort());
  for (const topic of Object.keys(layout.configById["3D!vehicle"].topics)) assert.ok(topics.includes(topic), topic);
  const file = new Uint8Array(await readFile(join(folder, "step-traction.mcap")));
  const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  stream.append(file);
  let reader, id, state;
  for (let record; state === undefined && (record = stream.nextRecord()) !== undefined; ) {
    if (record.type === "Schema" && record.name === "omnistep_msgs/msg/VehicleState") reader = new MessageReader(parse(new TextDecoder().decode(record.data), { ros2: true }));
    if (record.type === "Channel" && record.topic === "/vehicle_state") id = record.id;
    if (record.type === "Message" && record.channelId === id) state = reader.readMessage(record.data);
  }
  let paths = 0;
  for (const { value } of Object.values(layout.configById).flatMap((panel) => panel.paths ?? [])) {
    const [, wheel, field] = /^\/vehicle_state\.(?:wheels\[(\d)\]\.)?(\w+)$/.exec(value);
    const number = wheel === undefined ? state[field] : state.wheels[Number(wheel)][field];
    assert.equal(typeof number, "number", value);
    paths += 1;
  }
  assert.ok(paths > 20);
});

test("a flipped bit in a chunk is noticed", async () => {
  const bytes = new Uint8Array(await readFile(join(folder, logs[0])));
  bytes[bytes.length >> 1] ^= 1;
  const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  stream.append(bytes);
  assert.throws(() => { while (stream.nextRecord() !== undefined); });
});
