// The plots of a report: series of wheels over time, and the paths from above, of the runs that are shown.
"use strict";
window.reportPlots = (() => {
  const { WHEEL_COLOURS } = window.omnistepPlayer;
  // Names are of a log: plotly would take what looks like a tag for one.
  const plain = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");
  const DASHES = ["solid", "8px,3px", "12px,3px,2px,3px", "4px,2px", "16px,4px", "8px,2px,2px,2px,2px,2px"];
  const PANEL_PX = 190, NARROW_PX = 600;
  /** With more lines than this a label of all of them hides the plot. */
  const MOST_LABELLED = 12;
  const gd = (id) => document.getElementById(id);

  /** The dash of a run, as a plot and as an SVG have it. */
  const dashOf = (run) => DASHES[run % DASHES.length];
  const look = () => {
    const style = getComputedStyle(document.documentElement);
    return Object.fromEntries(["ink", "paper", "line", "faint", "mark"].map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  };
  /** Behind the player's colours: a report may have wheels of several vehicles. */
  const MORE_COLOURS = ["#e5484d", "#8e6cef", "#00a3a3", "#a0622d", "#6f9a1f", "#f06fa7", "#4f6bed", "#9c8a5a"];
  const wheelNames = [];
  /** Each name of a wheel gets a colour of its own, in the order in which they come. */
  const nameWheels = (names) => { for (const name of names) if (!wheelNames.includes(name)) wheelNames.push(name); };
  const wheelColour = (name) => { const all = [...WHEEL_COLOURS, ...MORE_COLOURS]; return all[Math.max(wheelNames.indexOf(name), 0) % all.length]; };
  const column = (run, key, wheel) => {
    const n = run.wheels.length, values = run.series[key];
    return Array.from({ length: run.time.length }, (_, row) => values[row * n + wheel]);
  };
  const measured = (run, key) => run.series[key].some(Number.isFinite);
  const base = ({ ink, paper }, margin) => ({
    margin, paper_bgcolor: paper, plot_bgcolor: paper, font: { color: ink, family: "system-ui, sans-serif", size: 12 }, showlegend: false, uirevision: "kept",
    hoverlabel: { bgcolor: paper, font: { color: ink }, namelength: -1 },
  });
  const config = { responsive: true, displaylogo: false, displayModeBar: false };

  // ---- wheels over time
  // One wheel: a colour a run. Several: a colour a wheel, a dash a run.
  const lines = (runs, wheels, key, yaxis, colourOf, ink) => runs.flatMap(({ run, index }) => wheels.flatMap((name) => {
    const wheel = run.wheels.indexOf(name);
    if (wheel < 0) return [];
    const colour = wheels.length === 1 ? colourOf(index) : wheelColour(name), dash = dashOf(index);
    const line = { type: "scatter", mode: "lines", x: run.plotTime, yaxis, connectgaps: false };
    const whose = plain(wheels.length === 1 ? run.name : `${run.name}, wheel ${name}`);
    const traces = [{ ...line, y: column(run, key, wheel), name: whose, line: { color: colour, width: 1.7, dash } }];
    if (key === "speed") traces.push({ ...line, y: column(run, "reference", wheel), name: `${whose}: reference`, line: { color: colour, width: 1.2, dash: "1px,3px" }, opacity: 0.8, hoverinfo: wheels.length === 1 ? "all" : "skip" });
    if (key === "torque") for (const limit of ["lower", "upper"]) {
      traces.push({ ...line, y: column(run, limit, wheel), name: `${whose}: ${limit} limit`, line: { color: wheels.length === 1 ? colour : ink, width: 1, dash: "longdash" }, opacity: 0.6, hoverinfo: "skip" });
    }
    return traces;
  }));

  /** Draws the panels of the runs and wheels that are chosen; returns the keys of the signals that are shown. */
  const drawWheels = async (runs, wheels, signals, colourOf) => {
    const colours = look(), keys = Object.keys(signals).filter((key) => runs.some(({ run }) => measured(run, key)));
    const narrow = gd("plots").clientWidth < NARROW_PX;
    const axis = { gridcolor: colours.line, zerolinecolor: colours.line, linecolor: colours.line };
    const layout = {
      ...base(colours, { l: narrow ? 44 : 60, r: 10, t: 8, b: 42 }), hovermode: runs.length * wheels.length * (wheels.length === 1 ? 2 : 1) > MOST_LABELLED ? "closest" : "x unified", height: 60 + keys.length * PANEL_PX,
      xaxis: { ...axis, title: { text: "time [s]" }, hoverformat: ".2f", anchor: keys.length > 1 ? `y${keys.length}` : "y", range: [0, Math.max(...runs.map(({ run }) => run.end))] },
      annotations: keys.map((key, k) => ({ text: signals[key][0], xref: "paper", yref: "paper", x: 0, y: 1 - k / keys.length, xanchor: "left", yanchor: "top", showarrow: false, font: { size: 13, color: colours.ink } })),
    };
    keys.forEach((_, k) => {
      const low = (keys.length - 1 - k) / keys.length; // its title is above it
      layout[k ? `yaxis${k + 1}` : "yaxis"] = { ...axis, domain: [low, low + 0.84 / keys.length], zeroline: true, nticks: 6, hoverformat: ".3~g" };
    });
    const traces = keys.flatMap((key, k) => lines(runs, wheels, key, k ? `y${k + 1}` : "y", colourOf, colours.ink));
    await window.Plotly.react("plots", traces, layout, config);
    return keys;
  };

  /** Where the cursor's line is in the plots [px], or null where that time is out of sight. */
  const cursorPx = (time) => {
    const axis = gd("plots")._fullLayout?.xaxis, size = gd("plots")._fullLayout?._size;
    if (!axis || !size) return null;
    const at = axis.l2p(time);
    return at < -1 || at > axis._length + 1 ? null : { x: axis._offset + at, top: size.t, height: size.h };
  };

  // ---- paths from above
  const places = (values, gap) => [0, 1].map((k) =>
    Array.from({ length: values.length / 2 }, (_, row) => (values[2 * row + k] === gap ? null : values[2 * row + k])));
  const way = (values, name, line, gap) => {
    const [x, y] = places(values, gap);
    return { type: "scatter", mode: "lines", x, y, name, line };
  };
  // Where odometry and truth of the runs are at the cursor's time.
  const marks = (runs, time, rowOf) => {
    const at = runs.flatMap(({ run: { above } }) => [[above.truth_time, above.truth], [above.time, above.odometry]]
      .filter(([, values]) => values).map(([times, values]) => values.subarray(2 * rowOf(times, time))));
    return { x: at.map(([x]) => x), y: at.map(([, y]) => y) };
  };

  /** Each command once, with the runs that were to follow it. */
  const commandsOf = (runs) => {
    const found = [];
    for (const each of runs.filter(({ run }) => run.above.command)) {
      const { command } = each.run.above, same = found.find((other) => other.command.length === command.length && other.command.every((value, k) => value === command[k]));
      if (same) same.runs.push(each); else found.push({ command, runs: [each] });
    }
    return found;
  };
  const ofRuns = (some, all) => (some.length === all.length ? "" : ` of ${some.map(({ run }) => run.name).join("; ")}`);

  /** Draws the paths of the runs that have odometry; false where none has. */
  const drawPaths = async (shown, time, rowOf, colourOf) => {
    const runs = shown.filter(({ run }) => run.above);
    gd("seen").hidden = runs.length === 0;
    if (runs.length === 0) return false;
    const colours = look(), traces = [];
    // One command of all runs is no run's; of several each has the colour of the first run that was to follow it.
    const commands = commandsOf(runs).map((each, _, all) => ({ ...each, name: `command${ofRuns(each.runs, runs)}`, colour: all.length === 1 ? colours.faint : colourOf(each.runs[0].index) }));
    for (const { command, name, colour } of commands) traces.push({ ...way(command, plain(name), { color: colour, width: 5 }), opacity: 0.4 });
    const unsure = runs.filter(({ run }) => run.above.ellipses);
    for (const { run: { above, name }, index } of unsure) traces.push({ ...way(above.ellipses, `${plain(name)}: ${above.sigmas} standard deviations`, { color: colourOf(index), width: 1 }, above.gap), opacity: 0.6 });
    for (const { run: { above, name }, index } of runs) {
      if (above.truth) traces.push(way(above.truth, `${plain(name)}: true position`, { color: colourOf(index), width: 2 }));
      traces.push(way(above.odometry, `${plain(name)}: odometry`, { color: colourOf(index), width: 2, dash: "6px,4px" }));
    }
    traces.push({ type: "scatter", mode: "markers", ...marks(runs, time, rowOf), name: "at the cursor", hoverinfo: "skip", marker: { color: colours.mark, size: 9, line: { color: colours.paper, width: 1 } } });
    // As high as the paths are wide: x and y have the same scale.
    const spans = [0, 1].map((k) => { const all = traces.flatMap(({ x, y }) => (k ? y : x)).filter(Number.isFinite); return all.reduce((most, v) => Math.max(most, v), -Infinity) - all.reduce((least, v) => Math.min(least, v), Infinity); });
    const height = Math.min(Math.max(gd("above").clientWidth * 1.15 * spans[1] / Math.max(spans[0], 1e-6) + 90, 220), 520);
    const axis = { gridcolor: colours.line, zeroline: false };
    const layout = {
      ...base(colours, { l: 52, r: 10, t: 8, b: 42 }), hovermode: "closest", height,
      xaxis: { ...axis, title: { text: "x [m]" } }, yaxis: { ...axis, title: { text: "y [m]" }, scaleanchor: "x" },
    };
    await window.Plotly.react("above", traces, layout, config);
    const ellipses = unsure.length ? `ellipses${ofRuns(unsure, runs)}: ${unsure[0].run.above.sigmas} standard deviations of odometry` : "";
    return { commands, ellipses, truth: runs.some(({ run }) => run.above.truth) };
  };

  /** Moves the marks of the paths to a time. */
  const movePaths = (shown, time, rowOf) => {
    const runs = shown.filter(({ run }) => run.above), { data } = gd("above");
    if (!runs.length || !data) return;
    const { x, y } = marks(runs, time, rowOf);
    window.Plotly.restyle("above", { x: [x], y: [y] }, [data.length - 1]);
  };

  return { dashOf, nameWheels, wheelColour, drawWheels, cursorPx, drawPaths, movePaths };
})();
