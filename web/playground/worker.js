// Runs in step with the clock, beside the page: simulation here, pictures there.
import { again } from "./settings.js";
import { Engine, Refused } from "./engine.js";

/** Between two looks at the clock [ms]; what is simulated at once; what is given up when the clock is farther ahead. */
const TICK_MS = 6, BUDGET_MS = 14, MOST_LATE_S = 0.2;
/** Control periods of one slice. */
const SLICE = 5;
/** Between two states [ms]. */
const SHOW_MS = 16;
/** Size of a log in memory before it goes to the browser's file store [bytes]. */
const PIECE = 4 << 20;
/** Length of a single step [s]. */
const STEP_S = 0.01;
/** The rate is measured over this time [ms]. */
const RATE_MS = 500;

let engine;
let runs = []; // number, request, whether it goes on
let period; // of control [s]
let clock; // while it runs: when it was last looked at, what is due, how fast it went
let twist; // what is commanded; none: the scenario's own command
let shown = 0, timer = 0;
let job = 0; // the log that is written: another one, or another run, ends it

const tell = (type, sent = {}) => postMessage({ type, ...sent });
/** A trap leaves the module in no known state: only a new one goes on. */
let broken = "";
const guarded = (what) => {
  try {
    if (broken) throw new Refused(broken);
    return what();
  } catch (error) {
    failed(error);
    return undefined;
  }
};
const failed = (error) => {
  if (!(error instanceof Refused)) broken = `the simulation stopped (${error.message}): load the page again`;
  pause();
  tell("refused", { line: broken || error.message });
};

const show = (now) => {
  shown = now;
  tell("state", { states: runs.map(({ number }) => engine.state(number)), rate: clock?.rate, slow: clock?.slow ?? false, driven: twist !== undefined });
};

function pause() {
  clearTimeout(timer);
  clock = undefined;
}

const goOn = (run, periods) => {
  if (!run.goes) return;
  run.goes = engine.advance(run.number, periods, twist) === periods;
};

function tick() {
  const now = performance.now();
  clock.due_s = Math.min(clock.due_s + (now - clock.at) / 1000, MOST_LATE_S);
  clock.at = now;
  while (clock.due_s >= SLICE * period && performance.now() - now < BUDGET_MS && runs.some(({ goes }) => goes)) {
    for (const run of runs) goOn(run, SLICE);
    clock.due_s -= SLICE * period;
    clock.went_s += SLICE * period;
  }
  if (now - clock.from > RATE_MS) {
    clock.rate = clock.went_s / ((now - clock.from) / 1000);
    clock.slow = clock.rate < 0.9;
    Object.assign(clock, { from: now, went_s: 0 });
  }
  if (now - shown >= SHOW_MS) show(now);
  if (runs.some(({ goes }) => goes)) timer = setTimeout(() => guarded(tick), TICK_MS);
  else {
    pause();
    show(now);
    tell("ended", { outcomes: outcomes() });
  }
}

const outcomes = () => runs.map(({ number }) => engine.outcome(number));

const closeAll = () => {
  job += 1;
  pause();
  for (const { number } of runs) engine.close(number);
  runs = [];
  twist = undefined;
};

/** The commands of a driven run, until when, and how its wheels were simulated. */
const driven = ({ number }) => {
  const { time_s } = engine.outcome(number);
  if (twist === undefined || time_s === 0) return undefined;
  return { csv: engine.commands(number), time_s, wheels: engine.scene(number).settings.wheels };
};

const does = {
  open({ requests }) {
    closeAll();
    if (requests.length === 0) return;
    try {
      for (const request of requests) runs.push({ number: engine.open(request), request, goes: true });
    } catch (error) {
      closeAll();
      throw error;
    }
    const { scene, settings } = engine.scene(runs[0].number);
    period = settings.period_s;
    tell("opened", { scene, settings, requests });
    show(performance.now());
  },
  run() {
    if (clock || runs.length === 0) return;
    if (!runs.some(({ goes }) => goes)) { tell("ended", { outcomes: outcomes() }); return; }
    const now = performance.now();
    clock = { at: now, from: now, due_s: 0, went_s: 0 };
    tick();
  },
  pause() {
    if (!clock) return;
    pause();
    show(performance.now());
    tell("paused", { outcomes: outcomes() });
  },
  step() {
    pause();
    for (const run of runs) goOn(run, Math.max(1, Math.round(STEP_S / period)));
    show(performance.now());
    tell(runs.some(({ goes }) => goes) ? "paused" : "ended", { outcomes: outcomes() });
  },
  command({ asked }) {
    twist = asked;
    // A scenario's own command ends; an interactive drive goes on. (Of failed physics no period goes.)
    for (const run of runs) run.goes = true;
  },
  async log({ which, name }) {
    job += 1;
    const mine = job, goesOn = () => mine === job;
    try {
      const run = runs[which];
      if (!run) throw new Refused("there is no run to log");
      const table = driven(run), type = "application/octet-stream";
      const yields = async (part) => {
        tell("writing", { part });
        await new Promise((done) => { setTimeout(done); });
        return goesOn();
      };
      let file = new Blob([], { type }), pieces = [], size = 0;
      const keep = () => { [file, pieces, size] = [new Blob([file, ...pieces], { type }), [], 0]; };
      for await (const piece of engine.logged(again(run.request, table), yields)) {
        pieces.push(piece);
        size += piece.length;
        if (size > PIECE) keep();
      }
      keep();
      if (goesOn()) tell("log", { name, file, csv: table?.csv });
    } catch (error) {
      if (!(error instanceof Refused) || broken) failed(error);
      else if (goesOn()) tell("refused", { line: error.message, about: "log" });
    }
  },
  commands({ which }) {
    const run = runs[which];
    if (run) tell("commands", { which, driven: driven(run) });
  },
};

addEventListener("message", async ({ data: { type, ...sent } }) => {
  if (type === "start") {
    try {
      const answer = await fetch(sent.module);
      if (!answer.ok) throw new Error(`${answer.status} ${answer.statusText}`);
      engine = await Engine.from(await answer.arrayBuffer());
      tell("offer", { offer: engine.offer() });
    } catch (error) {
      tell("refused", { line: `the simulation cannot be loaded: ${error.message}` });
    }
    return;
  }
  if (!engine || !Object.hasOwn(does, type)) return;
  guarded(() => does[type](sent));
});
