// A live run: its figures, and who drives it.
"use strict";
(() => {
  const byId = (id) => document.getElementById(id);
  const root = document.documentElement;
  const TOPICS = { "/page/scene": 1, "/page/state": 2 };
  const COMMANDS = 1; // the number of our channel of commands
  const AGAIN_MS = 100, RECONNECT_MS = 2000;
  const MOST_POINTS = 3000, POINT_M = 0.005;
  let socket, scene, state, steer = false, service, drawn; // service: the number of the one that resets
  let camera = { scale: 300, zoom: 1, z: 0, most: 60, length: 0.7, way: [], odometry: [] };
  let pace = { clock: 0, time: 0, rate: 1 };

  // ---- looks
  const setTheme = (theme) => { root.dataset.theme = theme; byId("theme").textContent = theme === "dark" ? "Light" : "Dark"; drawn = undefined; };
  const dark = matchMedia("(prefers-color-scheme: dark)");
  setTheme(dark.matches ? "dark" : "light");
  dark.addEventListener("change", () => setTheme(dark.matches ? "dark" : "light"));
  byId("theme").addEventListener("click", () => setTheme(root.dataset.theme === "dark" ? "light" : "dark"));
  const text = (id, value) => { const element = byId(id); if (element.textContent !== value) element.textContent = value; };
  const number = (value, digits, unit) => {
    const shown = (value ?? NaN).toFixed(digits);
    return `${/^-0\.?0*$/.test(shown) ? shown.slice(1) : shown} ${unit}`;
  };

  // ---- figures
  const cell = (row, element) => row.appendChild(document.createElement("td")).appendChild(element);
  const bar = (both, label) => {
    const outer = document.createElement("div"), inner = document.createElement("i");
    outer.className = both ? "bar both" : "bar";
    for (const [name, value] of Object.entries({ role: "meter", "aria-label": label, "aria-valuemin": both ? -1 : 0, "aria-valuemax": 1, "aria-valuenow": 0 })) outer.setAttribute(name, value);
    outer.append(inner);
    return { outer, set: (part) => {
      const shown = Math.min(Math.max(part || 0, both ? -1 : 0), 1);
      inner.style.transform = `scaleX(${shown})`;
      outer.setAttribute("aria-valuenow", number(shown, 2, "").trim());
      outer.classList.toggle("full", both && Math.abs(part) >= 0.999);
    } };
  };
  let rows = [];
  const tabulate = () => {
    const body = document.querySelector("#wheels tbody");
    body.replaceChildren();
    rows = scene.wheels.map((disc, k) => {
      const row = body.appendChild(document.createElement("tr")), name = document.createElement("span"), speed = document.createElement("span");
      const [torque, slip, load] = ["Torque", "Slip", "Load"].map((what) => bar(what !== "Load", `${what} of wheel ${disc.name}`));
      name.textContent = `\u25cf ${disc.name}`;
      name.style.color = WHEEL_COLOURS[k % WHEEL_COLOURS.length];
      for (const element of [name, speed, torque.outer, slip.outer, load.outer]) cell(row, element);
      return { speed, torque, slip, load };
    });
  };
  const figures = () => {
    const [ahead, left, turning] = state.twist, [asked, askedLeft, askedTurning] = state.asked, [x, y] = state.poses[0];
    const both = (is, wanted, digits, unit) => `${number(is, digits, unit)} (command ${number(wanted, digits, "").trim()})`;
    text("time", `${number(state.time_s, 1, "s")}, ${number(pace.rate, 2, "times real time")}`);
    text("place", `${number(x, 3, "m")}, ${number(y, 3, "m")}, ${number(pictures.heading(state.poses[0]) * 180 / Math.PI, 0, "\u00b0")}`);
    text("ahead", both(ahead, asked, 2, "m/s"));
    text("left", both(left, askedLeft, 2, "m/s"));
    text("turning", both(turning, askedTurning, 2, "rad/s"));
    text("nose", number(Math.asin(Math.min(Math.max(pictures.turned(state.poses[0], [1, 0, 0])[2], -1), 1)) * 180 / Math.PI, 1, "\u00b0"));
    text("about", scene.policies_in_a_line[scene.policies.indexOf(state.policy)] ?? "");
    text("policy", `${state.policy}, ${Number(state.stall_torque_n_m.toPrecision(4))} N.m at most`);
    state.wheels.forEach((wheel, k) => {
      const { speed, torque, slip, load } = rows[k], [lower, upper] = wheel.limits_n_m;
      speed.textContent = number(wheel.speed_rad_s, 1, "");
      torque.set(wheel.torque_n_m < 0 ? -wheel.torque_n_m / lower : wheel.torque_n_m / upper);
      slip.set(wheel.slip);
      load.set(wheel.load_n / camera.most);
    });
    document.querySelectorAll("#policies button").forEach((button) => button.setAttribute("aria-pressed", String(button.textContent === state.policy)));
    if (document.activeElement !== byId("torque")) byId("torque").value = Number(state.stall_torque_n_m.toPrecision(6));
  };

  // ---- what the run sends
  const addPoint = (way, [x, y]) => {
    const last = way.at(-1);
    if (last && Math.hypot(x - last[0], y - last[1]) < POINT_M) return;
    way.push([x, y]);
    if (way.length > MOST_POINTS) way.shift();
  };
  const onScene = (next) => {
    const other = !scene || scene.scenario !== next.scenario || scene.vehicle !== next.vehicle;
    scene = next;
    document.title = `${scene.vehicle} on ${scene.scenario}: omnistep`;
    text("title", `${scene.vehicle} on ${scene.scenario}`);
    if (other) { camera = { ...camera, way: [], odometry: [] }; offer(); }
    tabulate();
    if (state?.wheels.length !== scene.wheels.length) state = undefined; // another vehicle of that name
    setFast();
  };
  const onState = (next) => {
    if (next.wheels.length !== scene?.wheels.length) return;
    const now = performance.now();
    if (next.time_s < (state?.time_s ?? 0)) camera = { ...camera, way: [], odometry: [] }; // another run on the same port
    if (now - pace.clock > 500 || next.time_s < pace.time) {
      const rate = (next.time_s - pace.time) / ((now - pace.clock) / 1000);
      pace = { clock: now, time: next.time_s, rate: pace.clock && rate >= 0 ? rate : 1 };
    }
    state = next;
    camera.length = pictures.size(scene, state);
    // Four times a wheel's usual load: a landing's peak is no measure for what comes after.
    const mean = state.wheels.reduce((total, { load_n: load }) => total + (load || 0), 0) / state.wheels.length;
    camera.most += 0.05 * (Math.max(4 * mean, 1) - camera.most);
    camera.z += 0.15 * (state.poses[0][2] - camera.z);
    addPoint(camera.way, state.poses[0]);
    addPoint(camera.odometry, odometryIn(state.poses));
    root.dataset.ready = "true";
  };
  // Where the wheels have the base: the frame of odometry is sent as the base sees it, and stood where the world's is at the start.
  const odometryIn = ([base, odom]) => {
    const back = [-odom[3], -odom[4], -odom[5], odom[6]];
    const at = pictures.turned([0, 0, 0, ...back], [base[0] - odom[0], base[1] - odom[1], base[2] - odom[2]]);
    return at;
  };
  const frame = () => {
    if (scene && state && drawn !== state) {
      drawn = state;
      const scale = () => byId("plan").clientWidth / (2.7 * camera.length) * camera.zoom;
      camera.scale = Math.min(scale(), byId("side").clientHeight / (0.9 * camera.length) * camera.zoom);
      pictures.side(byId("side"), scene, state, camera);
      pictures.plan(byId("plan"), scene, state, camera, root.dataset.theme);
      figures();
    }
    requestAnimationFrame(frame);
  };
  const zoomed = (event) => {
    event.preventDefault();
    camera.zoom = Math.min(Math.max(camera.zoom * Math.exp(-event.deltaY / 500), 0.2), 5);
    drawn = undefined;
  };
  for (const id of ["side", "plan"]) byId(id).addEventListener("wheel", zoomed, { passive: false });
  addEventListener("resize", () => { drawn = undefined; });

  // ---- the connection: Foxglove's protocol, with two topics of ours in JSON
  const say = (message) => { if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message)); };
  const onText = (message) => {
    if (message.op === "serverInfo") {
      steer = message.capabilities.includes("clientPublish");
      service = undefined; // that of another run
      byId("steering").hidden = !steer;
      byId("watched").hidden = steer;
      if (steer) say({ op: "advertise", channels: [{ id: COMMANDS, topic: "/cmd_vel", encoding: "json", schemaName: "geometry_msgs/msg/Twist" }] });
    } else if (message.op === "advertise") {
      const ours = message.channels.filter(({ topic }) => topic in TOPICS);
      say({ op: "subscribe", subscriptions: ours.map(({ id, topic }) => ({ id: TOPICS[topic], channelId: id })) });
    } else if (message.op === "advertiseServices") {
      service = message.services.find(({ name }) => name === "/omnistep/reset")?.id;
    } else if (message.op === "status" && message.level === 2) text("said", message.message);
  };
  const onBytes = (bytes) => {
    const view = new DataView(bytes);
    if (view.getUint8(0) !== 1) return;
    const next = JSON.parse(new TextDecoder().decode(bytes.slice(13)));
    if (view.getUint32(1, true) === TOPICS["/page/scene"]) onScene(next); else onState(next);
  };
  const connect = () => {
    socket = new WebSocket(`ws://${location.host}/`, "foxglove.sdk.v1");
    socket.binaryType = "arraybuffer";
    socket.addEventListener("open", () => { text("link", "The run is live."); byId("link").classList.remove("gone"); });
    socket.addEventListener("message", ({ data }) => (typeof data === "string" ? onText(JSON.parse(data)) : onBytes(data)));
    socket.addEventListener("close", () => {
      controls.letGo();
      text("link", "The run has ended or cannot be reached. Waiting for another run.");
      byId("link").classList.add("gone");
      setTimeout(connect, RECONNECT_MS);
    });
  };

  // ---- driving
  let asked = [0, 0, 0]; // parts of the speed
  const publish = ([x, y, turn]) => {
    const twist = JSON.stringify({ linear: { x, y, z: 0 }, angular: { x: 0, y: 0, z: turn } });
    const bytes = new Uint8Array(5 + twist.length);
    const view = new DataView(bytes.buffer);
    view.setUint8(0, 1);
    view.setUint32(1, COMMANDS, true);
    bytes.set(new TextEncoder().encode(twist), 5);
    if (socket?.readyState === WebSocket.OPEN) socket.send(bytes);
  };
  const moves = () => asked.some((part) => part !== 0);
  const command = () => {
    if (steer && scene) publish(asked.map((part, k) => part * scene.pace[k] * Number(byId("fast").value)));
  };
  const controls = new Controls(byId("pad"), byId("stop"), (parts) => {
    asked = parts;
    if (moves()) text("said", "");
    command();
  });
  // A call of a service: its number, that of the call, and an encoding before what is said.
  const reset = () => {
    if (socket?.readyState !== WebSocket.OPEN || service === undefined) return;
    controls.letGo();
    text("said", "");
    const encoding = new TextEncoder().encode("json"), view = new DataView(new ArrayBuffer(13 + encoding.length + 2));
    view.setUint8(0, 2);
    [service, 1, encoding.length].forEach((value, k) => view.setUint32(1 + 4 * k, value, true));
    new Uint8Array(view.buffer).set([...encoding, ...new TextEncoder().encode("{}")], 13);
    socket.send(view.buffer);
  };
  byId("reset").addEventListener("click", reset);
  addEventListener("keydown", ({ code, repeat, target, ctrlKey, metaKey, altKey }) => {
    if (code === "KeyR" && !(repeat || ctrlKey || metaKey || altKey || target.closest?.("input, select, pre"))) reset();
  });
  // Again and again while something is held.
  setInterval(() => { if (moves()) command(); }, AGAIN_MS);

  // ---- settings
  const set = (name, value) => { text("said", ""); say({ op: "setParameters", parameters: [{ name, value }] }); };
  const setFast = () => text("faster", scene ? number(scene.pace[0] * Number(byId("fast").value), 2, "m/s") : "");
  byId("fast").addEventListener("input", setFast);
  byId("fast").addEventListener("pointerup", () => byId("fast").blur()); // arrows drive again
  byId("torque").addEventListener("change", () => { set("vehicle.motor.stall_torque_n_m", Number(byId("torque").value)); byId("torque").blur(); });
  const offer = () => byId("policies").replaceChildren(...scene.policies.map((policy, k) => {
    const button = document.createElement("button");
    Object.assign(button, { type: "button", textContent: policy, title: scene.policies_in_a_line[k] });
    button.addEventListener("click", () => set("control.policy", policy));
    return button;
  }));

  connect();
  requestAnimationFrame(frame);
})();
