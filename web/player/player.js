// A scene with vehicles, drawn when something has changed. README.md has the form of scene and states.
import { Color, DirectionalLight, Fog, HemisphereLight, Scene, SRGBColorSpace, Vector3, WebGLRenderer } from "three";
import { Frame } from "./frame.js";
import { Ground } from "./ground.js";
import { looks, runColour } from "./looks.js";
import { dispose, reach, Vehicle } from "./vehicle.js";
import { VIEWS, Views } from "./views.js";

const NO_WEBGL = "The scene needs WebGL 2, which this browser does not have or does not allow. Everything else on this page works without it.";
/** An arrow as long as this part of the vehicle's reach is a wheel's even share of the load. */
const SHARE_LONG = 0.45;

/** Of vehicles side by side, how far each is from the next over its width; they are kept in view up to so many times a vehicle's reach. */
const APART = 1.3, FARTHEST = 6;

/** Is the ground the same however far to the side a vehicle is, so that each may stand beside the other? */
const sameAcross = ({ ground, patches = [] }) => patches.length === 0 && ground.every(({ kind, half_m: half, half_length_m: long = Infinity, at_m: at }) => {
  const wide = kind === "box" ? half[1] : kind === "bar" ? long : 0;
  return wide - Math.abs(at?.[1] ?? 0) > 100;
});

/** Does this browser draw with WebGL 2? */
export function hasWebGL() {
  try {
    return Boolean(document.createElement("canvas").getContext("webgl2"));
  } catch {
    return false;
  }
}

const heading = ([, , , x, y, z, w]) => Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));

export class Player {
  #element; #frame; #views; #renderer; #canvas; #world; #sun; #sky; #ground; #vehicles = [];
  #shiftTurns = false; #beside = false; #offsets = [];
  #scene; #states = []; #forces = false; #edges = false; #dark; #wanted = 0; #observer; #metresPerNewton = 0; #gone = false;

