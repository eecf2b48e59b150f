// The playground's page: what is chosen, who drives, what is shown.
import { Player, runColour, WHEEL_COLOURS } from "../player/index.js";
import { Controls } from "../shared.js";
import { aboutFile, opened as openedFile, settingsOf, withFile } from "./own.js";
import { Path } from "./path.js";
import { address, blamed, commandLine, EXAMPLES, leadOf, read, requests } from "./settings.js";
import { number, showOutcomes, Wheels } from "./tables.js";

const byId = (id) => document.getElementById(id);
const root = document.documentElement;
const text = (id, what) => { if (byId(id).textContent !== what) byId(id).textContent = what; };
const FIELDS = ["scenario", "vehicle", "policy", "against", "torque", "friction", "height", "engine", "model"];
/** The setting of a field, where it has another name than the field. */
const SETTING = { model: "wheels" };
/** Length of the arrow of a force [m/N]: as in the markers of a log. */
const METRES_PER_NEWTON = 0.005;

let offer, settings, asked = []; // asked: a request a run
let player, scene, latest, paths = []; // latest: states as text that are not drawn yet
let own; // a file in the place of a built-in vehicle or scenario
let starts = false; // the next run begins by itself
let opening = false; // a run was asked for, and is not there yet
let mode = "loading"; // opening, ready, running, paused, ended
let tables = []; // of a driven run: its commands
let driven = false, slow = false, pace = [0, 0, 0];
const wheels = new Wheels(byId("wheels"));
const dark = () => root.dataset.theme === "dark";
const policies = () => asked.map(({ policy }) => policy);

// ---- the simulation, beside the page
let worker;
const say = (type, sent = {}) => worker.postMessage({ type, ...sent });
const refused = (sent) => {
  const line = aboutFile(sent, own), about = blamed(line);
  if (opening && about) wrongAt(about.field, about.what);
  else text("said", line);
  written("");
  if (opening || !["running", "paused"].includes(mode)) none(about ? NOT_ALLOWED : "");
  else setMode("ended");
};

const NOT_ALLOWED = "There is no run: a setting is not allowed.";
/** There is no run: nothing of an earlier one stays but its picture, which is faint. */
const none = (why) => {
  opening = false;
  byId("commands").replaceChildren();
  clearOutcome();
  text("until", "There is no run.");
  // What the ground of an earlier run does not have, the next one may have.
  for (const field of ["friction", "height"]) byId(field).disabled = false;
  for (const id of ["time", "rate", "place", "ahead"]) text(id, "-");
  latest = undefined;
  setMode("refused");
  text("status", why);
};
/** What becomes of a log, at its start and at its end; between them only a bar moves, which is not announced. */
const written = (what, part) => {
  text("writing", what);
  byId("part").hidden = part === undefined;
  byId("part").value = part ?? 0;
  setButtons(part !== undefined);
};
const clearOutcome = () => { for (const id of ["outcome", "meanings"]) byId(id).hidden = true; };

const setMode = (now) => {
  mode = now;
  root.dataset.mode = now;
  text("run", { running: "Pause", ended: "Run again" }[now] ?? "Run");
  byId("run").disabled = !["ready", "running", "paused", "ended"].includes(now);
  byId("step").disabled = !["ready", "paused"].includes(now);
  byId("reset").disabled = !["running", "paused", "ended"].includes(now);
  const lines = { ready: "Ready: press Run.", running: whoDrives(), paused: "Paused.", ended: "The run has ended.", opening: "Preparing the run." };
  if (now in lines) text("status", lines[now]);
};

// Once a run: a rate that goes up and down is shown, and not said again and again.
const whoDrives = () => (slow ? SLOW : driven ? "You drive." : "The command of the scenario drives.");
const SLOW = "This machine is too slow: it simulates slower than real time.";

