// Keys, buttons and a gamepad: what they ask for, as parts of the speed, from -1 to 1. For the page of a live run and for the playground.

const KEYS = {
  ArrowUp: [1, 0, 0], KeyW: [1, 0, 0], ArrowDown: [-1, 0, 0], KeyS: [-1, 0, 0],
  ArrowLeft: [0, 1, 0], KeyA: [0, 1, 0], ArrowRight: [0, -1, 0], KeyD: [0, -1, 0], KeyQ: [0, 0, 1], KeyE: [0, 0, -1],
};
/** How often the gamepad is read [ms], and how long a button drives that is pressed by Enter or a screen reader. */
const GAMEPAD_MS = 50, MOMENT_MS = 400;
/** What a stick at rest may show. */
const DEAD = 0.15;

/** Calls `ask` with forward, left and turning to the left when they change. */
export class Controls {
  #ask; #buttons; #held = new Map(); #last = [0, 0, 0]; #free = true; #pointed = false;

  constructor(pad, stop, ask) {
    this.#ask = ask;
    this.#buttons = [...pad.querySelectorAll("button[data-twist]")];
    addEventListener("keydown", (event) => this.#down(event));
    addEventListener("keyup", (event) => {
      if (event.code === "Space") event.preventDefault(); // it has stopped, it presses nothing
      this.#release(event.code);
    });
    for (const gone of ["blur", "pagehide", "contextmenu"]) addEventListener(gone, () => this.letGo());
    document.addEventListener("visibilitychange", () => { if (document.hidden) this.letGo(); });
    for (const pressed of ["pointerdown", "click"]) stop.addEventListener(pressed, () => this.stop());
    this.#buttons.forEach((button) => this.#button(button));
    setInterval(() => this.#report(), GAMEPAD_MS);
    // Who chooses with a pointer drives on: the keys are not the field's. Who goes from field to field by keyboard stays there.
    addEventListener("pointerdown", () => { this.#pointed = true; }, { capture: true });
    addEventListener("keydown", () => { this.#pointed = false; }, { capture: true });
    addEventListener("change", ({ target }) => { if (this.#pointed) target.blur(); });
  }

  /** Nothing is held any more. */
  letGo() {
    this.#held.clear();
    this.#buttons.forEach((button) => button.removeAttribute("aria-pressed"));
    this.#report();
  }

  /** Asks again for what is held: what a part of the speed is has changed. */
  repeat() { if (this.#last.some((part) => part !== 0)) this.#ask(this.#last); }

  /** Nothing is held, while another client drives, and a stick has to come back to the middle first. */
  stop() {
    this.#free = false;
    this.letGo();
    this.#ask([0, 0, 0]);
  }

  #down(event) {
    // While one of these is down, or a menu is open, other keys may come up unnoticed.
    if (event.ctrlKey || event.metaKey || event.altKey) { this.letGo(); return; }
    const { target, code } = event;
    if (code === "Space") { // whatever has the focus: Enter presses it
      event.preventDefault();
      this.stop();
      return;
    }
    // Fields have keys of their own.
    if (!(code in KEYS) || target.closest?.("input, select, pre")) return;
    event.preventDefault();
    if (!event.repeat) this.#hold(code, KEYS[code]); // a key that is held through a stop stays without effect
  }

  #hold(what, twist) {
    this.#held.set(what, twist);
    this.#report();
  }

  #release(what) { if (this.#held.delete(what)) this.#report(); }

  #button(button) {
    const twist = button.dataset.twist.split(" ").map(Number);
    const end = () => {
      button.removeAttribute("aria-pressed");
      this.#release(button);
    };
    button.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      button.setPointerCapture(event.pointerId);
      button.setAttribute("aria-pressed", "true");
      this.#hold(button, twist);
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) button.addEventListener(name, end);
    button.addEventListener("click", ({ detail }) => {
      if (detail !== 0) return;
      this.#hold(button, twist);
      setTimeout(end, MOMENT_MS);
    });
    // A long press is no wish for a menu, and lets nothing go.
    button.addEventListener("contextmenu", (event) => { event.preventDefault(); event.stopPropagation(); });
  }

  // The left stick drives, the right one turns.
  #stick() {
    const pad = document.hasFocus() ? (navigator.getGamepads?.() ?? []).find((each) => each?.connected) : null;
    const axis = (k) => { const value = pad?.axes[k] ?? 0; return Math.abs(value) < DEAD ? 0 : -value; };
    const stick = [axis(1), axis(0), axis(2)];
    this.#free ||= stick.every((part) => part === 0);
    return this.#free ? stick : [0, 0, 0];
  }

  #report() {
    const all = [this.#stick(), ...this.#held.values()];
    const asked = [0, 1, 2].map((k) => Math.min(Math.max(all.reduce((total, each) => total + each[k], 0), -1), 1));
    if (asked.every((part, k) => part === this.#last[k])) return;
    this.#last = asked;
    this.#ask(asked);
  }
}
