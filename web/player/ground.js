// The ground of a scene: boxes, bars, fields of heights and meshes as three.js objects, tinted where patches of another friction are.
import {
  BoxGeometry, BufferAttribute, BufferGeometry, Color, CylinderGeometry, DoubleSide, EdgesGeometry, Group,
  LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial, Vector4,
} from "three";

/** Ground further away than this from where the camera has followed the vehicle to is not drawn [m]: precision of the depth buffer. */
const FAR_M = 60;
/** So far goes the vehicle before the ground is cut anew [m]. */
const AGAIN_M = 20;
/** Above so many parts their edges are not drawn: a field of columns is clearer without. */
const MOST_EDGED = 60;
/** Patches that are drawn at most: the shader looks at each of them. */
const MOST_PATCHES = 32;

/** What is near of a length from one end to another: the far side of a plain is kilometres away. */
const cut = (from, to, near) => [from, to].map((end) => Math.min(Math.max(end, near - FAR_M), near + FAR_M));

function box({ half_m: half, at_m: at, turn_y_rad: turn = 0 }, place) {
  // In the frame of the box, where its sides are along the axes.
  const [x, y, z] = place.map((value, k) => value - at[k]), [c, s] = [Math.cos(turn), Math.sin(turn)];
  const spans = [x * c - z * s, y, x * s + z * c].map((near, k) => cut(-half[k], half[k], near));
  const geometry = new BoxGeometry(...spans.map(([from, to]) => Math.max(to - from, 1e-6)));
  return geometry.translate(...spans.map(([from, to]) => (from + to) / 2)).rotateY(turn).translate(...at);
}

function bar({ radius_m: radius, at_m: [x, y, z], half_length_m: half = Infinity }, place) {
  const [from, to] = cut(y - half, y + half, place[1]);
  const long = Math.max(to - from, 1e-6);
  // In pieces: in one that is a thousand times as long as it is thick, the depth of what is near is wrong by more than a wheel.
  return new CylinderGeometry(radius, radius, long, 48, Math.min(Math.ceil(long), 120)).translate(x, (from + to) / 2, z); // about y
}

function surface(rows, columns, place) {
  const points = new Float32Array(3 * rows * columns), triangles = [];
  for (let i = 0; i < rows; i += 1) for (let j = 0; j < columns; j += 1) points.set(place(i, j), 3 * (i * columns + j));
  for (let i = 0; i + 1 < rows; i += 1) for (let j = 0; j + 1 < columns; j += 1) {
    const a = i * columns + j, b = a + columns;
    triangles.push(a, b, a + 1, b, b + 1, a + 1);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(points, 3));
  geometry.setIndex(triangles);
  return geometry;
}

function field({ from_m: from, extent_m: [long, wide], rows, columns, heights_m: heights }) {
  const place = (i, j) => [from + long * i / (rows - 1), wide / 2 - wide * j / (columns - 1), heights[i * columns + j]];
  const geometry = surface(rows, columns, place);
  geometry.computeVertexNormals();
  // Its first corner is at the left: turn the triangles to face upwards.
  if (geometry.getAttribute("normal").getZ(0) < 0) {
    geometry.index.array.reverse();
    geometry.computeVertexNormals();
  }
  return geometry;
}

function profile({ x_m: x, z_m: z, half_width_m: half = 3 }) {
  const geometry = surface(x.length, 2, (i, j) => [x[i], j ? half : -half, z[i]]).toNonIndexed();
  geometry.computeVertexNormals();
  return geometry;
}

function mesh({ vertices_m: vertices, triangles }) {
  const indexed = new BufferGeometry();
  indexed.setAttribute("position", new BufferAttribute(Float32Array.from(vertices.flat()), 3));
  indexed.setIndex(Array.from(triangles.flat()));
  const geometry = indexed.toNonIndexed(); // flat faces
  geometry.computeVertexNormals();
  return geometry;
}

const SHAPES = { box, bar, field, profile, mesh };

/** One geometry of all parts: a field shown as columns would else be a thousand draws. */
function merged(geometries) {
  const flat = geometries.map((geometry) => (geometry.index ? geometry.toNonIndexed() : geometry));
  const count = flat.reduce((total, geometry) => total + geometry.getAttribute("position").count, 0);
  const whole = new BufferGeometry();
  for (const name of ["position", "normal"]) {
    const values = new Float32Array(3 * count);
    let at = 0;
    for (const geometry of flat) { values.set(geometry.getAttribute(name).array, at); at += geometry.getAttribute(name).array.length; }
    whole.setAttribute(name, new BufferAttribute(values, 3));
  }
  return whole;
}

