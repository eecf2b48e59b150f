// A report: which runs and wheels are shown, and one cursor in time for the scene and every plot.
"use strict";
(() => {
  const { Player, runColour } = window.omnistepPlayer, plots = window.reportPlots;
  const data = JSON.parse(document.getElementById("data").textContent);
  const byId = (id) => document.getElementById(id), root = document.documentElement;
  const [slider, clock, play, rate] = ["time", "clock", "play", "rate"].map(byId);
  const floats = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const HASH_MS = 300, MARKS_MS = 60;

  for (const run of data.runs) {
    for (const key of ["poses", "pushes", "time", "frameTime"]) run[key] = floats(run[key]);
    run.series = Object.fromEntries(Object.entries(run.series).map(([name, text]) => [name, floats(text)]));
    run.plotTime = Array.from(run.time);
    run.path = new Float32Array(run.frameTime.length * 3);
    for (let row = 0; row < run.frameTime.length; row += 1) run.path.set(run.poses.subarray(7 * row * run.frames, 7 * row * run.frames + 3), 3 * row);
    for (const key of run.above ? ["time", "odometry", "truth_time", "truth", "command", "ellipses"] : []) {
      if (run.above[key]) run.above[key] = floats(run.above[key]);
    }
  }
  plots.nameWheels(data.runs.flatMap((run) => run.wheels));
  for (const { wheels } of data.scenes) for (const wheel of wheels) wheel.colour = plots.wheelColour(wheel.name);
  const state = { shown: [], wheels: [], time: 0, playing: false, last: 0, dirty: true, marked: 0, scene: -1 };
  const shownRuns = () => state.shown.map((index) => ({ run: data.runs[index], index }));
  const end = () => Math.max(...state.shown.map((index) => data.runs[index].end));
  const dark = () => root.dataset.theme === "dark";
  const colourOf = (index) => runColour(index, dark());

  // ---- where a run is at a time
  const rowOf = (times, time) => {
    let [low, high] = [0, times.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= time + 1e-6) low = middle; else high = middle - 1;
    }
    return low;
  };
  // Between two frames: places in proportion, turns likewise and of length one again.
  const poseBetween = (from, to, part) => {
    const pose = Array.from(from, (value, k) => value + part * (to[k] - value));
    if (from[3] * to[3] + from[4] * to[4] + from[5] * to[5] + from[6] * to[6] < 0) for (let k = 3; k < 7; k += 1) pose[k] = from[k] + part * (-to[k] - from[k]);
    const long = Math.hypot(pose[3], pose[4], pose[5], pose[6]) || 1;
    for (let k = 3; k < 7; k += 1) pose[k] /= long;
    return pose;
  };
  const stateAt = (run, time) => {
    const row = rowOf(run.frameTime, time), next = Math.min(row + 1, run.frameTime.length - 1), seconds = run.frameTime[next] - run.frameTime[row];
    const part = seconds > 0 ? Math.min(Math.max((time - run.frameTime[row]) / seconds, 0), 1) : 0;
    const pose = (at, frame) => run.poses.subarray(7 * (at * run.frames + frame), 7 * (at * run.frames + frame) + 7);
    const wheels = data.scenes[run.scene].wheels, plotRow = rowOf(run.time, time);
    return {
      poses: Array.from({ length: run.frames }, (_, frame) => poseBetween(pose(row, frame), pose(next, frame), part)),
      wheels: wheels.map(({ name }, k) => {
        const at = 6 * (row * wheels.length + k), push = Array.from(run.pushes.subarray(at, at + 6));
        const slip = run.series.slip[plotRow * run.wheels.length + run.wheels.indexOf(name)];
        return { slip: Number.isFinite(slip) ? slip : 0, push: Math.hypot(push[0], push[1], push[2]) > 0 ? [push.slice(0, 3), push.slice(3)] : null };
      }),
      path_m: run.path, path_points: row + 1,
      edges: run.edges.filter(([at]) => at <= time + 1e-6).map(([, ...edge]) => edge),
    };
  };

  // ---- the scene: of the first run that is shown, and of those on the same ground with the same vehicle
  let player;
  const inScene = () => data.runs.map((run, index) => ({ run, index })).filter(({ run }) => run.scene === state.scene);
  const sceneOf = (number) => ({ ...data.scenes[number], runs: inScene().map(({ run, index }) => ({ name: run.name, colour: [runColour(index, false), runColour(index, true)] })) });
  const drawScene = () => {
    const lead = data.runs[state.shown[0]].scene, another = lead !== state.scene;
    state.scene = lead;
    if (!player) player = byId("scene").player = new Player(byId("scene"), sceneOf(lead), { dark: dark(), view: asked.view, onView: remember });
    else if (another) player.setScene(sceneOf(lead));
    const out = shownRuns().filter(({ run }) => run.scene !== lead).map(({ run }) => run.name);
    byId("note").hidden = out.length === 0;
    byId("note").textContent = out.length ? `In the plots only, because vehicle or ground differ from those of ${data.runs[state.shown[0]].name}: ${out.join("; ")}.` : "";
  };
  const place = () => player.show(inScene().map(({ run, index }) => (state.shown.includes(index) ? stateAt(run, state.time) : null)));

  // ---- choices
  const runBoxes = [...document.querySelectorAll("#runs input")];
  const wheelBoxes = () => [...document.querySelectorAll("#wheels input")];
  const wheelNames = () => [...new Set(shownRuns().flatMap(({ run }) => run.wheels))];
  // The first driven wheel of the front row: it meets an obstacle first.
  const usualWheel = (run) => {
    const n = run.wheels.length;
    const driven = (wheel) => run.series.reference.some((value, k) => k % n === wheel && Math.abs(value) > 0.1);
    const ahead = ({ frame }) => { const [base, at] = [run.poses.subarray(0, 7), run.poses.subarray(7 * frame)], yaw = Math.atan2(2 * (base[6] * base[5] + base[3] * base[4]), 1 - 2 * (base[4] ** 2 + base[5] ** 2)); return (at[0] - base[0]) * Math.cos(yaw) + (at[1] - base[1]) * Math.sin(yaw); };
    const wheels = data.scenes[run.scene].wheels.filter(({ name }) => driven(run.wheels.indexOf(name)));
    return wheels.reduce((best, wheel) => (!best || ahead(wheel) > ahead(best) + 1e-3 ? wheel : best), null)?.name ?? run.wheels[0];
  };
  // A wheel that all runs have, else one of each vehicle: no run is without curves.
  const usualWheels = (kept) => {
    const runs = shownRuns().map(({ run }) => run), usual = usualWheel(runs[0]), common = runs[0].wheels.filter((name) => runs.every((run) => run.wheels.includes(name)));
    if (!kept.length && common.length) return [common.includes(usual) ? usual : common[0]];
    const wheels = [...kept];
    for (const run of runs) if (!run.wheels.some((name) => wheels.includes(name))) wheels.push(usualWheel(run));
    return wheels;
  };
  const element = (tag, className, text) => Object.assign(document.createElement(tag), { className, textContent: text ?? "" });
  const offerWheels = () => {
    const names = wheelNames(), legend = byId("wheels").firstElementChild;
    const wanted = usualWheels(state.wheels.filter((name) => names.includes(name)));
    state.wheels = names.filter((name) => wanted.includes(name));
    const check = () => wheelBoxes().forEach((box) => { box.checked = state.wheels.includes(box.value); });
    // The same wheels: so that the keyboard focus stays.
    if (names.join("\n") === wheelBoxes().map(({ value }) => value).join("\n")) { check(); return; }
    const chips = names.map((name) => {
      const chip = element("label", "wheel"), box = Object.assign(document.createElement("input"), { type: "checkbox", value: name, checked: state.wheels.includes(name) });
      const dot = element("i", "dot");
      dot.style.background = plots.wheelColour(name);
      chip.append(box, dot, name);
      box.addEventListener("change", () => {
        const wanted = names.filter((each) => (each === name ? box.checked : state.wheels.includes(each)));
        if (wanted.length) state.wheels = wanted; else box.checked = true; // one stays
        drawPlots();
        remember();
      });
      return chip;
    });
    const all = element("button", "", "All");
    all.type = "button";
    all.addEventListener("click", () => { state.wheels = names; check(); drawPlots(); remember(); });
    byId("wheels").replaceChildren(legend, ...chips, all);
  };
  const sample = (colour, dash, width = 2) => {
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg"), line = svg.appendChild(document.createElementNS("http://www.w3.org/2000/svg", "line"));
    for (const [name, value] of Object.entries({ width: 34, height: 10, "aria-hidden": "true" })) svg.setAttribute(name, value);
    for (const [name, value] of Object.entries({ x1: 1, x2: 33, y1: 5, y2: 5, stroke: colour, "stroke-width": width, "stroke-dasharray": dash })) line.setAttribute(name, value);
    return svg;
  };
  const entry = (picture, text) => { const span = element("span", "entry"); span.append(picture, text); return span; };
  const dashArray = (index) => (plots.dashOf(index) === "solid" ? "none" : plots.dashOf(index).replaceAll("px", ""));
  const paintRuns = () => runBoxes.forEach((box, index) => {
    const line = box.parentElement.querySelector("line");
    for (const [name, value] of Object.entries({ stroke: colourOf(index), "stroke-width": 3, "stroke-dasharray": dashArray(index) })) line.setAttribute(name, value);
  });

  // ---- plots
  const cursor = element("i", "cursor");
  const drawPlots = async () => {
    const runs = shownRuns(), one = state.wheels.length === 1, ink = getComputedStyle(root).getPropertyValue("--ink");
    const measured = (key) => runs.some(({ run }) => run.series[key].some(Number.isFinite));
    const keys = await plots.drawWheels(runs, state.wheels, data.signals, colourOf);
    byId("legend").replaceChildren(
      ...runs.map(({ run, index }) => entry(sample(one ? colourOf(index) : ink, dashArray(index)), run.name)),
      ...(one ? [] : state.wheels.map((name) => entry(sample(plots.wheelColour(name), "none", 4), `wheel ${name}`))),
      ...(measured("reference") ? [entry(sample(ink, "1 3", 1.5), "reference speed")] : []), ...(measured("upper") ? [entry(sample(ink, "12 5", 1), "torque limits")] : []),
    );
    byId("panels").replaceChildren(...keys.map((key, k) => {
      const tip = element("button", "tip mark", "?");
      Object.assign(tip, { type: "button", ariaLabel: `What is ${data.signals[key][0]}?` });
      tip.dataset.tip = data.signals[key][1];
      tip.style.top = `${8 + k * (byId("plots").offsetHeight - 50) / keys.length}px`;
      return tip;
    }));
    byId("plots").append(cursor);
    const ways = await plots.drawPaths(runs, state.time, rowOf, colourOf);
    byId("ways").replaceChildren(...(ways ? [
      ...runs.filter(({ run }) => run.above).map(({ run, index }) => entry(sample(colourOf(index), "none", 4), run.name)),
      ...(ways.truth ? [entry(sample(ink, "none"), "true position")] : []), entry(sample(ink, "6 4"), "odometry"),
      ...ways.commands.map(({ name, colour }) => entry(sample(colour, "none", 5), name)),
      ...(ways.ellipses ? [entry(sample(ink, "none", 0.8), ways.ellipses)] : []),
    ] : []));
    byId("plots").removeAllListeners?.("plotly_click");
    byId("plots").on("plotly_click", ({ points }) => seek(points[0].x));
    byId("plots").removeAllListeners?.("plotly_relayout");
    byId("plots").on("plotly_relayout", moveCursor);
    moveCursor();
  };
  const moveCursor = () => {
    const at = plots.cursorPx(state.time);
    cursor.hidden = !at;
    if (at) Object.assign(cursor.style, { transform: `translateX(${at.x}px)`, top: `${at.top}px`, height: `${at.height}px` });
  };

  // ---- one cursor for all
  const show = (now) => {
    slider.value = String(state.time);
    slider.setAttribute("aria-valuetext", `${state.time.toFixed(2)} seconds`);
    clock.textContent = `${state.time.toFixed(2)} s`;
    place();
    moveCursor();
    if (!state.playing || now - state.marked > MARKS_MS) {
      state.marked = now;
      plots.movePaths(shownRuns(), state.time, rowOf);
    }
  };
  const seek = (time) => {
    state.time = Math.min(Math.max(time, 0), end());
    state.dirty = true;
    remember();
  };
  const setPlaying = (on) => {
    state.playing = on;
    state.last = performance.now();
    state.dirty = true;
    play.textContent = on ? "Pause" : "Play";
    remember();
  };
  const choose = (indices) => {
    state.shown = indices;
    runBoxes.forEach((box, index) => { box.checked = indices.includes(index); });
    document.querySelectorAll("table tr").forEach((row) => [...row.children].slice(1).forEach((cell, index) => cell.classList.toggle("out", !indices.includes(index))));
    drawScene();
    offerWheels();
    slider.max = String(end());
    seek(state.time);
    return drawPlots();
  };

  // ---- the address keeps time, runs, wheels and view
  let remembering = 0;
  const remember = () => {
    if (remembering || state.playing) return;
    remembering = setTimeout(() => {
      remembering = 0;
      const kept = new URLSearchParams({ t: state.time.toFixed(2), runs: state.shown.map((index) => index + 1).join("."), wheels: state.wheels.join(" "), view: player.view });
      try { history.replaceState(null, "", `#${kept}`); } catch { /* a page inside another may not */ }
    }, HASH_MS);
  };
  const asked = (() => {
    const kept = new URLSearchParams(location.hash.slice(1)), numbers = (kept.get("runs") ?? "").split(".").map((text) => Number(text) - 1);
    const runs = [...new Set(numbers)].filter((index) => Number.isInteger(index) && index in data.runs).sort((a, b) => a - b);
    const view = Player.views.includes(kept.get("view")) ? kept.get("view") : "orbit";
    return { time: parseFloat(kept.get("t")), runs, wheels: (kept.get("wheels") ?? "").split(" ").filter(Boolean), view };
  })();

  // ---- tooltips: one, at what is pointed at or focused
  const tip = byId("tip");
  const hideTip = () => { tip.hidden = true; };
  const showTip = (button) => {
    tip.textContent = button.dataset.tip ?? byId(button.getAttribute("aria-describedby"))?.textContent ?? "";
    tip.hidden = false;
    const at = button.getBoundingClientRect(), { offsetWidth: wide, offsetHeight: tall } = tip;
    tip.style.left = `${Math.min(Math.max(8, at.left), root.clientWidth - wide - 8)}px`;
    tip.style.top = `${at.bottom + tall + 8 > root.clientHeight && at.top > tall + 8 ? at.top - tall - 6 : at.bottom + 6}px`;
  };
  const tipOf = (event) => event.target.closest?.("button.tip");
  for (const kind of ["mouseover", "focusin", "click"]) document.addEventListener(kind, (event) => { const button = tipOf(event); if (button) showTip(button); else if (kind === "click") hideTip(); });
  for (const kind of ["mouseout", "focusout"]) document.addEventListener(kind, (event) => { if (tipOf(event)) hideTip(); });
  addEventListener("scroll", hideTip, { passive: true });

  // ---- what the user does
  const setTheme = (theme) => { root.dataset.theme = theme; byId("theme").textContent = theme === "dark" ? "Light" : "Dark"; paintRuns(); };
  slider.addEventListener("input", () => seek(Number(slider.value)));
  play.addEventListener("click", () => {
    if (!state.playing && state.time >= end()) seek(0);
    setPlaying(!state.playing);
  });
  byId("theme").addEventListener("click", () => { setTheme(dark() ? "light" : "dark"); player.setTheme(dark()); drawPlots(); });
  runBoxes.forEach((box, index) => box.addEventListener("change", () => {
    const wanted = data.runs.map((_, k) => k).filter((k) => (k === index ? box.checked : state.shown.includes(k)));
    if (wanted.length) choose(wanted); else box.checked = true; // one stays
  }));
  document.addEventListener("keydown", (event) => { if (event.key === "Escape") hideTip(); });
  // Elsewhere these keys scroll. What has keys of its own keeps them: Space presses a button, arrows turn the picture.
  const control = (event) => {
    const { target, key } = event, own = { BUTTON: [" "], SELECT: null }[target.tagName];
    if (event.ctrlKey || event.metaKey || event.altKey || own === null || own?.includes(key)) return;
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02, PageUp: -0.5, PageDown: 0.5 }[key];
    if (key === " ") play.click();
    else if (step !== undefined) seek(state.time + step);
    else if (key === "Home") seek(0);
    else if (key === "End") seek(end());
    else return;
    event.preventDefault();
  };
  for (const part of [byId("scene"), slider.parentElement]) part.addEventListener("keydown", control);
  addEventListener("resize", () => requestAnimationFrame(moveCursor));
  const frame = (now) => {
    if (state.playing) {
      const next = state.time + (now - state.last) / 1000 * Number(rate.value);
      if (next >= end()) setPlaying(false);
      seek(next);
    }
    state.last = now;
    if (state.dirty) { state.dirty = false; show(now); }
    requestAnimationFrame(frame);
  };
  setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  const opening = asked.runs.length ? asked.runs : data.shown;
  // At the obstacle, before anybody has chosen a time: where the first run meets it.
  state.time = Math.max(Number.isFinite(asked.time) ? asked.time : Math.min(...opening.map((index) => data.runs[index].obstacle)), 0);
  state.wheels = asked.wheels;
  choose(opening).then(() => {
    root.dataset.ready = "true";
    requestAnimationFrame(frame);
  });
})();
