// One run in the scene: bodies, wheels, the forces of the ground, slip and the path so far.
import {
  BoxGeometry, BufferAttribute, BufferGeometry, CircleGeometry, Color, ConeGeometry, CylinderGeometry, EdgesGeometry, Group,
  InstancedMesh, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, Quaternion, SphereGeometry, TorusGeometry,
  Vector3,
} from "three";
import { RoundedBoxGeometry } from "three/addons/geometries/RoundedBoxGeometry.js";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { WHEEL_COLOURS } from "./looks.js";

/** Below this slip ratio a wheel has no ring. */
const LEAST_SLIP = 0.1;
/** An arrow is at most so many times the vehicle's radius long. */
const LONGEST = 1.2;
const UP = new Vector3(0, 1, 0);

/** The colour of a wheel, by its number in the vehicle. */
export const wheelColour = (scene, k) => scene.wheels[k].colour ?? WHEEL_COLOURS[k % WHEEL_COLOURS.length];

/** How far a vehicle reaches from its base [m]. */
export function reach(scene, poses) {
  const base = poses[0];
  const away = ([x, y, z]) => Math.hypot(x - base[0], y - base[1], z - base[2]);
  const wheels = scene.wheels.map(({ frame, radius_m: radius }) => away(poses[frame]) + radius);
  const bodies = scene.bodies.map(({ frame, at_m: at, edges_m: edges }) => away(poses[frame]) + Math.hypot(...at.map((a, k) => Math.abs(a) + edges[k] / 2)) * 0.8);
  return Math.max(0.05, ...wheels, ...bodies);
}

// How far a wheel reaches from its centre along the axes of a frame, in which its axle is [m].
const halfOf = ({ radius_m: radius, width_m: width }, axle) => axle.toArray().map((a) => radius * Math.sqrt(Math.max(0, 1 - a * a)) + width / 2 * Math.abs(a));

/**
 * What is drawn of a body as a solid: the box of a vehicle's file without what would hide its wheels. It is narrower where they are at its
 * sides, and begins above them where they are below it; bars keep their shape. Edges and centre, or nothing where little would stay.
 */
function solidOf({ frame, at_m: at, edges_m: edges }, scene, poses) {
  if (poses.length === 0 || edges[2] < Math.max(...scene.wheels.map(({ radius_m: radius }) => radius), 0)) return [edges, at];
  const turned = (pose) => new Quaternion(...pose.slice(3, 7)), back = turned(poses[frame]).invert();
  const wheels = scene.wheels.map((disc) => {
    const pose = poses[disc.frame], axle = new Vector3(...disc.axle).normalize().applyQuaternion(turned(pose)).applyQuaternion(back);
    return { at: new Vector3(...pose.slice(0, 3)).sub(new Vector3(...poses[frame].slice(0, 3))).applyQuaternion(back).toArray(), half: halfOf(disc, axle) };
  });
  const inside = wheels.filter(({ at: centre, half }) => centre.every((place, k) => Math.abs(place - at[k]) < half[k] + edges[k] / 2 - 1e-6));
  if (inside.length === 0) return [edges, at];
  const narrow = 2 * Math.min(...inside.map(({ at: centre, half }) => Math.abs(centre[1] - at[1]) - half[1])) - 0.03 * edges[1];
  if (narrow > 0.6 * edges[1]) return [[edges[0], narrow, edges[2]], at];
  const top = at[2] + edges[2] / 2, from = Math.max(...inside.map(({ at: centre, half }) => centre[2] + half[2])) + 0.02 * edges[2], tall = top - from;
  return tall > 0.15 * edges[2] ? [[edges[0], edges[1], tall], [at[0], at[1], top - tall / 2]] : null;
}

// A wheel about +y that rolls along +x, turned to where its axle is.
function wheelGeometry({ radius_m: radius, width_m: width, roller_angle_rad: slant }) {
  const rollers = Number.isFinite(slant), roller = Math.min(0.17 * radius, 0.5 * width);
  const rim = rollers ? radius - 1.35 * roller : radius;
  return { rollers, roller, rim, hub: new CylinderGeometry(rim, rim, 0.92 * width, 40, 1, true), radius, width, slant };
}

