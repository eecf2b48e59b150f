// The player of a report: one cursor in time for the scene and every plot.
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const floats = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const byId = (id) => document.getElementById(id);
  const [slider, clock, play, rate] = ["time", "clock", "play", "rate"].map(byId);
  for (const run of data.runs) {
    run.poses = floats(run.poses);
    run.series = Object.fromEntries(Object.entries(run.series).map(([name, text]) => [name, floats(text)]));
    run.time = floats(run.time);
    run.frameTime = floats(run.frameTime);
    run.mesh.vertices = floats(run.mesh.vertices);
    for (const key of run.above ? ["time", "odometry", "truth_time", "truth", "command", "ellipses"] : []) {
      if (run.above[key]) run.above[key] = floats(run.above[key]);
    }
  }
  const palette = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#b8a800", "#7f7f7f"];
  const state = { run: 0, time: 0, playing: false, last: 0, dirty: true };
  const current = () => data.runs[state.run];

  // ---- looks
  const dark = () => document.documentElement.dataset.theme === "dark";
  const looks = () => {
    const style = getComputedStyle(document.documentElement);
    const of = (name) => style.getPropertyValue(name).trim();
    return { ink: of("--ink"), paper: of("--paper"), line: of("--line"), mark: of("--mark") };
  };
  const setTheme = (theme) => { document.documentElement.dataset.theme = theme; };
  setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");

  // ---- the scene
  const rgb = (colours) => colours.map(([r, g, b]) => `rgb(${r},${g},${b})`);
  const solid = (mesh, xyz, light) => ({
    type: "mesh3d", hoverinfo: "skip", flatshading: true, facecolor: rgb(mesh.colours),
    x: xyz[0], y: xyz[1], z: xyz[2],
    i: mesh.triangles.map((t) => t[0]), j: mesh.triangles.map((t) => t[1]), k: mesh.triangles.map((t) => t[2]),
    lighting: { ambient: light, diffuse: 0.7, specular: 0.05 },
  });
  // Vertices of the vehicle in the world, from the frames' poses at the row of that time.
  const placed = (run, row) => {
    const { vertices, link } = run.mesh, count = link.length, links = run.mesh.links;
    const xyz = [new Float32Array(count), new Float32Array(count), new Float32Array(count)];
    for (let v = 0; v < count; v += 1) {
      const at = 7 * (row * links + link[v]), p = run.poses;
      const [px, py, pz] = [vertices[3 * v], vertices[3 * v + 1], vertices[3 * v + 2]];
      const [a, b, c, w] = [p[at + 3], p[at + 4], p[at + 5], p[at + 6]];
      // v + 2 u x (u x v + w v)
      const ix = b * pz - c * py + w * px, iy = c * px - a * pz + w * py, iz = a * py - b * px + w * pz;
      xyz[0][v] = p[at] + px + 2 * (b * iz - c * iy);
      xyz[1][v] = p[at + 1] + py + 2 * (c * ix - a * iz);
      xyz[2][v] = p[at + 2] + pz + 2 * (a * iy - b * ix);
    }
    return xyz;
  };
  const rowOf = (times, time) => {
    let [low, high] = [0, times.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= time + 1e-6) low = middle; else high = middle - 1;
    }
    return low;
  };
  const axis3d = (title, range, colour) => ({ title: { text: title }, range, color: colour, gridcolor: looks().line, zeroline: false });
  const drawScene = () => {
    const run = current(), { ink, paper } = looks(), [x, y, z] = run.extent;
    const ground = [0, 1, 2].map((k) => run.ground.vertices.map((v) => v[k]));
    const lengths = [x, y, z].map(([from, to]) => to - from), most = Math.max(...lengths);
    const layout = {
      margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: paper, font: { color: ink }, uirevision: "kept",
      scene: {
        xaxis: axis3d("x [m]", x, ink), yaxis: axis3d("y [m]", y, ink), zaxis: axis3d("z [m]", z, ink),
        aspectmode: "manual", aspectratio: Object.fromEntries(["x", "y", "z"].map((n, k) => [n, 2.4 * lengths[k] / most])),
        camera: { eye: { x: -0.3, y: -1.5, z: 0.6 }, center: { x: 0, y: 0, z: -0.05 } },
      },
    };
    const traces = [solid(run.ground, ground, 0.75), solid(run.mesh, placed(run, rowOf(run.frameTime, state.time)), 0.6)];
    return Plotly.react("scene", traces, layout, { responsive: true, displaylogo: false });
  };

  // ---- the way from above
  const places = (values, gap) => [0, 1].map((k) =>
    Array.from({ length: values.length / 2 }, (_, r) => values[2 * r + k] === gap ? null : values[2 * r + k]));
  const line = (values, name, style, gap) => {
    const [x, y] = places(values, gap);
    return { type: "scatter", mode: "lines", x, y, name, line: style };
  };
  // Where odometry and truth are at the cursor's time.
  const marks = (above) => {
    const known = [[above.time, above.odometry], [above.truth_time, above.truth]].filter(([, values]) => values);
    const at = known.map(([times, values]) => values.subarray(2 * rowOf(times, state.time)));
    return { x: at.map(([x]) => x), y: at.map(([, y]) => y) };
  };
  const drawAbove = () => {
    const { above } = current(), { ink, paper, line: grid, mark } = looks();
    byId("above").hidden = !above;
    if (!above) return Promise.resolve();
    const traces = [
      { type: "scatter", mode: "markers", ...marks(above), name: "at the cursor", marker: { color: mark, size: 9 } },
    ];
    if (above.ellipses) {
      traces.push(line(above.ellipses, `${above.sigmas} standard deviations`, { color: palette[1], width: 1 }, above.gap));
    }
    if (above.command) traces.unshift({ ...line(above.command, "command", { color: palette[7], width: 5 }), opacity: 0.5 });
    if (above.truth) traces.push(line(above.truth, "truth", { color: ink, width: 1.6 }));
    traces.push(line(above.odometry, "odometry", { color: palette[1], width: 2, dash: "dash" })); // over the truth, which it hardly leaves
    const axis = { gridcolor: grid, zeroline: false };
    const layout = {
      margin: { l: 64, r: 12, t: 12, b: 44 }, paper_bgcolor: paper, plot_bgcolor: paper, font: { color: ink }, hovermode: "closest",
      xaxis: { ...axis, title: { text: "x [m]" } }, yaxis: { ...axis, title: { text: "y [m]" }, scaleanchor: "x" },
      legend: { orientation: "h", y: 1.1 }, uirevision: String(state.run),
    };
    return Plotly.react("above", traces, layout, { responsive: true, displaylogo: false });
  };

  // ---- the plots
  const panels = [
    { key: "speed", title: "wheel speed [rad/s]" },
    { key: "torque", title: "torque and limits [N.m]" },
    { key: "slip", title: "slip ratio" },
    { key: "disturbed", title: "disturbed ratio" },
    { key: "load", title: "load [N]" },
  ];
  const cursor = () => [{
    type: "line", xref: "x", yref: "paper", x0: state.time, x1: state.time, y0: 0, y1: 1,
    line: { color: looks().mark, width: 2 },
  }];
  const drawPlots = () => {
    const run = current(), { ink, paper, line } = looks(), n = run.wheels.length, rows = run.time.length;
    const time = Array.from(run.time), traces = [];
    const column = (values, wheel) => Array.from({ length: rows }, (_, r) => values[r * n + wheel]);
    panels.forEach(({ key }, panel) => {
      const yaxis = panel ? `y${panel + 1}` : "y";
      run.wheels.forEach((wheel, w) => {
        const shared = { x: time, xaxis: "x", yaxis, legendgroup: wheel, name: `wheel ${wheel}`, line: { color: palette[w % 8], width: 1.4 } };
        traces.push({ ...shared, type: "scatter", mode: "lines", y: column(run.series[key], w), showlegend: panel === 0 });
        if (key === "speed") traces.push({ ...shared, type: "scatter", mode: "lines", y: column(run.series.reference, w), showlegend: false, opacity: 0.45, line: { ...shared.line, dash: "dot" }, name: `wheel ${wheel}, reference` });
      });
      if (key === "torque") for (const [limit, name] of [["lower", "lowest limit"], ["upper", "highest limit"]]) {
        const of = time.map((_, r) => { const all = run.series[limit].subarray(r * n, r * n + n); return limit === "lower" ? Math.min(...all) : Math.max(...all); });
        traces.push({ x: time, y: of, xaxis: "x", yaxis, type: "scatter", mode: "lines", name, showlegend: false, line: { color: ink, width: 1, dash: "dash" } });
      }
    });
    const layout = {
      margin: { l: 64, r: 12, t: 12, b: 44 }, paper_bgcolor: paper, plot_bgcolor: paper, font: { color: ink }, hovermode: "x",
      xaxis: { title: { text: "time [s]" }, gridcolor: line, anchor: `y${panels.length}`, zeroline: false, range: [0, data.runs[state.run].end] },
      legend: { orientation: "h", y: 1.05 }, shapes: cursor(), uirevision: "kept",
    };
    panels.forEach(({ title }, k) => {
      const height = 1 / panels.length, top = 1 - k * height;
      layout[k ? `yaxis${k + 1}` : "yaxis"] = { title: { text: title }, domain: [top - height * 0.86, top], gridcolor: line, zeroline: false };
    });
    return Plotly.react("plots", traces, layout, { responsive: true, displaylogo: false });
  };

  // ---- one cursor for all
  const show = () => {
    const run = current();
    slider.value = String(state.time);
    slider.setAttribute("aria-valuetext", `${state.time.toFixed(2)} seconds`);
    clock.textContent = `${state.time.toFixed(2)} s`;
    const [x, y, z] = placed(run, rowOf(run.frameTime, state.time));
    Plotly.restyle("scene", { x: [x], y: [y], z: [z] }, [1]);
    if (run.above) {
      const { x: across, y: along } = marks(run.above);
      Plotly.restyle("above", { x: [across], y: [along] }, [run.above.command ? 1 : 0]);
    }
    Plotly.relayout("plots", { "shapes[0].x0": state.time, "shapes[0].x1": state.time });
  };
  const seek = (time) => {
    state.time = Math.min(Math.max(time, 0), current().end);
    state.dirty = true;
  };
  const setPlaying = (on) => {
    state.playing = on;
    state.last = performance.now();
    play.textContent = on ? "Pause" : "Play";
    play.setAttribute("aria-pressed", String(on));
  };
  const choose = (index) => {
    state.run = index;
    document.querySelectorAll("tbody tr").forEach((row, k) => row.setAttribute("aria-current", String(k === index)));
    slider.max = String(current().end);
    seek(state.time);
    return Promise.all([drawScene(), drawAbove(), drawPlots()]).then(() => {
      byId("plots").removeAllListeners?.("plotly_click");
      byId("plots").on("plotly_click", (event) => seek(event.points[0].x));
    });
  };
  const frame = (now) => {
    if (state.playing) {
      const next = state.time + (now - state.last) / 1000 * Number(rate.value);
      if (next >= current().end) setPlaying(false);
      seek(next);
    }
    state.last = now;
    if (state.dirty) { state.dirty = false; show(); }
    requestAnimationFrame(frame);
  };
  slider.addEventListener("input", () => seek(Number(slider.value)));
  play.addEventListener("click", () => {
    if (!state.playing && state.time >= current().end) seek(0);
    setPlaying(!state.playing);
  });
  byId("theme").addEventListener("click", () => { setTheme(dark() ? "light" : "dark"); choose(state.run); });
  document.querySelectorAll("tbody button").forEach((button, k) => button.addEventListener("click", () => choose(k)));
  document.addEventListener("keydown", (event) => {
    if (event.target.closest("button, select, input")) return; // they have keys of their own
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02, PageUp: -0.5, PageDown: 0.5 }[event.key];
    if (event.key === " ") play.click();
    else if (step !== undefined) seek(state.time + step);
    else if (event.key === "Home") seek(0);
    else if (event.key === "End") seek(current().end);
    else return;
    event.preventDefault();
  });
  choose(0).then(() => {
    document.documentElement.dataset.ready = "true";
    requestAnimationFrame(frame);
  });
})();