  /**
   * Fills an element, whose size it takes.
   * options: dark (false), view ("orbit"), legend (true), onView (called with the name of a view that was chosen), shiftTurns (false; true:
   * arrow keys are the page's, and turn the view with Shift).
   */
  constructor(element, scene, { dark = false, view = "orbit", legend = true, onView, shiftTurns = false } = {}) {
    this.#shiftTurns = shiftTurns;
    this.#element = element;
    this.#dark = dark;
    this.onView = onView;
    this.#frame = new Frame(element, { choose: (name) => this.setView(name), zoom: (factor) => this.zoom(factor), home: () => this.home(), legend });
    /** False where nothing can be drawn: every call is harmless then. */
    this.webgl = hasWebGL();
    if (this.webgl) {
      try {
        this.#renderer = new WebGLRenderer({ antialias: true });
      } catch {
        this.webgl = false;
      }
    }
    if (!this.webgl) {
      this.#frame.setLooks(looks(dark));
      this.#frame.refuse(NO_WEBGL);
      return;
    }
    this.#canvas = this.#renderer.domElement;
    this.#canvas.tabIndex = 0;
    this.#canvas.setAttribute("role", "img");
    this.#canvas.setAttribute("aria-label", `The vehicle on its ground. ${shiftTurns ? "Shift and arrow keys" : "Arrow keys"} turn the view, plus and minus enlarge and reduce.`);
    this.#canvas.addEventListener("keydown", (event) => this.#key(event));
    element.prepend(this.#canvas);
    this.#renderer.outputColorSpace = SRGBColorSpace;
    this.#renderer.shadowMap.enabled = true;
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio || 1, 2));
    this.#world = new Scene();
    this.#world.background = new Color();
    this.#world.fog = new Fog(0, 1, 2);
    this.#sun = new DirectionalLight("#ffffff", 1);
    this.#sun.castShadow = true;
    this.#sun.shadow.mapSize.set(1024, 1024);
    this.#sun.shadow.intensity = 0.45;
    this.#sky = new HemisphereLight("#ffffff", "#b9b4aa", 1);
    this.#sky.position.set(0, 0, 1);
    this.#world.add(this.#sun, this.#sun.target, this.#sky);
    this.#views = new Views(this.#canvas, () => this.#render());
    this.#observer = new ResizeObserver(() => this.resize());
    this.#observer.observe(element);
    this.setScene(scene);
    this.setView(view, false);
    this.resize();
  }

  /** The names of the views. */
  static get views() { return [...VIEWS]; }

  /** What was shown last. */
  get states() { return this.#states; }

  /** The view that is shown. */
  get view() { return this.#views?.name ?? "orbit"; }

  /** Shows another vehicle, ground or set of runs. */
  setScene(scene) {
    this.#scene = scene = { runs: [{ name: scene.vehicle ?? "" }], ...scene };
    this.#states = [];
    this.#forces = this.#edges = false;
    if (!this.webgl) return;
    for (const part of [this.#ground?.object, ...this.#vehicles.map(({ object }) => object)]) {
      if (part) { this.#world.remove(part); dispose(part); }
    }
    this.#ground = new Ground(scene.ground, scene.patches ?? []);
    this.#world.add(this.#ground.object);
    this.#vehicles = scene.runs.map(() => new Vehicle(scene));
    for (const vehicle of this.#vehicles) { vehicle.setReach(this.#views.reach); this.#world.add(vehicle.object); }
    this.#metresPerNewton = scene.metres_per_newton ?? 0;
    // Beside each other only where the ground allows it: else each would be where its own ground is not.
    this.#beside = Boolean(scene.side_by_side) && scene.runs.length > 1 && sameAcross(scene);
    this.#offsets = scene.runs.map(() => 0);
    this.#views.setGroup(this.#beside);
    this.#frame.setScene(scene);
    this.setTheme(this.#dark);
  }

  /** Shows a state of each run, in the order of the scene's runs; a run whose state is null is hidden. */
  show(states) {
    const alone = (all) => all.filter(Boolean).length === 1;
    const another = states.length !== this.#states.length || states.some((state, k) => !state !== !this.#states[k]) || alone(states) !== alone(this.#states);
    this.#states = states;
    if (!this.webgl) return;
    const forces = states.some((state) => state?.wheels?.some(({ push }) => push)), edges = states.some((state) => state?.edges?.length > 0);
    const other = forces !== this.#forces || edges !== this.#edges;
    [this.#forces, this.#edges] = [forces, edges];
    const lead = states.find(Boolean);
    if (lead) {
      if (this.#beside) this.#putApart(lead);
      const size = reach(this.#scene, lead.poses);
      if (this.#views.setReach(size)) {
        for (const vehicle of this.#vehicles) vehicle.setReach(size);
        this.#views.track(...this.#followed(lead));
        this.#views.home();
      } else this.#views.track(...this.#followed(lead));
      this.#light();
      this.#scaleForces(lead);
      this.#ground.near(lead.poses[0]);
    }
    this.#vehicles.forEach((vehicle, k) => {
      if (states[k]) vehicle.place(states[k], this.#metresPerNewton);
      else vehicle.object.visible = false;
    });
    if (another) {
      this.#paint();
      // Bodies are made solid when they are first shown so.
      this.#vehicles.forEach((vehicle, k) => { if (states[k]) vehicle.place(states[k], this.#metresPerNewton); });
    }
    else if (other) this.#tell();
    this.#render();
  }

  setTheme(dark) {
    this.#dark = dark;
    const look = looks(dark);
    this.#frame.setLooks(look);
    if (!this.webgl) return;
    this.#world.background.set(look.paper);
    this.#world.fog.color.set(look.paper);
    this.#sun.intensity = look.sun;
    this.#sky.intensity = look.sky;
    this.#ground.setLooks(look);
    this.#paint();
    this.#render();
  }

  setView(name, notify = true) {
    if (!VIEWS.includes(name) || !this.webgl) return;
    this.#views.set(name);
    this.#frame.setView(name);
    if (notify) this.onView?.(name);
    this.#render();
  }

  zoom(factor) { this.#views?.zoom(factor); this.#render(); }

  /** The view as it began. */
  home() { this.#views?.home(); this.#render(); }

  /** Takes the element's size. It does so by itself when that changes. */
  resize() {
    if (!this.webgl || this.#gone) return;
    const { clientWidth: width, clientHeight: height } = this.#element;
    if (!width || !height) return;
    this.#renderer.setSize(width, height);
    this.#views.resize(width / height);
    this.#draw(); // at once: setSize has cleared the picture
  }

  dispose() {
    this.#gone = true;
    cancelAnimationFrame(this.#wanted);
    this.#observer?.disconnect();
    this.#views?.dispose();
    if (this.webgl) {
      dispose(this.#world);
      this.#renderer.dispose();
      this.#renderer.forceContextLoss();
      this.#canvas.remove();
    }
    this.#frame.dispose();
  }

  // The runs that are shown, by number.
  get #shown() { return this.#scene.runs.map((_, k) => k).filter((k) => this.#states[k]); }

  #colour(k) {
    const own = this.#scene.runs[k].colour;
    return (Array.isArray(own) ? own[this.#dark ? 1 : 0] : own) ?? runColour(k, this.#dark);
  }

  // Each beside the other, the first one nearest to where the views look from.
  #putApart({ poses }) {
    if (this.#offsets.some(Boolean)) return;
    const [, y] = poses[0], { wheels, bodies } = this.#scene;
    const half = Math.max(...wheels.map(({ frame, radius_m: radius }) => Math.abs(poses[frame][1] - y) + radius), ...bodies.map(({ frame, at_m: at, edges_m: edges }) => Math.abs(poses[frame][1] + at[1] - y) + edges[1] / 2));
    this.#offsets = this.#offsets.map((_, k) => (k - (this.#offsets.length - 1) / 2) * 2 * half * APART);
    this.#vehicles.forEach(({ object }, k) => { object.position.y = this.#offsets[k]; });
  }

  // What the camera goes with: place, heading, and how far all that is to be seen reaches from there.
  #followed(lead) {
    const place = (k) => { const [x, y, z] = this.#states[k].poses[0]; return new Vector3(x, y + this.#offsets[k], z); };
    const { reach: size } = this.#views, shown = this.#shown, turn = heading(lead.poses[0]);
    if (!this.#scene.side_by_side || shown.length < 2) return [lead.poses[0].slice(0, 3), turn, size];
    const first = place(shown[0]), middle = shown.reduce((total, k) => total.add(place(k)), new Vector3()).divideScalar(shown.length);
    const to = middle.sub(first);
    to.setLength(Math.min(to.length(), FARTHEST * size));
    const centre = first.clone().add(to);
    return [centre.toArray(), turn, size + Math.min(Math.max(...shown.map((k) => place(k).distanceTo(centre))), FARTHEST * size)];
  }

  // Colours of runs, and what the legend says.
  #paint() {
    const look = looks(this.#dark), shown = this.#shown;
    this.#vehicles.forEach((vehicle, k) => vehicle.setLooks(look, this.#colour(k), { alone: shown.length <= 1, lead: shown.length === 0 || shown[0] === k, apart: shown.length <= 1 || this.#beside }));
    this.#tell();
  }

  // The legend: the first states of a run may have no forces yet.
  #tell() {
    const runs = this.#shown.map((k) => ({ name: this.#scene.runs[k].name, colour: this.#colour(k) }));
    this.#frame.setLegend(runs, looks(this.#dark), { forces: this.#forces, edges: this.#edges, patches: this.#scene.patches ?? [] });
  }

  // Where the scene does not say it: by the load of the first state that has one.
  #scaleForces({ wheels }) {
    if (this.#metresPerNewton || !wheels) return;
    const loads = wheels.filter(({ push }) => push).map(({ push: [force] }) => Math.hypot(...force));
    const mean = loads.reduce((total, load) => total + load, 0) / this.#scene.wheels.length;
    if (mean > 0) this.#metresPerNewton = SHARE_LONG * this.#views.reach / mean;
  }

  #light() {
    const { extent: size } = this.#views, { camera } = this.#sun.shadow;
    if (camera.right === 2 * size) return;
    Object.assign(camera, { left: -2 * size, right: 2 * size, top: 2 * size, bottom: -2 * size, near: 0.1 * size, far: 12 * size });
    camera.updateProjectionMatrix();
    this.#sun.shadow.normalBias = 0.004 * size;
  }

  #render() {
    if (!this.webgl || this.#wanted || this.#gone) return;
    this.#wanted = requestAnimationFrame(() => { this.#wanted = 0; this.#draw(); });
  }

  #draw() {
    const { camera, at, extent: size, isFlat } = this.#views;
    this.#sun.target.position.copy(at);
    this.#sun.position.copy(at).add(new Vector3(-1.4, -2.2, 5).multiplyScalar(size));
    const away = camera.position.distanceTo(at);
    Object.assign(this.#world.fog, isFlat ? { near: 1e6, far: 2e6 } : { near: Math.max(6 * size, 1.4 * away), far: Math.max(16 * size, 4 * away) });
    this.#renderer.render(this.#world, camera);
    this.#label();
  }

  // Labels are of the first run that is shown: with more they would hide the wheels.
  #label() {
    const { clientWidth: width, clientHeight: height } = this.#element, lead = this.#states.find(Boolean), { camera } = this.#views;
    if (this.#beside) {
      // Beside each other, runs have their names above them instead.
      const above = new Vector3(0, 0, this.#views.name === "plan" ? 0 : 0.62 * this.#views.reach);
      this.#frame.place(null);
      this.#frame.placeNames(this.#shown.map((k) => {
        const [x, y, z] = this.#states[k].poses[0], place = new Vector3(x, y + this.#offsets[k], z).add(above).project(camera);
        return [this.#scene.runs[k].name, this.#colour(k), (place.x + 1) / 2 * width, (1 - place.y) / 2 * height];
      }));
      return;
    }
    this.#frame.placeNames([]);
    const seen = lead && this.#scene.wheels.map(({ frame, radius_m: radius }) => {
      const place = new Vector3(...lead.poses[frame].slice(0, 3)).add(new Vector3(0, this.#offsets[this.#states.indexOf(lead)], 0)), metres = this.#views.pixelM(place, height);
      const { x, y, z } = place.project(camera);
      return Math.abs(x) <= 1 && Math.abs(y) <= 1 && z < 1 ? [(x + 1) / 2 * width, (1 - y) / 2 * height, radius / metres] : null;
    });
    this.#frame.place(seen);
  }

  #key(event) {
    const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (turns && event.shiftKey !== this.#shiftTurns) return;
    if (turns) this.#views.rotate(...turns);
    else if (event.key === "+" || event.key === "=") this.zoom(1.1);
    else if (event.key === "-") this.zoom(1 / 1.1);
    else return;
    this.#render();
    event.preventDefault();
    event.stopPropagation();
  }
}
