// Colours of the player, light and dark, and of runs; those of wheels are the live page's.

export { WHEEL_COLOURS } from "../shared.js"; // those of the live page

/** Colours of runs: light theme, dark theme. */
export const RUN_COLOURS = [
  ["#3b5bdb", "#8ea2ff"],
  ["#c2255c", "#ff7ba7"],
  ["#2b8a3e", "#6fdd86"],
  ["#b35300", "#ffb066"],
  ["#7b2cbf", "#d29bff"],
  ["#0b7285", "#4fd3e6"],
  ["#5c4a1f", "#d9c48a"],
  ["#495057", "#c5ccd3"],
];

/** The colour of a run. */
export const runColour = (index, dark) => RUN_COLOURS[index % RUN_COLOURS.length][dark ? 1 : 0];

/** All other colours of the scene. */
export const looks = (dark) => dark
  ? { paper: "#14171b", ink: "#e6e9ee", low: "#1c2026", level: "#2f3339", high: "#6d6555", grid: "#7d8794", alarm: "#ff5a4f", force: "#6cb2ff", mark: "#6cb2ff", edge: "#ffb066", body: "#8c9aab", sun: 2.2, sky: 1.6 }
  : { paper: "#ffffff", ink: "#1b1f24", low: "#cfd6de", level: "#eceae4", high: "#c9bda6", grid: "#8a8f98", alarm: "#d1201a", force: "#0a66c2", mark: "#0a66c2", edge: "#d9480f", body: "#55677c", sun: 1.7, sky: 2.0 };
