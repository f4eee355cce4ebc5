// Vega specifications of the plots, made from the tables.

function plotConfig() {
  const ink = themeColor("ink"), soft = themeColor("soft"), line = themeColor("line");
  const font = "DejaVu Sans, Segoe UI, sans-serif";
  return {
    background: themeColor("page"),
    axis: { domainColor: soft, tickColor: soft, gridColor: line, labelColor: ink, titleColor: ink,
      labelFont: font, titleFont: font, labelFontSize: 12, titleFontSize: 12, titleFontWeight: "normal", titlePadding: 8 },
    legend: { labelColor: ink, titleColor: ink, labelFont: font, titleFont: font, labelFontSize: 12, symbolSize: 90,
      symbolStrokeWidth: 2, labelLimit: 220 },
    title: { color: ink, font },
  };
}

function styleScales(names) {
  return [
    { name: "color", type: "ordinal", domain: names, range: names.map((n) => styles.get(n).color) },
    { name: "shape", type: "ordinal", domain: names, range: names.map((n) => styles.get(n).symbol) },
    { name: "dash", type: "ordinal", domain: names, range: names.map((n) => styles.get(n).dash) },
  ];
}

const kMethodLegend = { stroke: "color", shape: "shape", fill: "color", orient: "bottom", columns: 4, symbolOpacity: 1 };

// Powers of ten as 10^k, other ticks of a logarithmic axis without a text where they would crowd.
function logAxis(scale, orient, title, grid = true) {
  return { scale, orient, title, grid, tickCount: 6, labelOverlap: true, format: ".1~e", gridOpacity: 0.6 };
}
function shortLogAxis(scale, orient, title) {
  return { scale, orient, title, grid: true, tickCount: 6, labelOverlap: true, format: "~r", gridOpacity: 0.6 };
}

/** Error against run time of one scene: points with intervals, lines, bands. */
function curvesSpec(scene, metric, width) {
  const [value, lo, hi, title] = metric === "mse"
    ? ["err", "err_lo", "err_hi", "MSE, debiased [(W/(m\u00b2 sr))\u00b2]"]
    : ["relmse", "relmse_lo", "relmse_hi", "relMSE"];
  const byCurve = new Map(report.curves.rows.map((row) => [row.curve, row]));
  const points = report.curve_points.rows.filter((p) => p.scene === scene && p.time_s > 0 && p[value] > 0).map((p) => ({
    curve: p.curve, name: methodName(byCurve.get(p.curve)), T: p.time_s, value: p[value],
    lo: p[lo] > 0 ? p[lo] : p[value], hi: isNumber(p[hi]) ? p[hi] : p[value],
    spp: p.spp, srl: srlText(p),
  }));
  const names = methods.filter((m) => points.some((p) => p.name === m));
  const base = points.filter((p) => byCurve.get(p.curve).label === report.baseline).sort((a, b) => a.T - b.T);
  const guide = base.length > 1
    ? [{ T: base[0].T, value: base[0].value }, { T: base.at(-1).T, value: base[0].value * base[0].T / base.at(-1).T }] : [];
  return {
    width, height: 320, padding: 5, config: plotConfig(),
    data: [{ name: "points", values: points }, { name: "guide", values: guide }],
    scales: [
      { name: "x", type: "log", domain: { data: "points", field: "T" }, range: "width", nice: false, padding: 12 },
      { name: "y", type: "log", domain: { fields: [{ data: "points", field: "lo" }, { data: "points", field: "hi" }] }, range: "height", nice: true },
      ...styleScales(names),
    ],
    axes: [shortLogAxis("x", "bottom", `${report.primary_time === "cpu" ? "CPU" : "Wall"} time of one image [s]`),
      logAxis("y", "left", title)],
    legends: [{ ...kMethodLegend, columns: Math.max(2, Math.floor(width / 150)) }],
    marks: [
      { type: "line", from: { data: "guide" }, encode: { update: { x: { scale: "x", field: "T" }, y: { scale: "y", field: "value" },
        stroke: { value: themeColor("soft") }, strokeDash: { value: [2, 4] }, strokeWidth: { value: 1.5 } } } },
      { type: "text", from: { data: "guide" }, encode: { update: {
        opacity: { signal: `datum.T === ${guide.length ? guide[1].T : 0} ? 1 : 0` },
        x: { scale: "x", field: "T" }, y: { scale: "y", field: "value" }, dy: { value: 14 }, align: { value: "right" },
        fill: { value: themeColor("soft") }, text: { value: "slope -1" } } } },
      { type: "group", from: { facet: { name: "line", data: "points", groupby: "curve" } }, marks: [
        { type: "area", from: { data: "line" }, encode: { update: { x: { scale: "x", field: "T" }, y: { scale: "y", field: "lo" },
          y2: { scale: "y", field: "hi" }, fill: { scale: "color", field: "name" }, fillOpacity: { value: 0.15 } } } },
        { type: "line", from: { data: "line" }, encode: { update: { x: { scale: "x", field: "T" }, y: { scale: "y", field: "value" },
          stroke: { scale: "color", field: "name" }, strokeDash: { scale: "dash", field: "name" }, strokeWidth: { value: 2 } } } },
        { type: "symbol", from: { data: "line" }, encode: { update: { x: { scale: "x", field: "T" }, y: { scale: "y", field: "value" },
          fill: { scale: "color", field: "name" }, stroke: { scale: "color", field: "name" }, shape: { scale: "shape", field: "name" },
          size: { value: 60 },
          tooltip: { signal: "{'method': datum.name, 'time [s]': format(datum.T, '.3~r'), 'error': format(datum.value, '.3~e'), " +
            "'interval': format(datum.lo, '.3~e') + ' to ' + format(datum.hi, '.3~e'), 'SPP': datum.spp, 'SRL': datum.srl}" } } } },
      ] },
    ],
  };
}

