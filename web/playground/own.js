// A vehicle or a scenario from a file of the reader: what it is, and the request with it. The file stays in the browser.
import { parse } from "smol-toml";

/** A longer file is none of ours [bytes]. */
const LONGEST = 1 << 20;
/** The simulation knows its own scenarios only: a file is this one with other keys. Those that every file has, and what others are if left out. */
const BASE = "flat", NEEDED = ["schema_version", "name", "vehicle", "terrain", "command"], LEFT_OUT = { duration_s: 10, control: {}, physics: {} };
/** Keys that a scenario has and no vehicle. */
const OF_SCENARIO = ["terrain", "command", "duration_s", "vehicle", "control", "physics"];

/** A file as `{name, kind, table}`; what is wrong with it is the message of an error. */
export async function opened(file) {
  if (file.size > LONGEST) throw new Error(`${file.name}: allowed: up to ${LONGEST} bytes`);
  let table;
  try {
    table = parse(await file.text());
  } catch (error) {
    throw new Error(`${file.name}: line ${error.line ?? "?"}: ${error.message.split("\n")[0]}`);
  }
  const kind = OF_SCENARIO.some((key) => key in table) ? "scenario" : "vehicle", missing = NEEDED.find((key) => !(key in table));
  if (kind === "scenario" && missing) throw new Error(`${file.name}: missing field \`${missing}\``);
  return { name: file.name, kind, table };
}

/** The settings that a scenario's file brings. */
export const settingsOf = ({ kind, table }) => (kind === "scenario" ? { policy: table.control?.policy, engine: table.physics?.engine } : {});

/** A request with the file in the place of a built-in scenario or vehicle. */
export function withFile(request, own) {
  if (!own) return request;
  if (own.kind === "vehicle") return { ...request, set: { ...request.set, vehicle: own.table } };
  const { set = {}, ...keys } = own.table;
  return { ...request, scenario: BASE, set: { ...LEFT_OUT, ...keys, ...set, ...request.set } };
}

/** A message of the simulation about the file, with its name instead of that of a built-in one. */
export const aboutFile = (line, own) => (own ? line.replace(own.kind === "vehicle" ? /^built-in \w+: vehicle[.:]? ?/ : /^built-in \w+: /, `${own.name}: `) : line);