const on = {
  offer({ offer: sent }) {
    offer = sent;
    fill();
    // Without settings the first example runs by itself, unless the reader wants no motion.
    starts = location.hash.length <= 1 && !matchMedia("(prefers-reduced-motion: reduce)").matches;
    fromAddress();
  },
  opened({ scene: sent, settings: has, requests: whole }) {
    opening = false;
    asked = whole;
    byId("model").value = has.wheels;
    text("model-note", noteOf(has));
    scene = { ...sent, runs: asked.map(({ policy }) => ({ name: policy })), metres_per_newton: METRES_PER_NEWTON, side_by_side: true };
    pace = sent.pace;
    paths = asked.map(() => new Path());
    latest = undefined;
    tables = [];
    driven = slow = false;
    for (const field of ["torque", "friction", "height"]) byId(field).placeholder = has[field] === null ? "" : String(Number(has[field].toPrecision(6)));
    byId("height").disabled = has.height === null;
    byId("friction").disabled = has.friction === null;
    if (own?.kind !== "scenario") byId("vehicle").options[0].textContent = `${offer.scenarios[settings.scenario].vehicle} (of the scenario)`;
    else if (settings.vehicle === undefined) byId("vehicle").options[0].textContent = `${has.vehicle} (of the scenario)`;
    if (player) player.setScene(scene);
    else player = new Player(byId("player"), scene, { dark: dark(), shiftTurns: true });
    asked.forEach((_, k) => root.style.setProperty(`--run${k}`, runColour(k, dark())));
    wheels.setScene(scene.wheels.map((wheel, k) => ({ ...wheel, colour: WHEEL_COLOURS[k % WHEEL_COLOURS.length] })), policies());
    clearOutcome();
    text("until", "The metrics come when the run ends or is paused.");
    showSpeed();
    offerCommands();
    setMode("ready");
    if (starts && !document.hidden) goOn();
    starts = false;
  },
  state(sent) {
    latest = sent;
    if (mode !== "running") return;
    slow ||= sent.slow;
    text("status", whoDrives());
  },
  paused({ outcomes }) { stopped("paused", outcomes); },
  ended({ outcomes }) { stopped("ended", outcomes); },
  refused({ line, about }) {
    if (about === "log") written(`There is no log: ${line}`); // the run itself is as it was
    else refused(line);
  },
  writing({ part }) { byId("part").value = part; },
  log({ name, file, csv }) {
    if (csv) save(new Blob([csv], { type: "text/csv" }), "drive.csv");
    save(file, name);
    written(`${name} has ${number(file.size / 1e6, 1)} MB.`);
  },
  commands({ which, driven: table }) {
    tables[which] = table;
    showCommand(which);
  },
};

const stopped = (how, outcomes) => {
  setMode(how);
  if (how === "ended") text("status", `The run has ended: ${outcomes.map(({ outcome }, k) => `${outcomes.length > 1 ? `${policies()[k]} ` : ""}${outcome.verdict}`).join(", ")}.`);
  showOutcomes({ table: byId("outcome"), meanings: byId("meanings") }, policies(), outcomes, offer.metrics);
  text("until", `Metrics until ${number(outcomes[0].time_s, 2)} s${how === "paused" ? ", where the run is paused" : ""}.`);
  const failure = outcomes.map((each, k) => each.failure && `${policies()[k]}: ${each.failure}`).find(Boolean);
  if (failure) text("said", failure);
  // Nothing was driven before the first period.
  if (driven && outcomes[0].time_s > 0) asked.forEach((_, which) => say("commands", { which }));
};

const start = () => {
  if (location.protocol === "file:") {
    text("status", "");
    text("said", "This page needs a web server, because browsers load no WebAssembly from a file: run \"python3 -m http.server\" in the folder of the site and open http://localhost:8000 .");
    return;
  }
  worker = new Worker("worker.js");
  worker.addEventListener("message", ({ data: { type, ...sent } }) => on[type](sent));
  worker.addEventListener("error", (event) => refused(`the simulation cannot be started${event.message ? `: ${event.message}` : ""}`));
  say("start", { module: "omnistep.wasm" });
};

