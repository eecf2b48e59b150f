// What player and playground share with the page of a live run: the only path from web into the crate that has it. It is there because
// a crate is packaged without files from outside its folder.
export { Controls } from "../crates/omni-log/src/live/page/controls.js";
export { WHEEL_COLOURS } from "../crates/omni-log/src/live/page/palette.js";