/**
 * Values with intervals, scene by scene, one method per line.
 * @param items  {scene, name, value, lo, hi, other}: `other` is drawn as an open diamond
 * @param x      scale and axis of the values; `zero` is where the line of "no difference" stands
 */
function forestSpec(width, items, x) {
  const lines = [];
  for (const scene of scenes) {
    const own = items.filter((item) => item.scene === scene);
    if (!own.length) continue;
    lines.push({ id: scene + "|", title: true });
    for (const item of own) lines.push({ ...item, id: scene + "|" + item.name });
  }
  const measured = lines.filter((line) => !line.title);
  const names = methods.filter((m) => measured.some((line) => line.name === m));
  const label = "split(datum.value, '|')";
  return {
    width: Math.max(220, width - 60), height: 22 * lines.length, padding: 5, config: plotConfig(),
    data: [{ name: "lines", values: measured }, { name: "others", values: measured.filter((line) => isNumber(line.other)) }],
    scales: [
      { name: "x", range: "width", ...x.scale },
      { name: "y", type: "point", domain: lines.map((line) => line.id), range: "height", padding: 0.6 },
      ...styleScales(names),
    ],
    axes: [
      { scale: "x", orient: "bottom", grid: true, gridOpacity: 0.6, labelOverlap: true, ...x.axis },
      { scale: "y", orient: "left", ticks: false, domain: false, labelLimit: 180,
        encode: { labels: { update: { text: { signal: `${label}[1] === '' ? ${label}[0] : ${label}[1]` },
          fontWeight: { signal: `${label}[1] === '' ? 'bold' : 'normal'` } } } } },
    ],
    marks: [
      { type: "rule", encode: { update: { x: { scale: "x", value: x.zero }, y: { value: 0 }, y2: { signal: "height" },
        stroke: { value: themeColor("ink") }, strokeWidth: { value: 1.5 } } } },
      { type: "rule", from: { data: "lines" }, encode: { update: { x: { scale: "x", field: "lo" }, x2: { scale: "x", field: "hi" },
        y: { scale: "y", field: "id" }, stroke: { scale: "color", field: "name" }, strokeWidth: { value: 2.5 } } } },
      { type: "symbol", from: { data: "lines" }, encode: { update: { x: { scale: "x", field: "value" }, y: { scale: "y", field: "id" },
        fill: { scale: "color", field: "name" }, shape: { scale: "shape", field: "name" }, size: { value: 70 },
        tooltip: { signal: `{'method': datum.name, 'value': format(datum.value, '${x.format}'), ` +
          `'interval': format(datum.lo, '${x.format}') + ' to ' + format(datum.hi, '${x.format}')}` } } } },
      { type: "symbol", from: { data: "others" }, encode: { update: { x: { scale: "x", field: "other" }, y: { scale: "y", field: "id" },
        shape: { value: "diamond" }, size: { value: 90 }, fill: { value: "transparent" }, stroke: { value: themeColor("ink") }, strokeWidth: { value: 1.5 },
        tooltip: { signal: `{'published': format(datum.other, '${x.format}')}` } } } },
    ],
  };
}

