// The path of a run so far, as the player draws it.

/** Points lie so far apart at first [m]; of more points than this every second one is left out. */
const POINT_M = 0.02, MOST_POINTS = 3000;
/** Above the base of the vehicle, which stands on the ground [m]. */
const ABOVE_M = 0.002;

/** Grows with the run, and stays short. */
export class Path {
  #apart = POINT_M;
  /** x, y, z after each other; another array after each change. */
  points = [];

  add([x, y, z]) {
    const { points } = this, n = points.length;
    if (n > 0 && Math.hypot(x - points[n - 3], y - points[n - 2]) < this.#apart) return;
    this.points = [...points, x, y, z + ABOVE_M];
    if (this.points.length <= 3 * MOST_POINTS) return;
    this.points = this.points.filter((_, k) => Math.floor(k / 3) % 2 === 0);
    this.#apart *= 2;
  }
}