// ---- settings
const options = (id, names) => byId(id).replaceChildren(...names.map(([value, shown]) => Object.assign(document.createElement("option"), { value, textContent: shown ?? value })));
const fill = () => {
  options("scenario", Object.keys(offer.scenarios).map((name) => [name, name.replaceAll("_", " ")]));
  options("vehicle", [["", "of the scenario"], ...Object.keys(offer.vehicles).map((name) => [name])]);
  options("policy", offer.policies.map((name) => [name]));
  options("against", [["", "nothing"], ...offer.policies.map((name) => [name])]);
  options("engine", offer.engines.map((name) => [name]));
  options("model", [["ball", "balls (quick)"], ["rollers", "rollers (slow)"]]);
};
/** Why the wheels are simulated as they are, where that is not as usual. */
const noteOf = ({ wheels: model, wheel_model_valid: valid }) => {
  if (!valid) return "Balls are not a valid model of this vehicle's wheels on this ground. Choose rollers as the wheel model.";
  return model === "rollers" && settings.wheels === undefined ? "The wheel model is rollers, because balls are not a valid model of this vehicle's wheels on this ground." : "";
};

// ---- what is wrong with a field, below it
for (const field of FIELDS) {
  const label = byId(field).parentElement, box = document.createElement("div");
  label.replaceWith(box);
  box.append(label, Object.assign(document.createElement("p"), { id: `${field}-wrong`, className: "alarm", role: "alert" }));
}
const wrongAt = (field, what) => {
  text(`${field}-wrong`, `${byId(field).parentElement.firstChild.textContent.trim()}: ${what}`);
  byId(field).setAttribute("aria-invalid", "true");
  byId(field).setAttribute("aria-describedby", `${field}-wrong`);
};
const rightAgain = () => {
  for (const field of FIELDS) {
    text(`${field}-wrong`, "");
    for (const name of ["aria-invalid", "aria-describedby"]) byId(field).removeAttribute(name);
  }
};
const fromAddress = () => {
  forget();
  const { settings: chosen, wrong } = read(location.hash, offer);
  settings = chosen;
  for (const field of FIELDS) byId(field).value = String(settings[SETTING[field] ?? field] ?? "");
  open(wrong);
};
const open = (wrong = "") => {
  asked = requests(settings).map((request) => withFile(request, own));
  opening = true;
  text("lead", leadOf(settings, own));
  for (const link of byId("examples").children) {
    if (!own && link.hash === address(settings)) link.setAttribute("aria-current", "true");
    else link.removeAttribute("aria-current");
  }
  text("said", wrong);
  text("model-note", "");
  rightAgain();
  setMode("opening");
  written("");
  controls.letGo();
  say("open", { requests: asked });
};
const chosen = ({ target: { id, value, validity } }) => {
  if (validity.badInput) {
    say("open", { requests: [] });
    none(NOT_ALLOWED);
    rightAgain();
    wrongAt(id, "not a number, allowed: a number");
    return;
  }
  settings = { ...settings, [SETTING[id] ?? id]: value === "" ? undefined : ["torque", "friction", "height"].includes(id) ? Number(value) : value };
  // What belongs to the ground or the vehicle that was there goes with it.
  const gone = { scenario: ["vehicle", "torque", "friction", "height", "model"], vehicle: ["torque", "model"] }[id] ?? [];
  for (const field of gone) { settings[SETTING[field] ?? field] = undefined; byId(field).value = ""; }
  if (id === "scenario") { settings.policy = offer.scenarios[value].policy; byId("policy").value = settings.policy; }
  history.replaceState(null, "", address(settings));
  open();
};
for (const field of FIELDS) byId(field).addEventListener("change", chosen);

