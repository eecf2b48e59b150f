// The player as a module, for pages that are bundled.
export { hasWebGL, Player } from "./player.js";
export { RUN_COLOURS, runColour, WHEEL_COLOURS } from "./looks.js";
