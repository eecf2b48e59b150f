// A live run watched and steered by a client of its own: OMNISTEP=path/to/omnistep node --test live.test.mjs
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { test } from "node:test";
import { parse } from "@foxglove/rosmsg";
import { MessageReader, MessageWriter } from "@foxglove/rosmsg2-serialization";
import WebSocket from "ws";

const program = process.env.OMNISTEP;

// The run, its address, and what it printed.
async function started(...args) {
  const run = spawn(program, ["run", "flat", "--live", "--port", "0", "--wait", "--json", ...args]);
  let said = "", printed = "";
  run.stdout.on("data", (data) => { printed += data; });
  const address = await new Promise((found, failed) => {
    run.stderr.on("data", (data) => {
      said += data;
      const match = /serving (ws:\/\/127\.0\.0\.1:\d+)/.exec(said);
      if (match) found(match[1]);
    });
    run.on("exit", () => failed(new Error(`ended: ${said}`)));
  });
  return { run, address, printed: () => printed };
}

// A client of Foxglove's protocol that decodes what it subscribed to.
async function connected(address) {
  const socket = new WebSocket(address, "foxglove.sdk.v1");
  const messages = new Map(), texts = [], channels = new Map(), subscriptions = new Map(), waiting = [];
  const look = () => { for (let k = waiting.length - 1; k >= 0; k -= 1) if (waiting[k].done()) waiting.splice(k, 1)[0].resolve(); };
  socket.on("message", (data, binary) => {
    if (!binary) {
      const text = JSON.parse(data);
      texts.push(text);
      if (text.op === "advertise") for (const channel of text.channels) channels.set(channel.topic, channel);
    } else if (data.readUInt8(0) === 1) {
      const { topic, reader } = subscriptions.get(data.readUInt32LE(1));
      const list = messages.get(topic) ?? [];
      list.push({ time: data.readBigUInt64LE(5), message: reader.readMessage(new Uint8Array(data.subarray(13))) });
      messages.set(topic, list);
    }
    look();
  });
  await once(socket, "open");
  const until = (done, what) => new Promise((resolve, reject) => {
    const late = setTimeout(() => reject(new Error(`not in time: ${what}`)), 30_000);
    waiting.push({ done, resolve: () => { clearTimeout(late); resolve(); } });
    look();
  });
  const send = (message) => socket.send(JSON.stringify(message));
  const subscribe = async (topic) => {
    const id = subscriptions.size + 1;
    await until(() => channels.has(topic), `channel ${topic}`);
    const { schema, schemaEncoding, encoding, id: channelId } = channels.get(topic);
    assert.deepEqual([schemaEncoding, encoding], ["ros2msg", "cdr"]);
    subscriptions.set(id, { topic, reader: new MessageReader(parse(schema, { ros2: true })) });
    send({ op: "subscribe", subscriptions: [{ id, channelId }] });
  };
  return { socket, messages, texts, channels, until, send, subscribe, of: (topic) => messages.get(topic) ?? [] };
}

const speed = (client) => client.of("/odom").at(-1).message.twist.twist.linear;

