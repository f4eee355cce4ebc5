// Figures: plots with their captions, controls and exports.

const views = [];

/** A figure with its plot, drawn to the width that it has, and buttons that save it. */
function addFigure(place, title, name, spec, { wide = false, controls = [], note = "", scene = null } = {}) {
  const area = element("div", { class: "plot", role: "img", "aria-label": title });
  const figure = element("figure", { class: wide ? "wide" : null, "data-scene": scene });
  const tools = element("span", { class: "tools" }, ...controls);
  for (const type of ["svg", "png"]) {
    tools.append(element("button", { type: "button", onclick: async () => {
      download(`${name}.${type}`, await view.toImageURL(type, type === "png" ? 2 : 1));
    } }, type.toUpperCase()));
  }
  figure.append(element("figcaption", {}, element("span", {}, title), tools), area);
  if (note) figure.append(element("p", { class: "soft" }, note));
  place.append(figure);
  let view = null;
  const draw = () => {
    if (!figure.clientWidth) return;  // hidden: drawn when it is shown
    const width = Math.max(240, Math.min(1250, figure.clientWidth - 130));
    if (view) view.finalize();
    area.replaceChildren();
    view = new vega.View(vega.parse(spec(width)), { renderer: "svg", container: area, hover: true });
    view.runAsync();
  };
  views.push(draw);
  return draw;
}

function choice(label, values, onChange) {
  const select = element("select", { "aria-label": label, onchange: () => onChange(select.value) });
  for (const value of values) select.append(element("option", { value }, value));
  return select;
}

function addMeasuredFigures(grid) {
  if (report.curves.rows.length) {
    const curveScenes = scenes.filter((s) => report.curve_points.rows.some((p) => p.scene === s));
    for (const scene of curveScenes) {
      let metric = "mse";
      const select = choice("Metric", ["mse", "relmse"], (value) => { metric = value; draw(); });
      const draw = addFigure(grid, `Error against run time: ${scene}`, `curve-${scene}`,
        (width) => curvesSpec(scene, metric, width), { controls: [select], scene });
    }
    grid.append(element("p", { class: "soft", style: "grid-column:1/-1" }, "Bands: " + 100 * report.confidence +
      " % intervals of the mean over blocks. Slopes with their intervals are in curves.csv."));
  }
  if (rows.some((row) => isNumber(row.ratio) && row.label !== report.baseline)) {
    addFigure(grid, `Efficiency over ${report.baseline}`, "efficiency-ratios", ratioSpec,
      { note: "Bars: intervals over blocks. Open diamonds: published ratios." });
  }
  if (report.ecdf.rows.some((row) => row.metric === "mse" && isNumber(row.relative_time))) {
    addFigure(grid, "Time to targets, all scenes", "time-to-target", (width) => ecdfSpec("mse", width),
      { note: "Targets: ten levels of MSE per scene along the baseline's curve. Further left is faster; a curve that ends below 100 % did not reach the rest." });
  }
  addFigure(grid, "What a ray costs", "cost-per-ray", costSpec,
    { note: "CPU time of the whole estimate over its shadow rays: tracing, sampling, densities and adaptation together." });
  for (const scene of scenes) {
    if (!stageRows(scene).length) continue;
    let total = "per ray";
    const select = choice("Length of the bars", Object.keys(kStageTotals), (value) => { total = value; draw(); });
    const draw = addFigure(grid, `Where the time goes: ${scene}`, `stages-${scene}`,
      (width) => stagesSpec(scene, total, width), { controls: [select], scene,
        note: "One thread, a part of the image, apart from the blocks (stages.csv). Weigh: densities and weights of the mixture; adapt: learning from samples." });
  }
  if (report.curves.rows.length) {
    for (const scene of scenes) {
      if (!rows.some((row) => row.scene === scene && biasOf(row))) continue;
      addFigure(grid, `Bias of the mean against run time: ${scene}`, `bias-${scene}`, (width) => biasCurveSpec(scene, width), { scene });
    }
  } else if (rows.some((row) => biasOf(row))) {
    addFigure(grid, "Bias of the mean", "bias", biasForestSpec, { note: "Bars: t intervals over blocks; the axis is linear within 0.1 %." });
  }
  for (const surface of surfaces()) {
    const [scene, method] = surface.key;
    addFigure(grid, `Error over a sweep: ${scene}, ${method}`, `surface-${scene}-${method}`,
      (width) => surfaceSpec(surface, width - 60), { scene });
  }
}

function fillPlots() {
  const place = section("plots");
  if (typeof vega === "undefined") {
    place.append(element("p", {}, "Plots need the Debian packages libjs-vega and node-d3-* where the report is made (scripts/setup installs them)."));
    return;
  }
  const grid = element("div", { class: "plots" });
  place.append(grid);
  if (rows.length) addMeasuredFigures(grid);
  if (report.stability) {
    addFigure(grid, "Stiff and extreme cases: from harmless (left) to extreme (right)", "stability", stabilitySpec,
      { wide: true, note: "One block is one step of the case's parameter; the rules of the verdicts are in stability.json." });
  }
  if (!grid.children.length) place.append(element("p", {}, "Nothing was measured."));
  const redraw = () => { for (const draw of views) draw(); };
  redraw();
  themeListeners.push(redraw);
  sceneListeners.push(redraw);
  let pending = 0;
  window.addEventListener("resize", () => { clearTimeout(pending); pending = setTimeout(redraw, 150); });
}