// ---- a file of the reader
const showFile = () => {
  byId("own-name").hidden = !own;
  text("own-name", "");
  if (own) byId("own-name").replaceChildren(`${own.name} is the ${own.kind}. `, removal);
  for (const kind of ["scenario", "vehicle"]) byId(kind).disabled = own?.kind === kind;
};
const removal = byId("own-name").querySelector("button");
const forget = () => {
  own = undefined;
  byId("own").value = "";
  showFile();
};
removal.addEventListener("click", () => { forget(); open(); });
const take = async (file) => {
  if (!offer || !file) return;
  try {
    own = await openedFile(file);
  } catch (error) {
    text("said", error.message);
    return;
  }
  // What belongs to the ground or the vehicle that was there goes with it.
  const gone = own.kind === "scenario" ? ["vehicle", "torque", "friction", "height", "model"] : ["vehicle", "torque", "model"];
  for (const field of gone) settings[SETTING[field] ?? field] = undefined;
  for (const [key, value] of Object.entries(settingsOf(own))) settings[key] = value ?? { policy: "traction", engine: "articulated" }[key];
  for (const field of FIELDS) byId(field).value = String(settings[SETTING[field] ?? field] ?? "");
  showFile();
  open();
};
byId("own").addEventListener("change", ({ target }) => take(target.files[0]));
const dropping = (event, on_) => {
  if (!event.dataTransfer?.types.includes("Files")) return false;
  event.preventDefault();
  root.classList.toggle("dropping", on_);
  return true;
};
addEventListener("dragover", (event) => dropping(event, true));
addEventListener("dragleave", (event) => dropping(event, false));
addEventListener("drop", (event) => { if (dropping(event, false)) take(event.dataTransfer.files[0]); });
byId("examples").replaceChildren(...EXAMPLES.map(({ name, settings: its }) => {
  const link = Object.assign(document.createElement("a"), { href: address(its), textContent: name });
  link.addEventListener("click", (event) => {
    if (!offer || event.ctrlKey || event.metaKey || event.shiftKey) return;
    starts = true;
    if (link.hash === location.hash) fromAddress(); // else the address changes
  });
  return link;
}));
addEventListener("hashchange", () => { if (offer) fromAddress(); });

// ---- run, pause, reset
const run = () => {
  if (mode === "running") { say("pause"); return; }
  if (mode === "ended") {
    starts = true;
    open();
    return;
  }
  if (!["ready", "paused"].includes(mode)) return;
  goOn();
};
byId("run").addEventListener("click", run);
byId("reset").addEventListener("click", () => open());
const step = () => {
  if (!["ready", "paused"].includes(mode)) return;
  text("said", "");
  say("step");
};
byId("step").addEventListener("click", step);
addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.("input, select, pre")) return;
  if (event.key === "." ) step();
  else if (event.code === "KeyR" && !event.repeat && !byId("reset").disabled) open();
});
document.addEventListener("visibilitychange", () => { if (document.hidden && mode === "running") say("pause"); });

// ---- driving
const controls = new Controls(byId("pad"), byId("stop"), (parts) => {
  const moves = parts.some((part) => part !== 0);
  if (!["ready", "running", "paused", "ended"].includes(mode) || (!moves && !driven && mode !== "running")) return;
  driven = true;
  const fast = Number(byId("fast").value);
  say("command", { asked: parts.map((part, k) => part * pace[k] * fast) });
  if (moves && mode !== "running") goOn();
});
/** A run that goes on has other metrics than those that are shown, and another command. */
const goOn = () => {
  text("said", "");
  clearOutcome();
  text("until", "The metrics come when the run ends or is paused.");
  setMode("running");
  say("run");
};
const showSpeed = () => text("faster", `${number(pace[0] * Number(byId("fast").value), 2)} m/s`);
byId("fast").addEventListener("input", () => { showSpeed(); controls.repeat(); });
byId("fast").addEventListener("pointerup", () => byId("fast").blur()); // arrows drive again