/** Ratios to the baseline with their intervals; published ones as open diamonds. */
function ratioSpec(width) {
  const items = headlineRows().map(({ row }) => row).filter((row) => isNumber(row.ratio) && row.label !== report.baseline)
    .map((row) => ({ scene: row.scene, name: methodName(row), value: row.ratio, lo: row.ratio_lo ?? row.ratio,
      hi: row.ratio_hi ?? row.ratio, other: row.ratio_published }));
  const extent = items.flatMap((item) => [item.lo, item.hi, item.other ?? 1]).concat([1]).filter((v) => v > 0);
  return forestSpec(width, items, {
    scale: { type: "log", domain: [Math.min(...extent) / 1.2, Math.max(...extent) * 1.2] },
    axis: { title: `Efficiency over ${report.baseline} (log scale)`, tickCount: 6, format: "~r" }, zero: 1, format: ".3~r",
  });
}

/** Share of targets that are reached within a multiple of the baseline's time. */
function ecdfSpec(metric, width) {
  const list = report.ecdf.rows.filter((row) => row.metric === metric && isNumber(row.relative_time));
  const longest = Math.max(...list.map((row) => row.relative_time)) * 1.3;
  const shortest = Math.min(...list.map((row) => row.relative_time)) / 1.3;
  const points = [];
  for (const name of methods) {
    const own = list.filter((row) => methodName(row) === name).sort((a, b) => a.relative_time - b.relative_time);
    if (!own.length) continue;
    points.push({ name, x: shortest, y: 0 });
    for (const row of own) points.push({ name, x: row.relative_time, y: row.share });
    points.push({ name, x: longest, y: own.at(-1).share });
  }
  const names = methods.filter((m) => points.some((p) => p.name === m));
  return {
    width, height: 280, padding: 5, config: plotConfig(),
    data: [{ name: "points", values: points }],
    scales: [
      { name: "x", type: "log", domain: [shortest, longest], range: "width" },
      { name: "y", type: "linear", domain: [0, 1], range: "height" },
      ...styleScales(names),
    ],
    axes: [shortLogAxis("x", "bottom", `Time over that of ${report.baseline}`),
      { scale: "y", orient: "left", title: "Share of targets reached", format: ".0%", grid: true, tickCount: 5, gridOpacity: 0.6 }],
    legends: [{ stroke: "color", strokeDash: "dash", symbolType: "stroke", orient: "bottom", columns: Math.max(2, Math.floor(width / 150)) }],
    marks: [
      { type: "rule", encode: { update: { x: { scale: "x", value: 1 }, y: { value: 0 }, y2: { signal: "height" }, stroke: { value: themeColor("soft") } } } },
      { type: "group", from: { facet: { name: "line", data: "points", groupby: "name" } }, marks: [
        { type: "line", from: { data: "line" }, encode: { update: { x: { scale: "x", field: "x" }, y: { scale: "y", field: "y" },
          interpolate: { value: "step-after" }, stroke: { scale: "color", field: "name" }, strokeDash: { scale: "dash", field: "name" },
          strokeWidth: { value: 2 } } } }] },
    ],
  };
}

/** CPU time per traced ray. */
function costSpec(width) {
  const values = headlineRows().filter(({ row }) => isNumber(row.T_cpu_s)).map(({ row }) => {
    const runs = runsOf(row).filter((run) => run.rays > 0);
    const rays = runs.reduce((sum, run) => sum + run.rays, 0) / Math.max(1, runs.length);
    return { name: methodName(row), scene: row.scene, ns: 1e9 * row.T_cpu_s / rays };
  }).filter((v) => isNumber(v.ns));
  return groupedBars(values, "ns", "CPU time per traced ray [ns]", width, "format(datum.ns, '.4~r') + ' ns'");
}

// Told apart with all common colour-vision deficiencies (Tol's light scheme), and no estimator's.
const kStages = [
  { column: "trace", name: "trace", color: "#77aadd" }, { column: "sample", name: "sample", color: "#44bb99" },
  { column: "weigh", name: "weigh", color: "#eedd88" }, { column: "adapt", name: "adapt", color: "#ee8866" },
  { column: "set_up", name: "set up", color: "#ffaabb" }, { column: "outside", name: "between estimates", color: "#dddddd" },
];

