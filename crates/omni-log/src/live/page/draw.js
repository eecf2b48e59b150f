// What a state of the run looks like, from the side and from above.
"use strict";
const pictures = (() => {
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const sum = (a, b, by = 1) => [a[0] + by * b[0], a[1] + by * b[1], a[2] + by * b[2]];
  // v + 2 u x (u x v + w v)
  const turned = (pose, v) => {
    const u = pose.slice(3, 6);
    return sum(v, cross(u, sum(cross(u, v), v, pose[6])), 2);
  };
  const placed = (pose, v) => sum(pose, turned(pose, v));
  const heading = (pose) => { const [x, y] = turned(pose, [1, 0, 0]); return Math.atan2(y, x); };

  // ---- the ground
  const boxHeight = ({ half_m: [hx, hy, hz], at_m: [cx, cy, cz], turn_y_rad: turn }, x, y) => {
    if (Math.abs(y - cy) > hy) return -Infinity;
    const z = (hz - (x - cx) * Math.sin(turn)) / Math.cos(turn); // above the middle
    return Math.abs((x - cx) * Math.cos(turn) - z * Math.sin(turn)) <= hx ? cz + z : -Infinity;
  };
  const fieldHeight = ({ from_m: from, extent_m: [long, wide], rows, columns, heights_m: heights }, x, y) => {
    const [i, j] = [(x - from) / long * (rows - 1), (wide / 2 - y) / wide * (columns - 1)];
    if (!(i >= 0 && j >= 0 && i <= rows - 1 && j <= columns - 1)) return -Infinity;
    const [a, b] = [Math.min(Math.floor(i), rows - 2), Math.min(Math.floor(j), columns - 2)];
    const of = (row, column) => heights[row * columns + column];
    const along = (column) => of(a, column) * (1 - i + a) + of(a + 1, column) * (i - a);
    return along(b) * (1 - j + b) + along(b + 1) * (j - b);
  };
  const partHeight = (part, x, y) => {
    if (part.kind === "box") return boxHeight(part, x, y);
    if (part.kind === "field") return fieldHeight(part, x, y);
    const off = x - part.at_m[0];
    return Math.abs(off) <= part.radius_m ? part.at_m[2] + Math.sqrt(part.radius_m ** 2 - off ** 2) : -Infinity;
  };
  const height = (ground, x, y) => ground.reduce((highest, part) => Math.max(highest, partHeight(part, x, y)), -Infinity);

  // ---- looks
  const looks = () => {
    const style = getComputedStyle(document.documentElement);
    return Object.fromEntries(["ink", "paper", "line", "faint", "mark", "low", "level", "high", "alarm", "force"].map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  };
  const rgb = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
  const mixed = (from, to, part) => `rgb(${rgb(from).map((c, k) => Math.round(c + (rgb(to)[k] - c) * part)).join(",")})`;
  // Ground is darker the lower it is; 6 cm are most of it.
  const shade = (look, z) => z < 0 ? mixed(look.level, look.low, Math.tanh(-z / 0.06)) : mixed(look.level, look.high, Math.tanh(z / 0.06));

  // ---- a view: where the world's points are on a canvas
  const opened = (canvas, scale, centre, right, up, toward, level) => {
    const [width, tall, ratio] = [canvas.clientWidth, canvas.clientHeight, devicePixelRatio || 1];
    const [w, h] = [Math.round(width * ratio), Math.round(tall * ratio)];
    if (canvas.width !== w || canvas.height !== h) Object.assign(canvas, { width: w, height: h });
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, tall);
    const at = (p) => { const d = sum(p, centre, -1); return [width / 2 + scale * dot(d, right), level * tall - scale * dot(d, up)]; };
    return { context, width, tall, scale, centre, right, up, toward, at };
  };
  const path = (context, points, close = true) => {
    context.beginPath();
    points.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
    if (close) context.closePath();
  };
  // The outline of points of a convex body: Andrew's chains.
  const outline = (points) => {
    const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    const chain = (all) => all.reduce((found, p) => {
      const left = (a, b) => (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) <= 0;
      while (found.length > 1 && left(found[found.length - 2], found[found.length - 1])) found.pop();
      found.push(p);
      return found;
    }, []);
    return [...chain(sorted).slice(0, -1), ...chain(sorted.reverse()).slice(0, -1)];
  };

  // ---- the vehicle
  const corners = [-1, 1].flatMap((x) => [-1, 1].flatMap((y) => [-1, 1].map((z) => [x / 2, y / 2, z / 2])));
  const drawBody = (view, look, body, pose) => {
    const points = corners.map((c) => view.at(placed(pose, body.at_m.map((at, k) => at + c[k] * body.edges_m[k]))));
    path(view.context, outline(points));
    view.context.fillStyle = look.faint;
    view.context.globalAlpha = 0.3;
    view.context.fill();
    view.context.globalAlpha = 1;
    view.context.strokeStyle = look.faint;
    view.context.stroke();
  };
  const spokes = 10;
  const drawWheel = (view, look, disc, pose, colour, alarm) => {
    const { context } = view, { axle, radius_m: radius, width_m: wide, roller_angle_rad: slant } = disc;
    const ahead = cross(axle, [0, 0, 1]);
    // A point of the tread: at an angle about the axle, so far along it.
    const tread = (angle, along) => placed(pose, sum(sum(axle.map((a) => a * along), ahead, radius * Math.cos(angle)), [0, 0, 1], radius * Math.sin(angle)));
    const rim = Array.from({ length: 40 }, (_, k) => k * Math.PI / 20);
    path(context, outline(rim.flatMap((angle) => [-wide / 2, wide / 2].map((along) => view.at(tread(angle, along))))));
    context.fillStyle = look.paper;
    context.globalAlpha = 0.75;
    context.fill();
    context.globalAlpha = 1;
    context.fillStyle = colour + "55";
    context.fill();
    context.strokeStyle = alarm ? look.alarm : colour;
    context.lineWidth = alarm ? 3 : 1.6;
    context.stroke();
    context.lineWidth = 1;
    // Rollers on the side of the tread that is seen, spokes on the face that is.
    const facing = dot(turned(pose, axle), view.toward);
    const twist = slant ? wide / 2 * Math.tan(slant) / radius : 0;
    context.strokeStyle = colour;
    for (let k = 0; k < spokes; k += 1) {
      const angle = 2 * Math.PI * k / spokes, out = sum(tread(angle, 0), pose, -1);
      if (dot(out, view.toward) > 0.2 * radius) {
        path(context, [view.at(tread(angle - twist, -wide / 2)), view.at(tread(angle + twist, wide / 2))], false);
        context.stroke();
      }
      if (Math.abs(facing) > 0.3) {
        const along = Math.sign(facing) * wide / 2, [rimPoint, hub] = [tread(angle, along), placed(pose, axle.map((a) => a * along))];
        path(context, [view.at(sum(hub, sum(rimPoint, hub, -1), k ? 0.75 : 0)), view.at(rimPoint)], false);
        context.stroke();
      }
    }
  };
  const drawForce = (view, look, [force, at], perNewton) => {
    const most = 0.3, metres = perNewton * Math.hypot(...force);
    const { context } = view, [from, to] = [view.at(at), view.at(sum(at, force, perNewton * Math.min(1, most / (metres || 1))))];
    const long = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (long < 2) return;
    const [x, y] = [(to[0] - from[0]) / long, (to[1] - from[1]) / long], head = Math.min(8, long / 2);
    context.strokeStyle = context.fillStyle = look.force;
    context.lineWidth = 2;
    path(context, [from, [to[0] - head * x, to[1] - head * y]], false);
    context.stroke();
    path(context, [to, [to[0] - head * (x - y / 2), to[1] - head * (y + x / 2)], [to[0] - head * (x + y / 2), to[1] - head * (y - x / 2)]]);
    context.fill();
    context.lineWidth = 1;
  };
  const drawVehicle = (view, look, scene, state, most) => {
    const solids = [
      ...scene.bodies.map((body) => ({ pose: state.poses[body.frame], at: body.at_m, draw: (pose) => drawBody(view, look, body, pose) })),
      ...scene.wheels.map((disc, k) => {
        const { torque_n_m: torque, limits_n_m: [lower, upper] } = state.wheels[k];
        const alarm = torque >= 0.999 * upper || torque <= 0.999 * lower;
        return { pose: state.poses[disc.frame], at: [0, 0, 0], draw: (pose) => drawWheel(view, look, disc, pose, WHEEL_COLOURS[k % WHEEL_COLOURS.length], alarm) };
      }),
    ];
    const depth = ({ pose, at }) => dot(placed(pose, at), view.toward);
    for (const solid of solids.sort((a, b) => depth(a) - depth(b))) solid.draw(solid.pose);
    for (const { push } of state.wheels) if (push) drawForce(view, look, push, Math.min(0.005, 0.3 / most));
  };

  // ---- from its right side: a cut of the ground along its heading
  const side = (canvas, scene, state, camera) => {
    const look = looks(), base = state.poses[0], turn = heading(base), right = [Math.cos(turn), Math.sin(turn), 0];
    const view = opened(canvas, camera.scale, [base[0], base[1], camera.z], right, [0, 0, 1], [right[1], -right[0], 0], 0.72);
    const { context, width, tall, scale } = view;
    const away = (pixel) => (pixel - width / 2) / scale;
    const line = Array.from({ length: Math.ceil(width) + 1 }, (_, pixel) => {
      const t = away(pixel), z = height(scene.ground, base[0] + t * right[0], base[1] + t * right[1]);
      return [pixel, Math.min(Math.max(0.72 * tall - scale * (z - camera.z), -tall), 2 * tall)];
    });
    path(context, [...line, [width, tall], [0, tall]]);
    context.fillStyle = look.level;
    context.fill();
    path(context, line, false);
    context.strokeStyle = look.ink;
    context.lineWidth = 1.5;
    context.stroke();
    // Marks every 0.1 m along its heading, so that motion is seen on flat ground too.
    const ahead = dot(base, right), [from, to] = [away(0) + ahead, away(width) + ahead];
    context.strokeStyle = look.faint;
    context.lineWidth = 1;
    for (let k = Math.ceil(from * 10); k <= to * 10; k += 1) {
      const pixel = width / 2 + scale * (k / 10 - ahead);
      path(context, [[pixel, tall], [pixel, tall - (k % 10 ? 5 : 12)]], false);
      context.stroke();
    }
    drawVehicle(view, look, scene, state, camera.most);
  };

  // ---- from above
  const fieldPicture = (part, look) => {
    const canvas = document.createElement("canvas");
    Object.assign(canvas, { width: part.rows, height: part.columns });
    const context = canvas.getContext("2d");
    part.heights_m.forEach((z, k) => {
      context.fillStyle = shade(look, z);
      context.fillRect(Math.floor(k / part.columns), k % part.columns, 1, 1);
    });
    return canvas;
  };
  const drawPart = (view, look, part, theme) => {
    const { context, at } = view;
    if (part.kind === "field") {
      if (part.theme !== theme) Object.assign(part, { theme, picture: fieldPicture(part, look) });
      const [long, wide] = part.extent_m, [x0, y0] = at([part.from_m, wide / 2, 0]), [x1, y1] = at([part.from_m + long, -wide / 2, 0]);
      context.drawImage(part.picture, x0, y0, x1 - x0, y1 - y0);
      return;
    }
    const bar = part.kind === "bar", half = bar ? [part.radius_m, 1e3] : part.half_m, [cx, cy] = part.at_m;
    const foot = bar ? Math.sqrt(Math.max(0, half[0] ** 2 - Math.min(0, part.at_m[2]) ** 2)) : half[0] * Math.cos(part.turn_y_rad);
    const [x0, y0] = at([cx - foot, cy + half[1], 0]), [x1, y1] = at([cx + foot, cy - half[1], 0]);
    // Only what is near: no gradient of kilometres.
    const clip = (value, most) => Math.min(Math.max(value, -50), most + 50);
    const [left, rightmost] = [clip(x0, view.width), clip(x1, view.width)], [top, bottom] = [clip(y0, view.tall), clip(y1, view.tall)];
    if (rightmost - left <= 0 || bottom - top <= 0) return;
    const worldX = (pixel) => view.centre[0] + (pixel - view.width / 2) / view.scale;
    if (bar || part.turn_y_rad) {
      const gradient = context.createLinearGradient(left, 0, rightmost, 0);
      for (let k = 0; k <= 8; k += 1) {
        const x = worldX(left + (rightmost - left) * Math.min(Math.max(k / 8, 1e-6), 1 - 1e-6)), z = partHeight(part, x, cy);
        gradient.addColorStop(k / 8, shade(look, Number.isFinite(z) ? z : 0));
      }
      context.fillStyle = gradient;
    } else context.fillStyle = shade(look, part.at_m[2] + half[2]);
    context.fillRect(left, top, rightmost - left, bottom - top);
    context.strokeStyle = look.faint;
    context.strokeRect(left, top, rightmost - left, bottom - top);
  };
  const topOf = (part) => part.kind === "box" ? part.at_m[2] + (part.turn_y_rad ? -1e3 : part.half_m[2]) : 1e3;
  const plan = (canvas, scene, state, camera, theme) => {
    const look = looks(), base = state.poses[0];
    const view = opened(canvas, camera.scale, base, [1, 0, 0], [0, 1, 0], [0, 0, 1], 0.5), { context, width, tall, scale, at } = view;
    for (const part of [...scene.ground].sort((a, b) => topOf(a) - topOf(b))) drawPart(view, look, part, theme);
    for (const { x_m: x, y_m: y, friction } of scene.patches) {
      const [x0, y0] = at([x[0], y[1], 0]), [x1, y1] = at([x[1], y[0], 0]);
      context.fillStyle = look.mark + "33";
      context.fillRect(x0, y0, x1 - x0, y1 - y0);
      context.fillStyle = look.ink;
      if (x1 > 0 && x0 < width && y1 > 0 && y0 < tall) context.fillText(`friction ${friction}`, Math.max(x0, 0) + 4, Math.max(y0, 0) + 12);
    }
    context.strokeStyle = look.faint;
    context.globalAlpha = 0.35;
    const lines = (from, to, draw) => { for (let k = Math.ceil(from * 4); k <= to * 4; k += 1) { draw(k / 4); context.stroke(); } };
    lines(base[0] - width / 2 / scale, base[0] + width / 2 / scale, (x) => { const [px] = at([x, 0, 0]); path(context, [[px, 0], [px, tall]], false); });
    lines(base[1] - tall / 2 / scale, base[1] + tall / 2 / scale, (y) => { const [, py] = at([0, y, 0]); path(context, [[0, py], [width, py]], false); });
    context.globalAlpha = 1;
    for (const [way, colour, dash] of [[camera.way, look.ink, []], [camera.odometry, WHEEL_COLOURS[1], [6, 4]]]) {
      path(context, way.map(([x, y]) => at([x, y, 0])), false);
      context.setLineDash(dash);
      context.strokeStyle = colour;
      context.lineWidth = 1.6;
      context.stroke();
    }
    context.setLineDash([]);
    context.lineWidth = 1;
    drawVehicle(view, look, scene, state, camera.most);
    // Which way is ahead.
    const [tip, from] = [at(placed(base, [camera.length * 0.62, 0, 0])), at(placed(base, [camera.length * 0.52, 0, 0]))];
    const [dx, dy] = [tip[0] - from[0], tip[1] - from[1]];
    path(context, [tip, [from[0] - dy, from[1] + dx], [from[0] + dy, from[1] - dx]]);
    context.fillStyle = look.mark;
    context.fill();
  };

  // How long and wide a vehicle is from its middle, twice [m].
  const size = (scene, state) => 2 * Math.max(...scene.wheels.map((disc) => {
    const d = sum(state.poses[disc.frame], state.poses[0], -1);
    return Math.hypot(d[0], d[1]) + disc.radius_m;
  }));
  return { side, plan, size, turned, heading };
})();
