// What the reader has chosen: in the page's address, as a request of the simulation, as a command line.

/** Keys of the address; of numbers, the key of the scenario. */
const NUMBERS = {
  torque: "vehicle.motor.stall_torque_n_m",
  friction: "terrain.friction",
  height: "terrain.height_m",
};
/** Where the simulation's messages have what a field has. */
const PLACES = {
  "motor.stall_torque_n_m": "torque",
  "terrain.friction": "friction",
  "terrain.height_m": "height",
  "physics.engine": "engine",
  "physics.wheel_model": "model",
};
const NAMES = ["scenario", "vehicle", "policy", "against", "engine", "wheels"];

/** The keys of the address that are used, in its order. */
export const KEYS = [...NAMES, ...Object.keys(NUMBERS)];

/** Ready settings, with the name of their link and what is said about them. The first one is README's experiment. */
export const EXAMPLES = [
  {
    name: "Plain PID stalls, traction control climbs",
    settings: { scenario: "hard_step", policy: "traction", against: "independent", engine: "articulated" },
    lead: "Two vehicles drive at a step of 5 cm, with weak motors on a smooth floor. With plain PID (independent) the wheels slip and the vehicle stalls; with traction control (traction) it climbs.",
  },
  {
    name: "Three stairs",
    settings: { scenario: "stairs", policy: "traction", against: "independent", engine: "articulated" },
    lead: "Two vehicles climb three stairs of 3 cm, one with traction control (traction), one with plain PID (independent). The table \"Outcome\" compares them at the end.",
  },
  {
    name: "Mecanum wheels on cables",
    settings: { scenario: "bumps", vehicle: "mecanum4", policy: "traction", engine: "articulated" },
    lead: "A vehicle on four mecanum wheels drives over three cables. Every roller of its wheels is simulated.",
  },
  {
    name: "Rocker-bogie on rough ground",
    settings: { scenario: "rough", vehicle: "rocker_bogie6", policy: "traction", engine: "articulated" },
    lead: "A vehicle with six wheels on rockers and bogies drives over rough ground. Its arms turn with the ground.",
  },
];

/** What is said of settings that are no example. */
const LEAD = "This page simulates a vehicle on omni or mecanum wheels in your browser. Press Run to let it follow the command of the scenario, or hold an arrow key to drive it.";

/** Two sentences about what is shown. */
export const leadOf = (settings, own) => (own ? undefined : EXAMPLES.find((each) => address(each.settings) === address(settings)))?.lead ?? LEAD;

/** What is shown before anything is chosen. */
export const usual = () => ({ ...EXAMPLES[0].settings });

/** A page's address may come from anywhere: what is wrong with it is one line, and is left out. */
export function read(hash, offer) {
  const chosen = {}, wrong = [];
  const allowed = {
    scenario: Object.keys(offer.scenarios),
    vehicle: Object.keys(offer.vehicles),
    policy: offer.policies,
    against: offer.policies,
    engine: offer.engines,
    wheels: offer.wheel_models,
  };
  const given = new URLSearchParams(hash.replace(/^#/, ""));
  for (const [key, value] of given) {
    const short = value.length > 40 ? `${value.slice(0, 40)}...` : value;
    if (key in allowed && NAMES.includes(key)) {
      if (allowed[key].includes(value)) chosen[key] = value;
      else wrong.push(`${key}: "${short}", allowed: ${allowed[key].join(", ")}`);
    } else if (Object.hasOwn(NUMBERS, key)) {
      const number = Number(value);
      if (value.trim() !== "" && Number.isFinite(number)) chosen[key] = number;
      else wrong.push(`${key}: "${short}", allowed: a number`);
    } else wrong.push(`${key.slice(0, 40)}: no such setting, allowed: ${KEYS.join(", ")}`);
  }
  // A scenario brings its vehicle and its policy; without any setting there is something to compare.
  const settings = [...given].length === 0 ? usual() : { engine: "articulated", ...chosen };
  settings.scenario ??= "step";
  settings.policy ??= offer.scenarios[settings.scenario].policy;
  return { settings, wrong: wrong[0] ?? "" };
}

/** The address of these settings. */
export function address(settings) {
  const given = KEYS.filter((key) => settings[key] !== undefined).map((key) => [key, String(settings[key])]);
  return `#${new URLSearchParams(given)}`;
}

/** The keys that are set. */
function set(settings) {
  const keys = { "physics.engine": settings.engine };
  if (settings.wheels !== undefined) keys["physics.wheel_model"] = settings.wheels; // else the ground decides
  if (settings.vehicle !== undefined) keys.vehicle = settings.vehicle;
  for (const [key, name] of Object.entries(NUMBERS)) if (settings[key] !== undefined) keys[name] = settings[key];
  return keys;
}

/** Runs as the simulation is asked for them: one, or two of different policies. */
export function requests(settings) {
  const policies = [settings.policy, settings.against].filter((policy, k, all) => policy !== undefined && all.indexOf(policy) === k);
  return policies.map((policy) => ({ scenario: settings.scenario, policy, set: set(settings) }));
}

/** What a driven run has instead of the scenario's: commands, until a time, and the wheels as they were; others might follow from the commands. */
const instead = (driven, file) => ({ "physics.wheel_model": driven.wheels, command: file, duration_s: driven.time_s });

/** The same run with the commands of a driven one. */
export function again(request, driven) {
  if (!driven) return request;
  const file = `data:text/csv;base64,${btoa(driven.csv)}`;
  return { ...request, set: { ...request.set, ...instead(driven, { file }) } };
}

const quoted = (text) => (/^[\w.=/-]+$/.test(text) ? text : `'${text}'`);

/** What does the same in a terminal; `own` is a file that the request has in it (own.js). */
export function commandLine(request, driven, own) {
  const keys = { ...request.set };
  if (own?.kind === "vehicle") keys.vehicle = own.name;
  if (own?.kind === "scenario") {
    // Only what is not the file's: settings of the page, of which none is a table.
    const its = { duration_s: request.set.duration_s, ...own.table, ...own.table.set };
    for (const [key, value] of Object.entries(keys)) if (typeof value === "object" || its[key] === value) delete keys[key];
  }
  if (driven) Object.assign(keys, instead(driven, '{ file = "drive.csv" }'));
  const given = Object.entries(keys).map(([key, value]) => `--set ${quoted(`${key}=${value}`)}`);
  return [`omnistep run ${own?.kind === "scenario" ? quoted(own.name) : request.scenario}`, `--policy ${request.policy}`, ...given].join(" \\\n  ");
}

/** The field that a message of the simulation is about, and what it says of it; nothing where it is about none. */
export function blamed(line) {
  for (const [place, field] of Object.entries(PLACES)) {
    const at = line.indexOf(`${place}: `);
    if (at >= 0) return { field, what: line.slice(at + place.length + 2) };
  }
  return undefined;
}