/** What the bars of stagesSpec add up to, for a row of stages.csv; nothing where it has no value. */
const kStageTotals = {
  "per ray": { title: "CPU time per traced ray [ns]", of: (row) => row.rays > 0 ? row.ns / row.rays : null },
  "per estimate": { title: "CPU time per estimate [ns]", of: (row) => row.ns },
  "share": { title: "Share of an estimate's CPU time [%]", of: () => 100 },
};

/** The rows of stages.csv of a scene that stand for their methods. */
function stageRows(scene) {
  const cells = new Set(headlineRows().filter(({ row }) => row.scene === scene).flatMap(({ row }) => runsOf(row).map((run) => run.cell)));
  return report.stages.rows.filter((row) => cells.has(row.cell));
}

/** Where the time of estimates goes, one bar per method. @param total  of kStageTotals */
function stagesSpec(scene, total, width) {
  const { title, of } = kStageTotals[total];
  const values = [];
  for (const row of stageRows(scene)) {
    const length = of(row);
    if (!isNumber(length)) continue;
    let from = 0;
    for (const { column, name } of kStages) {
      const to = from + length * row[column];
      values.push({ method: methodName(row), stage: name, from, to, share: row[column], ns: row.ns * row[column], srl: srlText(row) });
      from = to;
    }
  }
  const names = methods.filter((m) => values.some((v) => v.method === m));
  return {
    width: Math.max(220, width - 60), height: 34 * names.length, padding: 5, config: plotConfig(),
    data: [{ name: "values", values }],
    scales: [
      { name: "x", type: "linear", domain: [0, Math.max(...values.map((v) => v.to))], range: "width" },
      { name: "y", type: "band", domain: names, range: "height", padding: 0.2 },
      { name: "fill", type: "ordinal", domain: kStages.map((s) => s.name), range: kStages.map((s) => s.color) },
    ],
    axes: [{ scale: "x", orient: "bottom", title, grid: true, gridOpacity: 0.6, tickCount: 6, labelOverlap: true },
      { scale: "y", orient: "left", ticks: false, domain: false, labelLimit: 180 }],
    legends: [{ fill: "fill", orient: "bottom", columns: Math.max(2, Math.floor(width / 130)), symbolType: "square" }],
    marks: [
      { type: "rect", from: { data: "values" }, encode: { update: { x: { scale: "x", field: "from" }, x2: { scale: "x", field: "to" },
        y: { scale: "y", field: "method" }, height: { scale: "y", band: 1 }, fill: { scale: "fill", field: "stage" },
        tooltip: { signal: "{'method': datum.method, 'SRL': datum.srl, 'stage': datum.stage, 'share': format(datum.share, '.1%'), " +
          "'per estimate': format(datum.ns, '.3~r') + ' ns'}" } } } },
      { type: "text", from: { data: "values" }, encode: { update: { x: { signal: "(scale('x', datum.from) + scale('x', datum.to)) / 2" },
        y: { scale: "y", field: "method", band: 0.5 }, align: { value: "center" }, baseline: { value: "middle" }, fill: { value: "#111111" },
        text: { signal: "scale('x', datum.to) - scale('x', datum.from) > 34 ? format(datum.share, '.0%') : ''" } } } },
    ],
  };
}

function groupedBars(values, field, title, width, text) {
  const names = methods.filter((m) => values.some((v) => v.name === m));
  return {
    width, height: 260, padding: 5, config: plotConfig(),
    data: [{ name: "values", values }],
    scales: [
      { name: "scene", type: "band", domain: scenes, range: "width", padding: 0.2 },
      { name: "y", type: "linear", domain: { data: "values", field }, range: "height", zero: true, nice: true },
      { name: "fill", type: "ordinal", domain: names, range: names.map((n) => styles.get(n).color) },
      ...styleScales(names),
    ],
    axes: [{ scale: "scene", orient: "bottom" }, { scale: "y", orient: "left", title, grid: true, gridOpacity: 0.6, tickCount: 5 }],
    legends: [{ fill: "fill", shape: "shape", orient: "bottom", columns: Math.max(2, Math.floor(width / 150)) }],
    marks: [{ type: "group", from: { facet: { name: "group", data: "values", groupby: "scene" } },
      encode: { update: { x: { scale: "scene", field: "scene" } } },
      signals: [{ name: "width", update: "bandwidth('scene')" }],
      scales: [{ name: "place", type: "band", domain: names, range: "width", padding: 0.1 }],
      marks: [
        { type: "rect", from: { data: "group" }, encode: { update: { x: { scale: "place", field: "name" }, width: { scale: "place", band: 1 },
          y: { scale: "y", field }, y2: { scale: "y", value: 0 }, fill: { scale: "fill", field: "name" },
          tooltip: { signal: `{'method': datum.name, 'scene': datum.scene, 'value': ${text}}` } } } },
        { type: "symbol", from: { data: "group" }, encode: { update: { x: { scale: "place", field: "name", band: 0.5 }, y: { scale: "y", field, offset: -7 },
          shape: { scale: "shape", field: "name" }, size: { value: 35 }, fill: { scale: "fill", field: "name" } } } },
      ] }],
  };
}