// A face of six sectors, one of them white: one sees it turn.
function face(radius, colour) {
  const circle = new CircleGeometry(radius, 36).toNonIndexed(), colours = [];
  const [light, dark, white] = [new Color(colour), new Color(colour).multiplyScalar(0.45), new Color("#ffffff")];
  for (let triangle = 0; triangle < 36; triangle += 1) {
    const sector = Math.floor(triangle / 6), shade = triangle < 3 ? white : sector % 2 ? dark : light;
    for (let corner = 0; corner < 3; corner += 1) colours.push(shade.r, shade.g, shade.b);
  }
  circle.setAttribute("color", new BufferAttribute(new Float32Array(colours), 3));
  return circle;
}

function rollersOf({ radius, width, roller, slant }, colour, material) {
  const count = Math.min(24, Math.max(8, Math.round(2 * Math.PI * radius / (2.9 * roller))));
  // Long enough to hide the gaps, no longer than the wheel is wide where it leans across.
  const long = Math.min(Math.PI * (radius - roller) / count * 0.98 / Math.max(Math.cos(slant), 0.3), Math.abs(Math.sin(slant)) > 0.1 ? width / 2 / Math.abs(Math.sin(slant)) : Infinity);
  const mesh = new InstancedMesh(new SphereGeometry(1, 12, 8).scale(long, roller, roller), material, count);
  const [light, dark, white] = [new Color(colour), new Color(colour).multiplyScalar(0.5), new Color("#ffffff")];
  // On the ground a roller's axis is turned to the left of the rolling direction by the roller angle.
  const bottom = new Matrix4().makeTranslation(0, 0, roller - radius).multiply(new Matrix4().makeRotationZ(slant));
  for (let k = 0; k < count; k += 1) {
    mesh.setMatrixAt(k, new Matrix4().makeRotationY(2 * Math.PI * k / count).multiply(bottom));
    mesh.setColorAt(k, k === 0 ? white : k % 2 ? dark : light);
  }
  return mesh;
}

function wheel(disc, colour) {
  const group = new Group(), spin = new Group(), shape = wheelGeometry(disc);
  const plain = new MeshLambertMaterial({ color: new Color(colour).multiplyScalar(0.6) });
  const painted = new MeshLambertMaterial({ vertexColors: true });
  const hub = new Mesh(shape.hub, plain);
  spin.add(hub);
  for (const side of [-1, 1]) {
    const disk = new Mesh(face(shape.rim, colour).rotateX(-side * Math.PI / 2).translate(0, side * 0.46 * disc.width_m, 0), painted);
    spin.add(disk);
  }
  const solids = [plain, painted];
  if (shape.rollers) {
    solids.push(new MeshLambertMaterial());
    const rollers = rollersOf(shape, colour, solids[2]);
    spin.add(rollers);
  }
  const ring = new Mesh(new TorusGeometry(1.14 * disc.radius_m, 0.07 * disc.radius_m, 8, 40).rotateX(Math.PI / 2), new MeshBasicMaterial({ transparent: true }));
  ring.visible = false;
  spin.rotation.z = ring.rotation.z = Math.atan2(-disc.axle[0], disc.axle[1]);
  spin.rotation.order = ring.rotation.order = "ZYX"; // first about the axle, then to where it is
  group.add(spin, ring);
  return { group, spin, ring, disc, solids };
}

function arrow(material) {
  const group = new Group();
  const [shaft, head] = [new Mesh(new CylinderGeometry(1, 1, 1, 10).translate(0, 0.5, 0), material), new Mesh(new ConeGeometry(2.6, 1, 14).translate(0, 0.5, 0), material)];
  shaft.renderOrder = head.renderOrder = 5;
  group.add(shaft, head);
  group.visible = false;
  return { group, shaft, head };
}