test("a client watches a run in step with the clock and changes command, policy and torque limit", async () => {
  const { run, address } = await started("--set", "duration_s=600");
  const client = await connected(address);
  const ofServer = () => client.texts.find(({ op }) => op === "serverInfo");
  await client.until(() => ofServer() !== undefined, "the server's greeting");
  const info = ofServer();
  assert.ok(info.capabilities.includes("parameters") && info.capabilities.includes("clientPublish"));
  for (const topic of ["/robot_description", "/odom", "/vehicle_state", "/tf", "/markers"]) await client.subscribe(topic);

  // Descriptions come to whoever asks late; a second takes a second.
  await client.until(() => client.of("/robot_description").length > 0, "the robot's description");
  assert.match(client.of("/robot_description")[0].message.data, /^<robot name="chugo7"/);
  await client.until(() => client.of("/odom").length >= 5, "poses");
  const [clock, simulated] = [performance.now(), client.of("/odom").at(-1).time];
  await client.until(() => Number(client.of("/odom").at(-1).time - simulated) >= 2e9, "two seconds");
  const took = (performance.now() - clock) / 1000;
  assert.ok(took > 1.8 && took < 4, `2 simulated seconds took ${took} s`); // never faster than the clock; later where the machine is
  assert.ok(Math.abs(speed(client).x - 0.3) < 0.02, "the scenario's command is followed");

  // One component alone: the others stay the scenario's.
  client.send({ op: "setParameters", id: "turn", parameters: [{ name: "command.wz_rad_s", value: 0.2 }] });
  await client.until(() => Math.abs(client.of("/odom").at(-1).message.twist.twist.angular.z - 0.2) < 0.05 && Math.abs(speed(client).x - 0.3) < 0.02, "turning while driving ahead");
  client.send({ op: "setParameters", id: "straight", parameters: [{ name: "command.wz_rad_s", value: 0.0 }] });

  // A command by parameters: to the left.
  client.send({ op: "setParameters", id: "left", parameters: [{ name: "command.vx_m_s", value: 0.0 }, { name: "command.vy_m_s", value: 0.2 }] });
  await client.until(() => client.texts.some(({ op, id }) => op === "parameterValues" && id === "left"), "the answer");
  await client.until(() => Math.abs(speed(client).y - 0.2) < 0.02 && Math.abs(speed(client).x) < 0.02, "driving to the left");

  // Another policy and torque limit, seen in the next states.
  client.send({ op: "setParameters", id: "more", parameters: [{ name: "control.policy", value: "independent" }, { name: "vehicle.motor.stall_torque_n_m", value: 1.25 }] });
  await client.until(() => {
    const state = client.of("/vehicle_state").at(-1).message;
    return state.policy === "independent" && state.wheels[0].limit_upper_n_m === 1.25;
  }, "the policy and the limit");

  // What is not allowed changes nothing, and the client is told why.
  client.send({ op: "setParameters", id: "bad", parameters: [{ name: "control.policy", value: "papier" }] });
  await client.until(() => client.texts.some(({ op, message }) => op === "status" && /"papier", allowed: independent, paper/.test(message)), "the reason");
  client.send({ op: "getParameters", id: "all", parameterNames: [] });
  await client.until(() => client.texts.some(({ op, id }) => op === "parameterValues" && id === "all"), "all parameters");
  const all = client.texts.find(({ op, id }) => op === "parameterValues" && id === "all").parameters;
  assert.deepEqual(Object.fromEntries(all.map(({ name, value }) => [name, value])), {
    "command.vx_m_s": 0, "command.vy_m_s": 0.2, "command.wz_rad_s": 0, "control.policy": "independent", "vehicle.motor.stall_torque_n_m": 1.25,
  });

  // A twist as a teleoperation panel publishes it.
  const definition = parse("geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n===\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z", { ros2: true });
  const twist = new MessageWriter(definition).writeMessage({ linear: { x: -0.1, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } });
  client.send({ op: "advertise", channels: [{ id: 7, topic: "/cmd_vel", encoding: "cdr", schemaName: "geometry_msgs/msg/Twist" }] });
  const header = Buffer.alloc(5);
  header.writeUInt8(1, 0);
  header.writeUInt32LE(7, 1);
  client.socket.send(Buffer.concat([header, twist]));
  await client.until(() => Math.abs(speed(client).x + 0.1) < 0.02, "driving backwards");

  // What is no twist, or beyond what a scenario may ask for, is refused with the reason.
  client.send({ op: "advertise", channels: [{ id: 8, topic: "/cmd_vel", encoding: "json", schemaName: "geometry_msgs/msg/TwistStamped" }, { id: 9, topic: "/cmd_vel", encoding: "json", schemaName: "geometry_msgs/msg/Twist" }] });
  for (const [id, text] of [[8, "{}"], [9, JSON.stringify({ linear: { x: 1e9, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } })]]) {
    const data = Buffer.alloc(5);
    data.writeUInt8(1, 0);
    data.writeUInt32LE(id, 1);
    client.socket.send(Buffer.concat([data, Buffer.from(text)]));
  }
  const refused = (pattern) => () => client.texts.some(({ op, message }) => op === "status" && pattern.test(message));
  await client.until(refused(/\/cmd_vel: geometry_msgs\/msg\/TwistStamped, allowed: geometry_msgs\/msg\/Twist/), "not a twist");
  await client.until(refused(/command\.vx_m_s: 1e9, allowed: -100 to 100/), "too fast");
  run.kill("SIGINT");
  await once(run, "exit");
});

test("a run ends with its scenario, faster than the clock if asked to, and prints its figures", async () => {
  const { run, address, printed } = await started("--set", "duration_s=30", "--speed", "inf");
  const client = await connected(address);
  const start = performance.now();
  await client.subscribe("/odom");
  const [code] = await once(run, "exit");
  assert.ok(performance.now() - start < 20_000, "30 s of simulation in less than 20");
  assert.equal(code, 0);
  assert.equal(JSON.parse(printed()).verdict, "driven");
});

test("a port that is taken is an error that names it", async () => {
  const { run, address } = await started("--set", "duration_s=600");
  const port = address.split(":").at(-1);
  const second = spawn(program, ["run", "flat", "--live", "--port", port]);
  let said = "";
  second.stderr.on("data", (data) => { said += data; });
  const [code] = await once(second, "exit");
  assert.equal(code, 2);
  assert.match(said, new RegExp(`^error: port ${port} on 127\\.0\\.0\\.1: `));
  run.kill("SIGINT");
  await once(run, "exit");
});
