// Numbers of the run: wheels while it goes on, metrics at its end.

/** Loads are shown in parts of so many times a wheel's mean load. */
const MOST_LOADS = 4;

const made = (tag, inside, text = "") => inside.appendChild(Object.assign(document.createElement(tag), { textContent: text }));
/** A number with its unit; no zero has a sign. */
export const number = (value, digits, unit = "") => (Number.isFinite(value) ? `${value.toFixed(digits).replace(/^-(0\.?0*)$/, "$1")}${unit && ` ${unit}`}` : "-");

const bar = (cell, k, both, label) => {
  const outer = made("div", cell), inner = made("i", outer);
  outer.className = `bar${both ? " both" : ""}${k ? " second" : ""}`;
  for (const [name, value] of Object.entries({ role: "meter", "aria-label": label, "aria-valuemin": both ? -1 : 0, "aria-valuemax": 1, "aria-valuenow": 0 })) outer.setAttribute(name, value);
  return (part) => {
    const shown = Number.isFinite(part) ? Math.min(Math.max(part, both ? -1 : 0), 1) : 0;
    inner.style.transform = `scaleX(${shown})`;
    outer.setAttribute("aria-valuenow", number(shown, 2));
    outer.classList.toggle("full", both && Math.abs(shown) >= 0.999);
  };
};
/** A bar with its number beside it. */
const numbered = (cell, k, label) => {
  const line = made("div", cell), set = bar(line, k, true, label), text = made("span", line);
  line.className = "numbered";
  return (part) => {
    set(part);
    text.textContent = number(part ?? NaN, 2);
  };
};

/** A row a wheel, in it a bar a run. */
export class Wheels {
  #body; #rows = [];

  constructor(table) { this.#body = table.tBodies[0]; }

  /** The wheels of a scene, and the policies of its runs. */
  setScene(wheels, runs) {
    const count = runs.length;
    this.#body.replaceChildren();
    this.#rows = wheels.map(({ name, colour }) => {
      const row = made("tr", this.#body), title = made("th", row, name);
      title.scope = "row";
      title.style.boxShadow = `inset 4px 0 ${colour}`;
      const speed = made("td", row), [torque, slip, load] = [0, 1, 2].map(() => made("td", row));
      const speeds = runs.map((_, k) => { const line = made("div", speed); line.className = count > 1 ? `name${k}` : ""; return line; });
      const bars = runs.map((policy, k) => {
        const label = (what) => `${what} of wheel ${name}${count > 1 ? `, ${policy}` : ""}`;
        return { torque: bar(torque, k, true, label("Torque")), slip: numbered(slip, k, label("Slip")), load: bar(load, k, false, label("Load")) };
      });
      return { speeds, bars };
    });
  }

  show(states) {
    states.forEach(({ wheels }, k) => {
      const mean = wheels.reduce((total, { load_n: load }) => total + (load || 0), 0) / wheels.length;
      wheels.forEach((wheel, at) => {
        const { speeds, bars } = this.#rows[at], [lower, upper] = wheel.limits_n_m;
        speeds[k].textContent = number(wheel.speed_rad_s, 1);
        bars[k].torque(wheel.torque_n_m < 0 ? -wheel.torque_n_m / lower : wheel.torque_n_m / upper);
        bars[k].slip(wheel.slip);
        bars[k].load(wheel.load_n / (MOST_LOADS * Math.max(mean, 1e-9)));
      });
    });
  }
}

/** Metrics down, runs across: the metrics that the command's table of these runs has. Below it what the metrics mean. */
export function showOutcomes({ table, meanings }, policies, outcomes, metrics) {
  const head = table.tHead.rows[0], body = table.tBodies[0];
  head.replaceChildren();
  made("th", head, "metric").scope = "col";
  policies.forEach((policy, k) => { Object.assign(made("th", head, policy), { scope: "col", className: `name${k}` }); });
  body.replaceChildren();
  const line = (title, cells) => {
    const row = made("tr", body);
    made("th", row, title).scope = "row";
    for (const cell of cells) made("td", row, cell);
  };
  line("verdict", outcomes.map(({ outcome }) => outcome.verdict));
  const needed = metrics.filter(({ key }) => outcomes.some(({ shown }) => shown[key][1]));
  for (const { key, heading } of needed) line(heading, outcomes.map(({ shown }) => shown[key][0] ?? "-"));
  const list = meanings.querySelector("dl"), better = { lower: " Lower is better.", zero: " Nearer to zero is better." };
  list.replaceChildren();
  for (const metric of needed) {
    made("dt", list, metric.heading);
    made("dd", list, metric.meaning + (better[metric.better] ?? ""));
  }
  table.hidden = meanings.hidden = false;
}