/** One run: made once, placed by each state. */
export class Vehicle {
  constructor(scene) {
    this.scene = scene;
    this.object = new Group();
    this.object.visible = false;
    this.edge = new LineMaterial({ linewidth: 2 });
    this.fill = new MeshLambertMaterial({ transparent: true, depthWrite: false });
    this.bodies = scene.bodies.map((body) => {
      const group = new Group(), box = new BoxGeometry(...body.edges_m).translate(...body.at_m);
      const solid = new Mesh(box, this.fill);
      solid.renderOrder = 2;
      const edges = new LineSegments2(new LineSegmentsGeometry().fromEdgesGeometry(new EdgesGeometry(box)), this.edge);
      edges.renderOrder = 3;
      group.add(solid, edges);
      this.object.add(group);
      return { group, glass: [solid, edges], solid, edges, frame: body.frame, body };
    });
    this.hull = new MeshLambertMaterial({ transparent: true }); // drawn after the path, which nothing else hides
    this.glass = true;
    this.wheels = scene.wheels.map((disc, k) => wheel(disc, wheelColour(scene, k)));
    this.force = new MeshBasicMaterial({ depthTest: false, transparent: true });
    this.arrows = scene.wheels.map(() => arrow(this.force));
    for (const { group } of [...this.wheels, ...this.arrows]) this.object.add(group);
    this.line = new LineMaterial({ linewidth: 2.6, depthTest: false, transparent: true, opacity: 0.85 });
    this.path = null;
    this.mark = new MeshBasicMaterial();
    this.marks = [];
    // Which way is ahead.
    const tip = new BufferGeometry();
    tip.setAttribute("position", new BufferAttribute(new Float32Array([1, 0, 0, -0.6, 0.75, 0, -0.2, 0, 0, 1, 0, 0, -0.2, 0, 0, -0.6, -0.75, 0]), 3));
    this.ahead = new Mesh(tip, new MeshBasicMaterial({ depthTest: false, transparent: true, opacity: 0.9 }));
    this.ahead.renderOrder = 4;
    this.base = new Group();
    this.base.add(this.ahead);
    this.object.add(this.base);
  }

  /** Sets how large marks are: the vehicle's reach [m]. */
  setReach(reachM) {
    this.reach = reachM;
    this.ahead.scale.setScalar(0.09 * reachM);
    this.ahead.position.set(1.12 * reachM, 0, 0.02 * reachM);
  }

  /**
   * Colours. Alone where no other run is shown: else they tell runs apart. Apart where no other run is in the same place: bodies are solid
   * then. Else they are glass, and only the wheels of the lead, the first that is shown, are solid: what is behind must be seen.
   */
  setLooks(look, colour, { alone, lead, apart }) {
    lead ||= apart;
    this.glass = !apart;
    this.force.depthTest = this.ahead.material.depthTest = apart;
    for (const { glass, hull } of this.bodies) {
      for (const part of glass) part.visible = this.glass;
      if (hull) hull.visible = !this.glass;
    }
    this.hull.color.set(alone ? look.body : colour);
    if (!alone) this.hull.color.lerp(new Color(look.body), 0.25);
    this.fill.opacity = alone ? 0.24 : lead ? 0.16 : 0.04;
    this.force.opacity = lead ? 0.9 : 0.5;
    this.edge.linewidth = lead ? 2.2 : 1.6;
    this.ahead.visible = lead;
    // The lead over the others, where these are in the same place.
    for (const { solid, edges } of this.bodies) { solid.castShadow = lead; edges.renderOrder = lead ? 3.5 : 3; }
    this.pathOrder = lead ? 1.5 : 1;
    if (this.path) this.path.renderOrder = this.pathOrder;
    for (const { spin } of this.wheels) for (const part of spin.children) part.castShadow = lead;
    for (const material of this.wheels.flatMap(({ solids }) => solids)) Object.assign(material, { transparent: !lead, opacity: lead ? 1 : 0.45 });
    this.edge.color.set(colour);
    this.fill.color.set(alone ? look.body : colour);
    this.force.color.set(alone ? look.force : colour);
    this.line.color.set(colour);
    this.mark.color.set(look.edge);
    this.ahead.material.color.set(colour);
    for (const { ring } of this.wheels) ring.material.color.set(look.alarm);
  }

