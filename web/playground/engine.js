// The simulation's WebAssembly module: its functions with texts instead of places in its memory. Needs nothing of a page, so node has it too.

const encoder = new TextEncoder(), decoder = new TextDecoder();

/** What the module refuses, in one line. */
export class Refused extends Error {}

export class Engine {
  #of;

  constructor(instance) { this.#of = instance.exports; }

  /** From the bytes of the module. */
  static async from(bytes) {
    const { instance } = await WebAssembly.instantiate(bytes);
    return new Engine(instance);
  }

  // What was said, or the error.
  #bytes(length) {
    const bytes = new Uint8Array(this.#of.memory.buffer, this.#of.text(), Math.abs(length)).slice();
    if (length < 0) throw new Refused(decoder.decode(bytes));
    return bytes;
  }

  #text(length) { return decoder.decode(this.#bytes(length)); }

  #number(number) { return number < 0 ? this.#bytes(number) : number; }

  /** Scenarios and vehicles by name, policies, engines, wheel models, metrics in the order of tables. */
  offer() {
    const offered = JSON.parse(this.#text(this.#of.offered())), named = (list) => Object.fromEntries(list.map((each) => [each.name, each]));
    return { ...offered, scenarios: named(offered.scenarios), vehicles: named(offered.vehicles) };
  }

  /** Starts a run of `{scenario, policy?, set?, log?}` and returns its number. */
  open(request) {
    const bytes = encoder.encode(JSON.stringify(request)), place = this.#of.request_room(bytes.length);
    if (place !== 0) new Uint8Array(this.#of.memory.buffer, place, bytes.length).set(bytes);
    return this.#number(this.#of.run_open());
  }

  close(run) { this.#of.run_close(run); }

  /** Goes on for so many control periods, with a twist `[vx, vy, wz]` or the scenario's own command; returns how many it went. */
  advance(run, periods, twist) {
    return this.#number(twist ? this.#of.run_drive(run, periods, ...twist) : this.#of.run_follow(run, periods));
  }

  scene(run) { return JSON.parse(this.#text(this.#of.run_scene(run))); }

  /** The state as JSON text: parsed where it is drawn. */
  state(run) { return this.#text(this.#of.run_state(run)); }

  outcome(run) { return JSON.parse(this.#text(this.#of.run_outcome(run))); }

  /** The commands so far as CSV. */
  commands(run) { return this.#text(this.#of.run_commands(run)); }

  /** The next piece of the log. */
  log(run) { return this.#bytes(this.#of.run_log(run)); }

  /** The last piece of the log. */
  finishLog(run) { return this.#bytes(this.#of.run_finish_log(run)); }

  /** A whole run again, in pieces of its log. `pause` is awaited between slices with the part done; it ends early where that says false. */
  async *logged(request, pause = () => true) {
    const run = this.open({ ...request, log: true });
    try {
      const { duration_s: end, period_s: period } = this.scene(run).settings;
      for (let done = 0, went = SLICE; went === SLICE; done += went) {
        went = this.advance(run, SLICE);
        yield this.log(run);
        if (await pause(Math.min(done * period / end, 1)) === false) return;
      }
      yield this.finishLog(run);
    } finally {
      this.close(run);
    }
  }
}

/** Control periods between two pieces of a log: some ten milliseconds on the clock. */
const SLICE = 200;
