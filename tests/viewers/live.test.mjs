// A live run watched and steered by clients of its own, and what those are refused who may not: OMNISTEP=path/to/omnistep node --test live.test.mjs
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import net from "node:net";
import { after, test } from "node:test";
import { parse } from "@foxglove/rosmsg";
import { MessageReader, MessageWriter } from "@foxglove/rosmsg2-serialization";
import WebSocket from "ws";

const program = process.env.OMNISTEP;
// Whatever failed, nothing goes on.
const runs = [];
after(() => runs.forEach((run) => run.kill("SIGKILL")));

// The run, its address, and what it said and printed; with so many files to open, if `files` is given.
async function started(...args) {
  return startedWith({}, ...args);
}

async function startedWith({ files }, ...args) {
  const command = [program, "run", "flat", "--live", "--port", "0", "--json", ...args];
  const run = files ? spawn("sh", ["-c", `ulimit -n ${files}; exec "$@"`, "sh", ...command]) : spawn(command[0], command.slice(1));
  runs.push(run);
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
  return { run, address, printed: () => printed, said: () => said, port: Number(address.split(":").at(-1)) };
}

// A client of Foxglove's protocol that decodes what it subscribed to.
async function connected(address, options) {
  const socket = new WebSocket(address, "foxglove.sdk.v1", options);
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

// What an upgrade is answered: 101, or the status and the reason.
const answered = (address, options) => new Promise((resolve, reject) => {
  const socket = new WebSocket(address, "foxglove.sdk.v1", options);
  socket.on("open", () => { socket.terminate(); resolve({ status: 101, reason: "" }); });
  socket.on("unexpected-response", (_, response) => {
    let reason = "";
    response.on("data", (data) => { reason += data; });
    response.on("end", () => resolve({ status: response.statusCode, reason }));
  });
  socket.on("error", reject);
});

// Sends it ten times a second, as a teleoperation panel does, until it is stopped.
const repeating = (send) => {
  send();
  const timer = setInterval(send, 100);
  return () => clearInterval(timer);
};

const publishing = (client, id, data) => {
  const header = Buffer.alloc(5);
  header.writeUInt8(1, 0);
  header.writeUInt32LE(id, 1);
  client.socket.send(Buffer.concat([header, data]));
};
const jsonTwist = (x) => Buffer.from(JSON.stringify({ linear: { x, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } }));
const announced = (client, id) => client.send({ op: "advertise", channels: [{ id, topic: "/cmd_vel", encoding: "json", schemaName: "geometry_msgs/msg/Twist" }] });
const reported = (client, pattern) => () => client.texts.some(({ op, message }) => op === "status" && pattern.test(message));

const asked = (client) => client.of("/cmd_vel").at(-1)?.message.twist.linear.x;
const speed = (client) => client.of("/ground_truth/odom").at(-1).message.twist.twist.linear;

test("a client watches a run in step with the clock and changes command, policy and torque limit", async () => {
  const { run, address } = await started("--wait", "--allow-control", "--set", "duration_s=600");
  const client = await connected(address);
  const ofServer = () => client.texts.find(({ op }) => op === "serverInfo");
  await client.until(() => ofServer() !== undefined, "the server's greeting");
  const info = ofServer();
  assert.ok(info.capabilities.includes("parameters") && info.capabilities.includes("clientPublish"));
  for (const topic of ["/robot_description", "/ground_truth/odom", "/vehicle_state", "/tf", "/markers"]) await client.subscribe(topic);

  // Descriptions come to late subscribers; a second takes a second.
  await client.until(() => client.of("/robot_description").length > 0, "the robot's description");
  assert.match(client.of("/robot_description")[0].message.data, /^<robot name="chugo7"/);
  await client.until(() => client.of("/ground_truth/odom").length >= 5, "poses");
  const [clock, simulated] = [performance.now(), client.of("/ground_truth/odom").at(-1).time];
  await client.until(() => Number(client.of("/ground_truth/odom").at(-1).time - simulated) >= 2e9, "two seconds");
  const took = (performance.now() - clock) / 1000;
  assert.ok(took > 1.8 && took < 4, `2 simulated seconds took ${took} s`); // never faster than the clock; later where the machine is
  assert.ok(Math.abs(speed(client).x - 0.3) < 0.02, "the scenario's command is followed");

  // One component alone: the others stay the scenario's.
  let stop = repeating(() => client.send({ op: "setParameters", id: "turn", parameters: [{ name: "command.wz_rad_s", value: 0.2 }] }));
  await client.until(() => Math.abs(client.of("/ground_truth/odom").at(-1).message.twist.twist.angular.z - 0.2) < 0.05 && Math.abs(speed(client).x - 0.3) < 0.02, "turning while driving ahead");
  stop();
  client.send({ op: "setParameters", id: "straight", parameters: [{ name: "command.wz_rad_s", value: 0.0 }] });

  // A command by parameters: to the left.
  stop = repeating(() => client.send({ op: "setParameters", id: "left", parameters: [{ name: "command.vx_m_s", value: 0.0 }, { name: "command.vy_m_s", value: 0.2 }] }));
  await client.until(() => client.texts.some(({ op, id }) => op === "parameterValues" && id === "left"), "the answer");
  await client.until(() => Math.abs(speed(client).y - 0.2) < 0.02 && Math.abs(speed(client).x) < 0.02, "driving to the left");

  // Another policy and torque limit, seen in the next states.
  client.send({ op: "setParameters", id: "more", parameters: [{ name: "control.policy", value: "independent" }, { name: "vehicle.motor.stall_torque_n_m", value: 1.25 }] });
  await client.until(() => {
    const state = client.of("/vehicle_state").at(-1).message;
    return state.policy === "independent" && state.wheels[0].limit_upper_n_m === 1.25;
  }, "the policy and the limit");

  // What is not allowed changes nothing, and the client gets the reason.
  client.send({ op: "setParameters", id: "bad", parameters: [{ name: "control.policy", value: "scale_torque" }] });
  await client.until(() => client.texts.some(({ op, message }) => op === "status" && /"scale_torque" \(did you mean "scale_torques"\?\), allowed: auto, independent, scale_torques/.test(message)), "the reason");
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
  stop();
  stop = repeating(() => publishing(client, 7, Buffer.from(twist)));
  await client.until(() => Math.abs(speed(client).x + 0.1) < 0.02, "driving backwards");
  stop();

  // What is no twist, or beyond what a scenario may ask for, is refused with the reason.
  client.send({ op: "advertise", channels: [{ id: 8, topic: "/cmd_vel", encoding: "json", schemaName: "geometry_msgs/msg/TwistStamped" }, { id: 9, topic: "/cmd_vel", encoding: "json", schemaName: "geometry_msgs/msg/Twist" }] });
  publishing(client, 8, Buffer.from("{}"));
  publishing(client, 9, jsonTwist(1e9));
  await client.until(reported(client, /\/cmd_vel: geometry_msgs\/msg\/TwistStamped, allowed: geometry_msgs\/msg\/Twist/), "not a twist");
  await client.until(reported(client, /command\.vx_m_s: 1e9, allowed: -100 to 100/), "too fast");
  run.kill("SIGINT");
  await once(run, "exit");
});

test("a run ends with its scenario, faster than the clock if asked to, and prints its metrics", async () => {
  const { run, address, printed } = await started("--wait", "--set", "duration_s=30", "--real-time-factor", "inf");
  const client = await connected(address);
  const start = performance.now();
  await client.subscribe("/ground_truth/odom");
  const [code] = await once(run, "exit");
  assert.ok(performance.now() - start < 20_000, "30 s of simulation in less than 20");
  assert.equal(code, 0);
  assert.equal(JSON.parse(printed()).verdict, "completed");
});

test("a port that is taken is an error that names it", async () => {
  const { run, port } = await started("--set", "duration_s=600");
  const second = spawn(program, ["run", "flat", "--live", "--port", String(port)]);
  let said = "";
  second.stderr.on("data", (data) => { said += data; });
  const [code] = await once(second, "exit");
  assert.equal(code, 2);
  assert.match(said, new RegExp(`^error: port ${port} on 127\\.0\\.0\\.1: `));
  run.kill("SIGINT");
  await once(run, "exit");
});

test("a command ends half a second after its last message, and with its client: the vehicle comes to rest", async () => {
  const { run, address } = await started("--allow-control", "--set", "duration_s=600");
  const watching = await connected(address), steering = await connected(address);
  for (const topic of ["/ground_truth/odom", "/cmd_vel"]) await watching.subscribe(topic);
  announced(steering, 1);

  // Once, and then silence.
  publishing(steering, 1, jsonTwist(-0.3));
  await watching.until(() => asked(watching) === -0.3, "the command");
  const from = performance.now();
  await watching.until(() => asked(watching) === 0, "rest is commanded");
  // From the command's first sample (50 Hz) to rest's; late by what the machine is busy with, never early by more than a sample.
  assert.ok(performance.now() - from > 400, `after ${performance.now() - from} ms`);
  await watching.until(reported(watching, /^no command for 0\.5 s: the vehicle is commanded to stop$/), "why");
  await watching.until(() => Math.abs(speed(watching).x) < 0.01, "rest");

  // Commanded repeatedly it drives; the parameter counts as a command too.
  let stop = repeating(() => steering.send({ op: "setParameters", parameters: [{ name: "command.vx_m_s", value: -0.2 }] }));
  await watching.until(() => Math.abs(speed(watching).x + 0.2) < 0.02, "driving by parameters");
  stop();
  await watching.until(() => asked(watching) === 0 && Math.abs(speed(watching).x) < 0.01, "rest again");

  // Cut in the middle of a drive.
  stop = repeating(() => publishing(steering, 1, jsonTwist(-0.3)));
  await watching.until(() => Math.abs(speed(watching).x + 0.3) < 0.02, "driving backwards");
  stop();
  publishing(steering, 1, jsonTwist(-0.3));
  steering.socket.terminate();
  await watching.until(reported(watching, /^the commanding client disconnected: the vehicle is commanded to stop$/), "its end is noticed");
  await watching.until(() => asked(watching) === 0 && Math.abs(speed(watching).x) < 0.01, "rest at last");
  run.kill("SIGINT");
  await once(run, "exit");
});

test("a service begins the run anew for every client, and one that does not exist is refused with its name", async () => {
  const { run, address } = await started("--allow-control", "--set", "duration_s=600");
  const client = await connected(address);
  await client.until(() => client.texts.some(({ op }) => op === "advertiseServices"), "the services");
  const { services } = client.texts.find(({ op }) => op === "advertiseServices");
  assert.deepEqual(services.map(({ name, type }) => [name, type]), [["/omnistep/reset", "std_srvs/srv/Empty"]]);
  const call = (service, number) => {
    const header = Buffer.alloc(13);
    header.writeUInt8(2, 0);
    [service, number, 4].forEach((value, k) => header.writeUInt32LE(value, 1 + 4 * k));
    client.socket.send(Buffer.concat([header, Buffer.from("json{}")]));
  };
  await client.subscribe("/ground_truth/odom");
  await client.subscribe("/markers");
  const odom = () => client.of("/ground_truth/odom");
  await client.until(() => odom().length > 0 && odom().at(-1).message.pose.pose.position.x > 0.1, "a drive of 0.1 m");
  call(services[0].id, 7);
  const isDeleteAll = ({ message }) => message.markers.some(({ action }) => action === 3);
  await client.until(() => client.of("/markers").some(isDeleteAll), "the marks of the run before to go");
  await client.until(() => odom().at(-1).time < odom()[0].time || odom().at(-1).message.pose.pose.position.x < 0.05, "the start");
  // It follows its scenario again, because no command came.
  await client.until(() => odom().at(-1).message.pose.pose.position.x > 0.1, "the same drive");
  call(services[0].id + 1, 8);
  const failure = () => client.texts.find(({ op }) => op === "serviceCallFailure");
  await client.until(() => failure() !== undefined, "the refusal");
  assert.deepEqual([failure().callId, failure().message], [8, `service ${services[0].id + 1}: it does not exist, allowed: ${services[0].id}, /omnistep/reset`]);
  run.kill("SIGINT");
  await once(run, "exit");
});

test("without --allow-control nothing that steers is offered, and who tries is refused with the reason", async () => {
  const { run, address } = await started("--set", "duration_s=600");
  const client = await connected(address);
  await client.subscribe("/cmd_vel");
  await client.until(() => client.of("/cmd_vel").length > 0, "the run goes on");
  assert.deepEqual(client.texts.find(({ op }) => op === "serverInfo").capabilities, []);
  const tries = [
    () => client.send({ op: "setParameters", id: "a", parameters: [{ name: "command.vx_m_s", value: -0.3 }] }),
    () => client.send({ op: "getParameters", id: "b", parameterNames: [] }),
    () => announced(client, 1),
    () => publishing(client, 1, jsonTwist(-0.3)),
  ];
  for (const [k, attempt] of tries.entries()) {
    attempt();
    await client.until(() => client.texts.filter(({ op, message }) => op === "status" && /start it with --allow-control$/.test(message)).length === k + 1, `refusal ${k + 1}`);
  }
  const seen = client.of("/cmd_vel").length;
  await client.until(() => client.of("/cmd_vel").length > seen + 10, "more commands");
  // The scenario's, which rises to 0.3, all the time; never rest, never what was tried.
  const asked = client.of("/cmd_vel").map(({ message }) => message.twist.linear.x);
  assert.ok(asked.every((vx, k) => vx > 0 && vx >= (asked[k - 1] ?? 0)), String(asked));
  run.kill("SIGINT");
  await once(run, "exit");
});

test("a page of elsewhere is refused with the reason, by name and by address", async () => {
  const { run, address, port, said } = await started("--set", "duration_s=600", "--allow-origin", "https://viewer.example");
  for (const options of [{}, { origin: "http://localhost:8080" }, { origin: "https://app.foxglove.dev" }, { origin: "https://viewer.example" }, { headers: { Host: `localhost:${port}` } }])
    assert.equal((await answered(address, options)).status, 101, JSON.stringify(options));
  assert.deepEqual(await answered(address, { origin: "https://evil.example" }), { status: 403, reason: "a page from https://evil.example: allow it with --allow-origin https://evil.example\n" });
  assert.deepEqual(await answered(address, { headers: { Host: "evil.example" } }), { status: 403, reason: "Host evil.example, allowed: localhost, 127.0.0.1 or [::1]\n" });
  assert.equal((await answered(address, { origin: "null" })).status, 403);
  assert.match(said(), /^live: rejected a page from https:\/\/evil\.example: allow it with --allow-origin https:\/\/evil\.example$/m);
  run.kill("SIGINT");
  await once(run, "exit");
});

test("idle sockets keep no viewer out, not even where the process may open few files", async () => {
  const { run, address, port } = await startedWith({ files: 40 }, "--set", "duration_s=600");
  const idle = await Promise.all(Array.from({ length: 50 }, async () => {
    const socket = net.connect(port, "127.0.0.1");
    socket.on("error", () => {});
    await once(socket, "connect");
    return socket;
  }));
  const client = await connected(address);
  await client.subscribe("/ground_truth/odom");
  await client.until(() => client.of("/ground_truth/odom").length > 0, "poses");
  for (const socket of idle) socket.destroy();
  run.kill("SIGINT");
  await once(run, "exit");
});

test("who does not end its handshake is closed, and who is one viewer too many gets the reason", async () => {
  const { run, address, port } = await started("--set", "duration_s=600");
  const half = net.connect(port, "127.0.0.1", () => half.write("GET / HTTP/1.1\r\nHost: localhost\r\n"));
  half.on("error", () => {});
  half.resume();
  const closed = once(half, "close"), from = performance.now();
  const clients = []; // one after the other: sixteen handshakes at a time would end the half one's wait
  while (clients.length < 16) clients.push(await connected(address));
  assert.deepEqual(await answered(address, {}), { status: 503, reason: "16 viewers are connected, the largest number allowed\n" });
  clients[0].socket.terminate();
  let status = 503; // until the server has noticed
  while (status === 503) ({ status } = await answered(address, {}));
  assert.equal(status, 101);
  await closed;
  assert.ok(performance.now() - from > 9_000, "a slow client has its ten seconds");
  run.kill("SIGINT");
  await once(run, "exit");
});