  /** Places everything as one state has it. */
  place(state, metresPerNewton) {
    this.object.visible = true;
    const put = (object, pose) => { object.position.set(pose[0], pose[1], pose[2]); object.quaternion.set(pose[3], pose[4], pose[5], pose[6]); };
    put(this.base, state.poses[0]);
    if (!this.glass) this.#hulls(state.poses);
    for (const { group, frame } of this.bodies) put(group, state.poses[frame]);
    this.wheels.forEach(({ group, spin, ring, disc }, k) => {
      const shown = state.wheels?.[k] ?? {};
      put(group, state.poses[disc.frame]);
      if (Number.isFinite(shown.angle_rad)) spin.rotation.y = shown.angle_rad;
      const slip = Math.min(Math.abs(shown.slip ?? 0), 1);
      ring.visible = slip > LEAST_SLIP;
      ring.material.opacity = 0.25 + 0.75 * slip;
      this.#push(this.arrows[k], shown.push, metresPerNewton);
    });
    this.#way(state.path_m, state.path_points);
    this.#edges(state.edges ?? []);
  }

  // Solid bodies, made with the first state: it has where the wheels are.
  #hulls(poses) {
    if (this.made) return;
    this.made = true;
    for (const each of this.bodies) {
      const shown = solidOf(each.body, this.scene, poses);
      if (!shown) continue;
      const [edges, at] = shown;
      each.hull = new Mesh(new RoundedBoxGeometry(...edges, 3, Math.min(0.03, 0.22 * Math.min(...edges))).translate(...at), this.hull);
      each.hull.renderOrder = 2;
      each.hull.castShadow = each.hull.receiveShadow = true;
      each.group.add(each.hull);
    }
  }

  #push({ group, shaft, head }, push, metresPerNewton) {
    const [force, at] = push ?? [[0, 0, 0], [0, 0, 0]];
    const long = Math.min(metresPerNewton * Math.hypot(...force), LONGEST * this.reach);
    group.visible = long > 0.01 * this.reach;
    if (!group.visible) return;
    const thick = 0.013 * this.reach, tip = Math.min(0.12 * this.reach, 0.5 * long);
    group.position.set(...at);
    group.quaternion.copy(new Quaternion().setFromUnitVectors(UP, new Vector3(...force).normalize()));
    shaft.scale.set(thick, long - tip, thick);
    head.position.y = long - tip;
    head.scale.set(thick, tip, thick);
  }

  // Edges of the ground that a wheel climbed or left: a bar from the ground before to that beyond, and one across its upper end.
  #edges(edges) {
    while (this.marks.length < edges.length) {
      const group = new Group(), bar = new Mesh(new BoxGeometry(1, 1, 1), this.mark), top = new Mesh(new BoxGeometry(1, 1, 1), this.mark);
      group.add(bar, top);
      this.object.add(group);
      this.marks.push({ group, bar, top });
    }
    this.marks.forEach(({ group, bar, top }, k) => {
      group.visible = k < edges.length;
      if (!group.visible) return;
      const [x, y, from, to] = edges[k], thick = 0.03 * this.reach;
      group.position.set(x, y, Math.min(from, to));
      bar.scale.set(thick, thick, Math.max(Math.abs(to - from), 1e-3));
      bar.position.z = bar.scale.z / 2;
      top.scale.set(0.4 * thick, 4 * thick, 0.4 * thick);
      top.position.z = bar.scale.z;
    });
  }

  #way(points, count = points ? points.length / 3 : 0) {
    if (this.path) this.path.visible = count > 1;
    if (count <= 1) return;
    if (this.points !== points || this.length !== points.length) { // another path, or one that has grown
      if (this.path) { this.object.remove(this.path); this.path.geometry.dispose(); }
      this.path = new Line2(new LineGeometry().setPositions(Array.from(points)), this.line);
      this.path.frustumCulled = false;
      this.path.renderOrder = this.pathOrder ?? 1;
      this.object.add(this.path);
      [this.points, this.length] = [points, points.length];
    }
    this.path.geometry.instanceCount = count - 1;
  }
}

/** Frees what a part of the scene holds on the graphics card. */
export function dispose(object) {
  object.traverse((part) => {
    part.geometry?.dispose();
    part.material?.dispose();
    if (part instanceof InstancedMesh) part.dispose();
  });
}