/** Relative bias of the whole image with its interval; nothing where there is none. */
function biasOf(row) {
  if (!isNumber(row.bias_rel_lo) || !isNumber(row.T_cpu_s)) return null;
  return { scene: row.scene, name: methodName(row), T: row.T_cpu_s, value: row.bias_rel, lo: row.bias_rel_lo, hi: row.bias_rel_hi };
}

const kBiasTicks = [-1, -0.3, -0.1, -0.03, -0.01, -0.003, -0.001, 0, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1];

/** Bias of one budget, all scenes. */
function biasForestSpec(width) {
  const items = headlineRows().map(({ row }) => biasOf(row)).filter((item) => item);
  const extent = items.flatMap((item) => [item.lo, item.hi]).concat([-0.001, 0.001]);
  return forestSpec(width, items, {
    scale: { type: "symlog", constant: 0.001, domain: [Math.min(...extent), Math.max(...extent)], nice: false },
    axis: { title: "Bias of the image's mean", format: "+.2~%", values: kBiasTicks }, zero: 0, format: "+.3%",
  });
}

/** Bias of one scene against run time. */
function biasCurveSpec(scene, width) {
  const points = rows.filter((row) => row.scene === scene).map(biasOf).filter((point) => point);
  const names = methods.filter((m) => points.some((p) => p.name === m));
  return {
    width, height: 280, padding: 5, config: plotConfig(),
    data: [{ name: "points", values: points }],
    scales: [
      { name: "x", type: "log", domain: { data: "points", field: "T" }, range: "width", padding: 15 },
      { name: "y", type: "symlog", constant: 0.001, domain: { fields: [{ data: "points", field: "lo" }, { data: "points", field: "hi" }] }, range: "height", nice: true },
      ...styleScales(names),
    ],
    axes: [shortLogAxis("x", "bottom", "CPU time of one image [s]"),
      { scale: "y", orient: "left", title: "Bias of the image's mean", format: "+.2~%", grid: true, gridOpacity: 0.6, labelOverlap: true, values: kBiasTicks }],
    legends: [{ ...kMethodLegend, columns: Math.max(2, Math.floor(width / 150)) }],
    marks: [
      { type: "rule", encode: { update: { x: { value: 0 }, x2: { signal: "width" }, y: { scale: "y", value: 0 }, stroke: { value: themeColor("ink") } } } },
      { type: "rule", from: { data: "points" }, encode: { update: { x: { scale: "x", field: "T" }, y: { scale: "y", field: "lo" }, y2: { scale: "y", field: "hi" },
        stroke: { scale: "color", field: "name" }, strokeWidth: { value: 2 } } } },
      { type: "symbol", from: { data: "points" }, encode: { update: { x: { scale: "x", field: "T" }, y: { scale: "y", field: "value" },
        fill: { scale: "color", field: "name" }, stroke: { scale: "color", field: "name" }, shape: { scale: "shape", field: "name" }, size: { value: 60 },
        tooltip: { signal: "{'method': datum.name, 'bias': format(datum.value, '+.3%'), 'interval': format(datum.lo, '+.3%') + ' to ' + format(datum.hi, '+.3%')}" } } } },
    ],
  };
}