// ---- what does the same elsewhere
const save = (blob, name) => {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
};
/** As the command line calls it. */
const logName = ({ scenario, policy, set }) => {
  const engine = set["physics.engine"];
  return `${[own?.kind === "scenario" ? own.name.replace(/\.toml$/, "") : scenario, policy, ...(engine === offer.scenarios[scenario].engine ? [] : [engine])].join("-")}.mcap`;
};
const setButtons = (disabled) => document.querySelectorAll("#commands button").forEach((button) => { button.disabled = disabled; });
const offerCommands = () => byId("commands").replaceChildren(...asked.map((request, which) => {
  const part = document.createElement("div");
  part.innerHTML = `<pre tabindex="0"></pre><div class="take"><button type="button">Copy the command</button><button type="button">Download the log (MCAP)</button></div>`;
  const [code, [copy, download]] = [part.querySelector("pre"), part.querySelectorAll("button")];
  code.setAttribute("aria-label", `Command of the run with ${request.policy}`);
  download.setAttribute("aria-label", `Download the log (MCAP) of the run with ${request.policy}`);
  code.textContent = commandLine(request, undefined, own);
  copy.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(code.textContent); // there is no clipboard over plain http
      text("writing", "Copied.");
    } catch {
      getSelection().selectAllChildren(code);
      text("writing", "The browser does not allow copying: the command is selected.");
    }
  });
  download.addEventListener("click", () => {
    if (mode === "running") say("pause");
    written("Simulating the run again for its log.", 0);
    say("log", { which, name: logName(request) });
  });
  return part;
}));
const showCommand = (which) => {
  const part = byId("commands").children[which], table = tables[which];
  if (!part || !table) return;
  part.querySelector("pre").textContent = commandLine(asked[which], table, own);
  if (part.querySelectorAll("button").length > 2) return;
  const button = Object.assign(document.createElement("button"), { type: "button", textContent: "Download drive.csv" });
  button.addEventListener("click", () => save(new Blob([tables[which].csv], { type: "text/csv" }), "drive.csv"));
  part.querySelector(".take").append(button);
};

// ---- pictures
/** Pictures are counted over this time [ms]; with fewer a second than this the page says so. */
const COUNTED_MS = 2000, FEW = 12;
let counted = { from: 0, count: 0 };
const count = (now) => {
  if (mode !== "running") counted = { from: now, count: 0 };
  else counted.count += 1;
  if (now - counted.from < COUNTED_MS) return;
  const rate = counted.count / (now - counted.from) * 1000;
  text("drawing", rate < FEW ? `This machine draws slowly, ${number(rate, 0)} ${number(rate, 0) === "1" ? "picture" : "pictures"} a second. ${slow ? "" : "The simulation keeps real time."}`.trim() : "");
  counted = { from: now, count: 0 };
};
const frame = (now) => {
  count(now);
  if (latest && player) {
    const { states: texts, rate } = latest;
    latest = undefined;
    const states = texts.map((state) => JSON.parse(state)), [first] = states;
    if (states.length === scene.runs.length) {
      // Before the first period nothing is known of the wheels but where they are.
      if (first.wheels.length === 0) for (const state of states) state.wheels = undefined;
      states.forEach(({ poses }, k) => paths[k].add(poses[0]));
      player.show(states.map((state, k) => ({ ...state, path_m: paths[k].points })));
      if (first.wheels) wheels.show(states);
      text("time", number(first.time_s, 2, "s"));
      text("rate", mode === "running" && rate !== undefined ? `${number(rate, 2)} x real time` : "-");
      text("place", states.map(({ poses: [[x, y]] }) => `${number(x, 3)}, ${number(y, 3)} m`).join("; "));
      text("ahead", `${number(first.twist[0], 2)} of ${number(first.asked[0], 2)} m/s`);
      root.dataset.ready = "true";
    }
  }
  requestAnimationFrame(frame);
};
byId("theme").addEventListener("click", () => {
  root.dataset.theme = dark() ? "light" : "dark";
  nameTheme();
  player?.setTheme(dark());
  asked.forEach((_, k) => root.style.setProperty(`--run${k}`, runColour(k, dark())));
});

const nameTheme = () => text("theme", dark() ? "Light" : "Dark");

nameTheme();
start();
requestAnimationFrame(frame);
