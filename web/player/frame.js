// What surrounds the picture: buttons of the views, the legend and the labels of wheels. Text is set as text, never as HTML.
import { VIEWS } from "./views.js";
import { wheelColour } from "./vehicle.js";

const STYLE = `
.osp { position: relative; overflow: hidden; font: 13px/1.3 system-ui, sans-serif; color: var(--osp-ink); background: var(--osp-paper); }
.osp canvas { position: absolute; inset: 0; display: block; outline: none; }
.osp canvas:focus-visible { outline: 3px solid var(--osp-mark); outline-offset: -3px; }
.osp svg { position: absolute; inset: 0; width: 100%; height: 100%; pointer-events: none; }
.osp-views { position: absolute; top: 8px; left: 8px; right: 8px; display: flex; flex-wrap: wrap; gap: 3px; pointer-events: none; }
.osp-views button { pointer-events: auto; font: inherit; color: inherit; min-width: 36px; min-height: 36px; padding: 4px 7px; cursor: pointer; background: color-mix(in srgb, var(--osp-paper) 82%, transparent); border: 1px solid var(--osp-grid); border-radius: 6px; }
.osp-views button[aria-pressed=true] { border-color: var(--osp-mark); box-shadow: inset 0 0 0 1px var(--osp-mark); }
.osp-views button:focus { outline: none; }
.osp-views button:focus-visible { outline: 3px solid var(--osp-mark); outline-offset: 1px; }
.osp-label { box-sizing: border-box; position: absolute; left: 0; top: 0; min-width: 22px; height: 22px; padding: 0 5px; border: 2px solid; border-radius: 11px; background: var(--osp-paper); font-weight: 600; font-size: 12px; line-height: 18px; text-align: center; pointer-events: none; white-space: nowrap; max-width: 9em; overflow: hidden; text-overflow: ellipsis; }
.osp-name { max-width: none; }
.osp-legend { position: absolute; left: 8px; bottom: 8px; right: 8px; display: flex; flex-wrap: wrap; gap: 2px 12px; pointer-events: none; font-size: 12px; }
.osp-legend span { display: inline-flex; align-items: center; gap: 5px; padding: 1px 5px; border-radius: 4px; background: color-mix(in srgb, var(--osp-paper) 72%, transparent); overflow-wrap: anywhere; }
.osp-legend i { flex: none; width: 14px; height: 10px; border-radius: 3px; }
.osp-none { position: absolute; inset: 0; display: grid; place-content: center; padding: 3em 1.5em 1.5em; text-align: center; }
`;
const HINTS = {
  orbit: "Orbit: drag to turn, two fingers or the right button to move, wheel or pinch to enlarge",
  side: "From the vehicle's right side, without perspective",
  plan: "Plan view: from above, without perspective; x to the right",
  follow: "From behind, turning with the vehicle",
};
const NAMES = { orbit: "Orbit", side: "Side", plan: "Plan", follow: "Follow" };
/** Where a label goes if its place is taken, in its own size: short ones beside each other, long ones on top of each other. */
const SHORT = [[0, 0], [1, 0], [-1, 0], [0, -1], [1, -1], [-1, -1], [2, 0], [-2, 0], [0, -2]];
const LONG = [[0, 0], [0, -1], [0, -2], [0, -3], [1, 0], [-1, 0]];
const TALL_PX = 23, SHORT_PX = 40;
/** Names of runs are below the buttons. */
const NAMES_BELOW_PX = 84;

const made = (tag, className, text) => Object.assign(document.createElement(tag), { className, textContent: text ?? "" });

/** Buttons, legend and labels over a canvas. */
export class Frame {
  constructor(element, { choose, zoom, home, legend }) {
    if (!document.getElementById("osp-style")) document.head.append(Object.assign(made("style", "", STYLE), { id: "osp-style" }));
    this.element = element;
    element.classList.add("osp");
    this.lines = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    this.labels = made("div", "osp-labels");
    this.labels.setAttribute("aria-hidden", "true");
    this.names = made("div", "osp-names");
    this.names.setAttribute("aria-hidden", "true"); // the legend has them
    this.bar = made("div", "osp-views");
    this.bar.setAttribute("role", "group");
    this.bar.setAttribute("aria-label", "View");
    this.legend = made("div", "osp-legend");
    this.legend.hidden = !legend;
    const button = (text, hint, act) => {
      const made_ = this.bar.appendChild(made("button", "", text));
      Object.assign(made_, { type: "button", title: hint });
      made_.addEventListener("click", act);
      return made_;
    };
    this.buttons = VIEWS.map((name) => button(NAMES[name], HINTS[name], () => choose(name)));
    button("+", "Enlarge", () => zoom(1.25)).setAttribute("aria-label", "Enlarge");
    button("\u2212", "Reduce", () => zoom(0.8)).setAttribute("aria-label", "Reduce");
    button("\u2302", "The view as it began", home).setAttribute("aria-label", "The view as it began");
    element.append(this.lines, this.labels, this.names, this.legend, this.bar);
  }