/** Error over SRL and another swept number at one budget: every cell of a sweep. */
function surfaces() {
  const groups = new Map();
  for (const row of rows) {
    const second = isNumber(row.population) && row.population > 0 ? "population" : "srl_initial";
    const key = JSON.stringify([row.scene, methodName(row), row.budget_s, second]);
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push(row);
  }
  return [...groups].map(([key, list]) => ({ key: JSON.parse(key), list })).filter(({ key, list }) =>
    new Set(list.map((row) => row.srl)).size > 1 && new Set(list.map((row) => row[key[3]])).size > 1);
}

function surfaceSpec({ key, list }, width) {
  const second = key[3];
  const values = list.filter((row) => isNumber(row.err) && row.err > 0)
    .map((row) => ({ split: srlText(row), srl: row.srl, second: row[second], err: row.err, spp: row.spp }))
    .sort((a, b) => a.srl - b.srl || a.split.localeCompare(b.split));
  // Splits of one total are columns of their own where populations are the rows.
  const x = second === "population" ? "split" : "srl";
  return {
    width, height: 240, padding: 5, config: plotConfig(),
    data: [{ name: "values", values }],
    scales: [
      { name: "x", type: "band", domain: unique(values.map((v) => v[x])), range: "width" },
      { name: "y", type: "band", domain: unique(values.map((v) => v.second)).sort((a, b) => a - b), range: "height", reverse: true },
      { name: "fill", type: "log", domain: { data: "values", field: "err" }, range: { scheme: "viridis" }, reverse: true },
    ],
    axes: [{ scale: "x", orient: "bottom", title: x === "split" ? "SRL, initial-adaptive" : "SRL, both stages", labelOverlap: true },
      { scale: "y", orient: "left", title: second === "population" ? "Population" : "Initial SRL" }],
    legends: [{ fill: "fill", title: "MSE", format: ".1~e" }],
    marks: [
      { type: "rect", from: { data: "values" }, encode: { update: { x: { scale: "x", field: x }, y: { scale: "y", field: "second" },
        width: { scale: "x", band: 1 }, height: { scale: "y", band: 1 }, fill: { scale: "fill", field: "err" },
        tooltip: { signal: "{'SRL': datum.split, 'MSE': format(datum.err, '.3~e'), 'SPP': datum.spp}" } } } },
    ],
  };
}

const kVerdictColors = { ok: "#dce6ec", noisy: "#f2b13c", biased: "#2f5db0", breaks: "#111111" };

/** The stability suite (stability.json): cases by methods, each step from harmless to extreme a block. */
function stabilitySpec(width) {
  const list = report.stability.rows;
  const cases = unique(list.map((row) => row.case)), names = unique(list.map((row) => row.method));
  const steps = new Map();
  for (const row of list) steps.set(row.case, Math.max(steps.get(row.case) ?? 0, row.step + 1));
  const values = list.map((row) => ({ case: row.case, method: row.method, step: row.step, n: steps.get(row.case), verdict: row.verdict,
    at: `${row.parameter} ${numberText(row.value)}`, bias: isNumber(row.bias) ? percentText(row.bias) : "-", reason: row.reason }));
  const verdicts = Object.keys(kVerdictColors);
  return {
    width: Math.max(80 * names.length, width - 90), height: 24 * cases.length, padding: 5, config: plotConfig(),
    data: [{ name: "values", values }],
    scales: [
      { name: "x", type: "band", domain: names, range: "width", paddingInner: 0.08 },
      { name: "y", type: "band", domain: cases, range: "height", paddingInner: 0.15 },
      { name: "fill", type: "ordinal", domain: verdicts, range: verdicts.map((v) => kVerdictColors[v]) },
    ],
    axes: [{ scale: "x", orient: "top", domain: false, ticks: false, labelLimit: 160 }, { scale: "y", orient: "left", domain: false, ticks: false, labelLimit: 220 }],
    legends: [{ fill: "fill", orient: "bottom", columns: 4, symbolType: "square" }],
    marks: [{ type: "rect", from: { data: "values" }, encode: { update: {
      x: { scale: "x", field: "method", offset: { signal: "datum.step * bandwidth('x') / datum.n" } },
      width: { signal: "bandwidth('x') / datum.n - 1" }, y: { scale: "y", field: "case" }, height: { scale: "y", band: 1 },
      fill: { scale: "fill", field: "verdict" },
      tooltip: { signal: "{'case': datum.case, 'estimator': datum.method, 'at': datum.at, 'verdict': datum.verdict, 'bias': datum.bias, 'why': datum.reason}" } } } }],
  };
}
