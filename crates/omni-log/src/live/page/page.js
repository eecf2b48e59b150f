// A live run: its figures, and who drives it.
"use strict";
(() => {
  const byId = (id) => document.getElementById(id);
  const root = document.documentElement;
  const TOPICS = { "/page/scene": 1, "/page/state": 2 };
  const COMMANDS = 1; // the number of our channel of commands
  const AGAIN_MS = 100, MOMENT_MS = 400, RECONNECT_MS = 2000;
  const MOST_POINTS = 3000, POINT_M = 0.005;
  let socket, scene, state, steer = false, drawn;
  let camera = { scale: 300, zoom: 1, z: 0, most: 60, length: 0.7, way: [], odometry: [] };
  let pace = { clock: 0, time: 0, rate: 1 };

  // ---- looks
  const setTheme = (theme) => { root.dataset.theme = theme; drawn = undefined; };
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
  const bar = (both) => {
    const outer = document.createElement("div"), inner = document.createElement("i");
    outer.className = both ? "bar both" : "bar";
    outer.append(inner);
    return { outer, set: (part) => {
      inner.style.transform = `scaleX(${Math.min(Math.max(part || 0, both ? -1 : 0), 1)})`;
      outer.classList.toggle("full", both && Math.abs(part) >= 0.999);
    } };
  };
  let rows = [];
  const tabulate = () => {
    const body = document.querySelector("#wheels tbody");
    body.replaceChildren();
    rows = scene.wheels.map((disc, k) => {
      const row = body.appendChild(document.createElement("tr")), name = document.createElement("span"), speed = document.createElement("span");
      const [torque, slip, load] = [bar(true), bar(true), bar(false)];
      name.textContent = `\u25cf ${disc.name}`;
      name.style.color = pictures.palette[k % 8];
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
  const onScene = (told) => {
    const other = !scene || scene.scenario !== told.scenario || scene.vehicle !== told.vehicle;
    scene = told;
    document.title = `${scene.vehicle} on ${scene.scenario}: omnistep`;
    text("title", `${scene.vehicle} on ${scene.scenario}`);
    if (other) { camera = { ...camera, way: [], odometry: [] }; offer(); }
    tabulate();
    if (state?.wheels.length !== scene.wheels.length) state = undefined; // another vehicle of that name
    setFast();
  };
  const onState = (told) => {
    if (told.wheels.length !== scene?.wheels.length) return;
    const now = performance.now();
    if (told.time_s < (state?.time_s ?? 0)) camera = { ...camera, way: [], odometry: [] }; // another run on the same port
    if (now - pace.clock > 500 || told.time_s < pace.time) {
      const rate = (told.time_s - pace.time) / ((now - pace.clock) / 1000);
      pace = { clock: now, time: told.time_s, rate: pace.clock && rate >= 0 ? rate : 1 };
    }
    state = told;
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
      byId("steering").hidden = !steer;
      byId("watched").hidden = steer;
      if (steer) say({ op: "advertise", channels: [{ id: COMMANDS, topic: "/cmd_vel", encoding: "json", schemaName: "geometry_msgs/msg/Twist" }] });
    } else if (message.op === "advertise") {
      const ours = message.channels.filter(({ topic }) => topic in TOPICS);
      say({ op: "subscribe", subscriptions: ours.map(({ id, topic }) => ({ id: TOPICS[topic], channelId: id })) });
    } else if (message.op === "status" && message.level === 2) text("said", message.message);
  };
  const onBytes = (bytes) => {
    const view = new DataView(bytes);
    if (view.getUint8(0) !== 1) return;
    const told = JSON.parse(new TextDecoder().decode(bytes.slice(13)));
    if (view.getUint32(1, true) === TOPICS["/page/scene"]) onScene(told); else onState(told);
  };
  const connect = () => {
    socket = new WebSocket(`ws://${location.host}/`, "foxglove.sdk.v1");
    socket.binaryType = "arraybuffer";
    socket.addEventListener("open", () => { text("link", "The run is live."); byId("link").classList.remove("gone"); });
    socket.addEventListener("message", ({ data }) => (typeof data === "string" ? onText(JSON.parse(data)) : onBytes(data)));
    socket.addEventListener("close", () => {
      letGo();
      text("link", "The run has ended or cannot be reached. Waiting for another run.");
      byId("link").classList.add("gone");
      setTimeout(connect, RECONNECT_MS);
    });
  };

  // ---- driving
  const KEYS = {
    ArrowUp: [1, 0, 0], KeyW: [1, 0, 0], ArrowDown: [-1, 0, 0], KeyS: [-1, 0, 0],
    ArrowLeft: [0, 1, 0], KeyA: [0, 1, 0], ArrowRight: [0, -1, 0], KeyD: [0, -1, 0], KeyQ: [0, 0, 1], KeyE: [0, 0, -1],
  };
  const held = new Map(); // what is held down, and what it asks for
  let moving = false, padded = true;
  const letGo = () => {
    held.clear();
    document.querySelectorAll("#pad button[aria-pressed]").forEach((button) => button.removeAttribute("aria-pressed"));
    command();
  };
  // Whoever drives: another page, a terminal. A stick that is held has to come back to the middle first.
  const stop = () => {
    padded = false;
    letGo();
    if (steer) publish([0, 0, 0]);
  };
  // The left stick drives, the right one turns.
  const gamepad = () => {
    const pad = document.hasFocus() ? (navigator.getGamepads?.() ?? []).find((each) => each?.connected) : null;
    const axis = (k) => { const value = pad?.axes[k] ?? 0; return Math.abs(value) < 0.15 ? 0 : -value; };
    const stick = [axis(1), axis(0), axis(2)];
    padded ||= stick.every((part) => part === 0);
    return padded ? stick : [0, 0, 0];
  };
  const wanted = () => {
    const all = [gamepad(), ...held.values()];
    return [0, 1, 2].map((k) => Math.min(Math.max(all.reduce((total, each) => total + each[k], 0), -1), 1));
  };
  const publish = ([x, y, turn]) => {
    const twist = JSON.stringify({ linear: { x, y, z: 0 }, angular: { x: 0, y: 0, z: turn } });
    const bytes = new Uint8Array(5 + twist.length);
    const view = new DataView(bytes.buffer);
    view.setUint8(0, 1);
    view.setUint32(1, COMMANDS, true);
    bytes.set(new TextEncoder().encode(twist), 5);
    if (socket?.readyState === WebSocket.OPEN) socket.send(bytes);
  };
  // Again and again while something is held, and once when nothing is any more.
  const command = () => {
    if (!steer || !scene) return;
    const ask = wanted(), moves = ask.some((part) => part !== 0);
    if (moves || moving) publish(ask.map((part, k) => part * scene.pace[k] * Number(byId("fast").value)));
    moving = moves;
  };
  setInterval(command, AGAIN_MS);
  const typing = (target) => target instanceof HTMLInputElement;
  addEventListener("keydown", (event) => {
    // While one of these is down, or a menu is open, other keys may come up untold.
    if (event.ctrlKey || event.metaKey || event.altKey) { if (held.size > 0) letGo(); return; }
    const number = event.target.type === "number";
    if (event.code === "Space" && !number) { event.preventDefault(); stop(); return; }
    if (!(event.code in KEYS) || typing(event.target)) return;
    event.preventDefault();
    if (event.repeat) return; // a key that is held through a stop stays without effect
    held.set(event.code, KEYS[event.code]);
    text("said", "");
    command();
  });
  addEventListener("keyup", (event) => {
    if (event.code === "Space" && event.target instanceof HTMLButtonElement) event.preventDefault(); // it stops, it presses nothing
    if (held.delete(event.code)) command();
  });
  for (const gone of ["blur", "pagehide", "contextmenu"]) addEventListener(gone, letGo);
  document.addEventListener("visibilitychange", () => { if (document.hidden) letGo(); });
  document.querySelectorAll("#pad button[data-twist]").forEach((button) => {
    const twist = button.dataset.twist.split(" ").map(Number);
    button.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      button.setPointerCapture(event.pointerId);
      button.setAttribute("aria-pressed", "true");
      held.set(button, twist);
      command();
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) button.addEventListener(end, () => {
      button.removeAttribute("aria-pressed");
      if (held.delete(button)) command();
    });
    // Pressed by Enter, or by a screen reader: for a moment.
    button.addEventListener("click", ({ detail }) => {
      if (detail !== 0) return;
      held.set(button, twist);
      command();
      setTimeout(() => { if (held.delete(button)) command(); }, MOMENT_MS);
    });
    button.addEventListener("contextmenu", (event) => event.preventDefault());
  });
  byId("stop").addEventListener("pointerdown", stop);
  byId("stop").addEventListener("click", stop);

  // ---- settings
  const set = (name, value) => { text("said", ""); say({ op: "setParameters", parameters: [{ name, value }] }); };
  const setFast = () => text("faster", scene ? number(scene.pace[0] * Number(byId("fast").value), 2, "m/s") : "");
  byId("fast").addEventListener("input", setFast);
  byId("fast").addEventListener("pointerup", () => byId("fast").blur()); // arrows drive again
  byId("torque").addEventListener("change", () => { set("vehicle.motor.stall_torque_n_m", Number(byId("torque").value)); byId("torque").blur(); });
  const offer = () => byId("policies").replaceChildren(...scene.policies.map((policy) => {
    const button = document.createElement("button");
    Object.assign(button, { type: "button", textContent: policy });
    button.addEventListener("click", () => set("control.policy", policy));
    return button;
  }));

  connect();
  requestAnimationFrame(frame);
})();