/** Lambert's shading, tinted by height (6 cm are most of it) and in patches, with lines every 0.1 and 0.5 m on what faces up. */
function groundMaterial(uniforms) {
  const material = new MeshLambertMaterial({ side: DoubleSide }), { length: count } = uniforms.patches.value;
  const inPatch = Array.from({ length: count }, (_, k) => `inside(patches[${k}])`).join(" || ");
  material.customProgramCacheKey = () => `${count} patches`;
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = `varying vec3 vPlace; varying vec3 vUp;\n${shader.vertexShader}`
      .replace("#include <begin_vertex>", "#include <begin_vertex>\n vPlace = position; vUp = normal;");
    shader.fragmentShader = `varying vec3 vPlace; varying vec3 vUp;
      uniform vec3 low; uniform vec3 level; uniform vec3 high; uniform vec3 grid; uniform vec3 mark;
      ${count ? `uniform vec4 patches[${count}];
      bool inside(vec4 p) { return vPlace.x >= p.x && vPlace.x <= p.y && vPlace.y >= p.z && vPlace.y <= p.w; }` : ""}
      float lines(vec2 p, float every) {
        vec2 q = p / every, w = fwidth(q);
        vec2 d = abs(fract(q - 0.5) - 0.5) / max(w, vec2(1e-6));
        return (1.0 - min(min(d.x, d.y), 1.0)) * clamp(1.0 - 4.0 * max(w.x, w.y), 0.0, 1.0);
      }
      ${shader.fragmentShader}`
      .replace("#include <color_fragment>", `#include <color_fragment>
      float tint = tanh(vPlace.z / 0.06);
      if (vUp.z <= 0.3) tint = max(tint, -0.3);
      vec3 earth = tint < 0.0 ? mix(level, low, -tint) : mix(level, high, tint);
      ${count ? `if (vUp.z > 0.3 && (${inPatch})) earth = mix(earth, mark, 0.3);` : ""}
      if (vUp.z > 0.3) earth = mix(earth, grid, 0.28 * lines(vPlace.xy, 0.1) + 0.35 * lines(vPlace.xy, 0.5));
      else earth = mix(earth, grid, 0.3); // sides, and a cut through the ground: neither as what is above nor as what is behind
      diffuseColor.rgb *= earth;`);
  };
  return material;
}

/** The ground of a scene, as far as it is near. */
export class Ground {
  constructor(parts, patches = []) {
    this.object = new Group();
    this.uniforms = Object.fromEntries(["low", "level", "high", "grid", "mark"].map((name) => [name, { value: new Color() }]));
    const shown = patches.slice(0, MOST_PATCHES).map(({ x_m: x, y_m: y }) => new Vector4(...x, ...y));
    this.solid = groundMaterial({ ...this.uniforms, patches: { value: shown } });
    this.edges = new LineBasicMaterial({ transparent: true, opacity: 0.55 });
    this.known = parts.filter(({ kind }) => kind in SHAPES);
    this.#build([0, 0, 0]);
  }

  /** The vehicle is there [m]. */
  near([x, y, z]) {
    if (Math.hypot(x - this.place[0], y - this.place[1], z - this.place[2]) > AGAIN_M) this.#build([x, y, z]);
  }

  #build(place) {
    this.place = place;
    for (const part of this.object.children) part.geometry.dispose();
    this.object.clear();
    const geometries = this.known.map((part) => SHAPES[part.kind](part, place));
    if (geometries.length === 0) return;
    const solid = new Mesh(merged(geometries), this.solid);
    solid.receiveShadow = true;
    this.object.add(solid);
    if (geometries.length <= MOST_EDGED) {
      geometries.forEach((geometry, k) => {
        if (this.known[k].kind !== "field") this.object.add(new LineSegments(new EdgesGeometry(geometry, 25), this.edges));
      });
    }
    geometries.forEach((geometry) => geometry.dispose());
  }

  setLooks(look) {
    for (const [name, uniform] of Object.entries(this.uniforms)) uniform.value.set(look[name]);
    this.edges.color.set(look.ink);
  }
}