  setView(view) { this.buttons.forEach((button, k) => button.setAttribute("aria-pressed", String(VIEWS[k] === view))); }

  setLooks(look) {
    for (const name of ["ink", "paper", "grid", "mark"]) this.element.style.setProperty(`--osp-${name}`, look[name]);
  }

  /** Labels of a scene's wheels. */
  setScene(scene) {
    this.labels.replaceChildren();
    this.lines.replaceChildren();
    this.each = scene.wheels.map((disc, k) => {
      const label = this.labels.appendChild(made("span", "osp-label", disc.name));
      label.style.borderColor = wheelColour(scene, k);
      const line = this.lines.appendChild(document.createElementNS("http://www.w3.org/2000/svg", "line"));
      line.setAttribute("stroke", wheelColour(scene, k));
      line.setAttribute("stroke-width", "1.5");
      return { label, line, wide: label.offsetWidth + 2 };
    });
  }

  /** Puts the labels above their wheels: for each x, y and radius in pixels, or null. */
  place(wheels) {
    const taken = [];
    this.each?.forEach(({ label, line, wide }, k) => {
      const seen = wheels?.[k];
      label.style.visibility = line.style.visibility = seen ? "" : "hidden";
      if (!seen) return;
      const [x, y, radius] = seen, top = y - radius - 0.85 * TALL_PX;
      const at = ([right, up]) => [x + right * wide, top + up * TALL_PX, wide];
      const free = (place) => taken.every(([tx, ty, tw]) => Math.abs(place[0] - tx) >= (place[2] + tw) / 2 - 1 || Math.abs(place[1] - ty) >= TALL_PX - 1);
      const places = (wide > SHORT_PX ? LONG : SHORT).map(at), place = places.find(free) ?? places[0];
      taken.push(place);
      label.style.transform = `translate(${place[0].toFixed(1)}px, ${place[1].toFixed(1)}px) translate(-50%, -50%)`;
      for (const [name, value] of Object.entries({ x1: x, y1: y, x2: place[0], y2: place[1] + 10 })) line.setAttribute(name, value.toFixed(1));
    });
  }

  /** Names of runs above their vehicles: each with its colour and its place in pixels. */
  placeNames(names) {
    while (this.names.childElementCount > names.length) this.names.lastChild.remove();
    const taken = [];
    names.forEach(([text, colour, x, y], k) => {
      const label = this.names.children[k] ?? this.names.appendChild(made("span", "osp-label osp-name"));
      if (label.textContent !== text) label.textContent = text;
      label.style.borderColor = colour;
      const wide = label.offsetWidth, across = Math.min(Math.max(x, wide / 2 + 4), Math.max(this.element.clientWidth - wide / 2 - 4, wide / 2 + 4));
      let up = Math.max(y, NAMES_BELOW_PX);
      while (taken.some(([tx, ty, tw]) => Math.abs(across - tx) < (wide + tw) / 2 && Math.abs(up - ty) < TALL_PX)) up -= TALL_PX;
      taken.push([across, up, wide]);
      label.style.transform = `translate(${across.toFixed(1)}px, ${up.toFixed(1)}px) translate(-50%, -50%)`;
    });
  }

  /** What the colours mean: runs (name and colour), the marks, whether forces are shown, and patches of the ground. */
  setLegend(runs, look, { forces, edges, patches }) {
    const frictions = [...new Set(patches.map(({ friction }) => friction))].filter(Number.isFinite);
    const entry = (text, paint) => {
      const item = made("span", "", ""), swatch = made("i", "");
      Object.assign(swatch.style, paint);
      item.append(swatch, text);
      return item;
    };
    this.legend.replaceChildren(
      ...runs.map(({ name, colour }) => entry(name, { background: colour })),
      entry("wheel slip", { border: `3px solid ${look.alarm}`, borderRadius: "50%", width: "13px", height: "13px", boxSizing: "border-box" }),
      ...(forces ? [entry("ground force", { background: runs.length === 1 ? look.force : "currentColor", height: "3px" })] : []),
      ...(edges ? [entry("edge that a wheel felt", { background: look.edge })] : []),
      ...(patches.length ? [entry(frictions.length ? `friction ${frictions.join(", ")}` : "another friction", { background: look.mark, opacity: 0.45 })] : []),
    );
  }

  /** Says that there is no picture, and why. */
  refuse(text) {
    this.element.append(made("p", "osp-none", text));
    this.bar.hidden = this.legend.hidden = true;
    this.bar.style.display = this.legend.style.display = "none";
  }

  dispose() {
    for (const part of [this.lines, this.labels, this.names, this.bar, this.legend]) part.remove();
    this.element.querySelector(":scope > .osp-none")?.remove();
    this.element.classList.remove("osp");
  }
}
