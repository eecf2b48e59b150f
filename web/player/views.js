// Four views of a scene: two cameras, and what moves them.
import { MOUSE, OrthographicCamera, PerspectiveCamera, TOUCH, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

/** Names of the views, in the order of their buttons. */
export const VIEWS = ["orbit", "side", "plan", "follow"];

const UP = new Vector3(0, 0, 1);
/** Vertical opening of the perspective camera [deg]. */
const OPENING_DEG = 32;
/** From where each view looks at the vehicle, as a direction in the frame of its heading. */
const FROM = { orbit: [-0.42, -1, 0.52], side: [0, -1, 0.0], plan: [0, 0, 1], follow: [-1, -0.0, 0.42] };

/** Half of what each view shows at least, over the vehicle's reach: from below to above, and across. */
const ROOM = { orbit: [0.82, 1.1], side: [0.72, 1.15], plan: [1.1, 1.3], follow: [0.82, 1.1] };
/** From where the orbit view looks at vehicles side by side, and what part of their distance each view needs from below to above. */
const FROM_GROUP = [-0.8, -1, 0.8], ACROSS = { orbit: 0.6, side: 0, plan: 1, follow: 0.45 };
/** Ground ends so far from the vehicle [m] (ground.js), and what is behind it must be seen. */
const GROUND_M = 130;

/** Cameras that go with a vehicle; the user turns, moves and enlarges. */
export class Views {
  constructor(element, changed) {
    this.perspective = new PerspectiveCamera(OPENING_DEG, 1, 0.01, 100);
    this.flat = new OrthographicCamera(-1, 1, 1, -1, 0.01, 100);
    this.controls = [this.perspective, this.flat].map((camera) => {
      camera.up.copy(UP);
      const controls = new OrbitControls(camera, element);
      controls.addEventListener("change", changed);
      controls.maxPolarAngle = 0.495 * Math.PI; // not from under the ground
      controls.enableZoom = false; // a wheel scrolls the page until the picture has been clicked
      return controls;
    });
    // In the flat views one finger moves, as nothing turns.
    const flat = this.controls[1];
    flat.enableRotate = false;
    flat.mouseButtons = { LEFT: MOUSE.PAN, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.PAN };
    flat.touches = { ONE: TOUCH.PAN, TWO: TOUCH.DOLLY_PAN };
    element.style.touchAction = "pan-y"; // a finger up and down scrolls the page, sideways it turns, two enlarge
    element.addEventListener("pointerdown", () => { this.#zooms(true); element.focus({ preventScroll: true }); }, { capture: true });
    element.addEventListener("focus", () => this.#zooms(true));
    element.addEventListener("blur", () => this.#zooms(false));
    this.at = new Vector3();
    this.turn = 0;
    this.reach = this.extent = 1; // of a vehicle, and of all that are kept in view [m]
    this.aspect = 1;
    this.set("orbit");
  }

  get isFlat() { return this.name === "side" || this.name === "plan"; }
  get camera() { return this.isFlat ? this.flat : this.perspective; }
  get #active() { return this.controls[this.isFlat ? 1 : 0]; }

  #zooms(on) { this.controls.forEach((controls) => { controls.enableZoom = on; }); }

  /** Chooses a view and puts its camera where it begins. */
  set(name) {
    this.name = name;
    this.controls.forEach((controls) => { controls.enabled = controls === this.#active; });
    this.home();
  }

  /** Puts the camera back to where its view begins. */
  home() {
    const { camera, reach } = this, active = this.#active;
    const from = new Vector3(...(this.group && this.name === "orbit" ? FROM_GROUP : FROM[this.name])).normalize();
    if (this.name === "side" || this.name === "follow") from.applyAxisAngle(UP, this.turn);
    active.target.copy(this.at).addScaledVector(UP, this.name === "plan" ? 0 : 0.22 * reach);
    const room = this.#needed();
    if (this.isFlat) {
      active.minPolarAngle = 0;
      active.maxPolarAngle = Math.PI;
      camera.up.copy(this.name === "plan" ? new Vector3(0, 1, 0) : UP);
      camera.zoom = 1;
      this.room = room;
      camera.position.copy(active.target).addScaledVector(from, 40 * reach);
    } else {
      camera.position.copy(active.target).addScaledVector(from, room / Math.sin(OPENING_DEG / 2 * Math.PI / 180));
      active.minDistance = 0.6 * reach;
      active.maxDistance = 60 * reach;
    }
    camera.lookAt(active.target);
    this.#shape();
    active.update();
  }

  resize(aspect) {
    const first = this.aspect === 1 && aspect !== 1;
    this.aspect = aspect;
    if (first) this.home(); else this.#shape();
  }

  /** How large the vehicle is [m]; the first time and after another vehicle the cameras go where they begin. */
  setReach(reach) {
    if (Math.abs(reach - this.reach) < 0.05 * this.reach) return false;
    this.extent += reach - this.reach;
    this.reach = reach;
    return true;
  }

  /** Are several vehicles side by side? Then the orbit view begins elsewhere. */
  setGroup(group) {
    if (group === Boolean(this.group)) return;
    this.group = group;
    if (!group) this.extent = this.reach;
    this.home();
  }

  // Half of what is seen from below to above: the vehicles with a little around them, wide or tall as the picture is.
  #needed() {
    const { name, reach, extent, aspect } = this, [tall, wide] = ROOM[name];
    return Math.max(tall * reach + ACROSS[name] * (extent - reach), wide * extent / aspect);
  }

  /** Goes with the vehicles: their place [m] and heading [rad], and how far they reach from there [m]; it goes back as they go apart. */
  track(place, turn, extent = this.reach) {
    const before = this.#needed();
    this.extent = extent;
    const grows = this.#needed() / before;
    const delta = new Vector3(...place).sub(this.at), by = turn - this.turn;
    this.at.set(...place);
    this.turn = turn;
    const active = this.#active, { camera } = this;
    camera.position.add(delta);
    active.target.add(delta);
    if (this.isFlat) this.room *= grows;
    else camera.position.sub(active.target).multiplyScalar(grows).add(active.target);
    if ((this.name === "side" || this.name === "follow") && by) camera.position.sub(active.target).applyAxisAngle(UP, by).add(active.target);
    camera.lookAt(active.target);
    this.#shape();
  }

  /** Enlarges: below 1 it goes further away. */
  zoom(factor) {
    const { camera } = this, { target, minDistance, maxDistance } = this.#active;
    if (this.isFlat) camera.zoom = Math.min(Math.max(camera.zoom * factor, 0.05), 20);
    else {
      const away = camera.position.clone().sub(target);
      camera.position.copy(target).add(away.setLength(Math.min(Math.max(away.length() / factor, minDistance), maxDistance)));
    }
    this.#shape();
    this.#active.update();
  }

  /** Turns about the vehicle [rad], where the view turns: to the right and up. */
  rotate(right, up) {
    if (this.isFlat) return;
    const { camera } = this, { target } = this.#active, away = camera.position.clone().sub(target);
    const level = Math.hypot(away.x, away.y), height = Math.atan2(away.z, level), long = away.length();
    const tilt = Math.min(Math.max(height + up, 0.02), 1.5), heading = Math.atan2(away.y, away.x) + right;
    camera.position.set(Math.cos(heading) * Math.cos(tilt), Math.sin(heading) * Math.cos(tilt), Math.sin(tilt)).multiplyScalar(long).add(target);
    this.#active.update();
  }

  /** How large a pixel is at a place [m]. */
  pixelM(place, height) {
    if (this.isFlat) return (this.flat.top - this.flat.bottom) / this.flat.zoom / height;
    return 2 * this.perspective.position.distanceTo(place) * Math.tan(OPENING_DEG / 2 * Math.PI / 180) / height;
  }

  #shape() {
    const { reach, extent, aspect, perspective, flat, room = 1 } = this;
    Object.assign(flat, { left: -room * aspect, right: room * aspect, top: room, bottom: -room, far: 40 * reach + GROUND_M });
    // From the side the ground is cut just before the vehicle: hills nearer to the camera hide nothing.
    flat.near = this.name === "side" ? Math.max(0.01, 40 * reach - 1.05 * extent) : 0.01;
    Object.assign(perspective, { aspect, near: 0.03 * reach, far: 200 * reach });
    perspective.updateProjectionMatrix();
    flat.updateProjectionMatrix();
  }

  dispose() { this.controls.forEach((controls) => controls.dispose()); }
}
