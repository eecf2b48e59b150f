// Colours of wheels, in the order of the vehicle, by Okabe and Ito. For the page of a live run, and by web/shared.js for player and playground.

export const WHEEL_COLOURS = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#b8a800", "#7f7f7f"];
