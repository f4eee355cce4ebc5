// Summary, tables and provenance.

function fillAbout() {
  const environment = report.environment ?? {};
  const build = environment.penumbra ?? {};
  const session = (environment.sessions ?? [])[0] ?? {};
  const parts = [report.summary, session.started ? "measured " + session.started.slice(0, 10) : "",
    build.commit ? "commit " + build.commit : "", (environment.machine ?? {}).cpu ?? ""];
  document.getElementById("about").textContent = parts.filter((part) => part).join(" \u00b7 ");
}

function fillSections() {
  const list = document.getElementById("sections");
  for (const part of document.querySelectorAll("main > section")) {
    const title = part.querySelector("h2").textContent;
    list.append(element("li", {}, element("a", { href: "#" + part.id }, title)));
  }
}

/** Buttons that show one scene alone. */
function fillScenes() {
  if (scenes.length < 2) return;
  const place = document.getElementById("scenes");
  for (const scene of [null, ...scenes]) {
    place.append(element("button", { type: "button", value: scene ?? "", onclick: () => {
      history.replaceState(null, "", scene === null ? "#" : "#scene=" + encodeURIComponent(scene));
      showScene(scene);
    } }, scene ?? "All scenes"));
  }
}

/** Methods by scenes: the ratio to the baseline, at a glance. */
function matrix() {
  const cells = new Map(headlineRows().map(({ row, index }) =>
    [JSON.stringify([methodName(row), row.scene]), { row, index }]));
  const head = element("tr", {}, element("th", { class: "text", scope: "col" }, "Efficiency over " + report.baseline));
  for (const scene of scenes) head.append(element("th", { scope: "col", style: "text-align:center", "data-scene": scene }, scene));
  const body = element("tbody");
  for (const method of methods) {
    const line = element("tr", {}, element("th", { class: "text", scope: "row" }, swatch(method), method));
    for (const scene of scenes) {
      const cell = matrixCell(cells.get(JSON.stringify([method, scene])));
      cell.dataset.scene = scene;
      line.append(cell);
    }
    body.append(line);
  }
  return element("div", { class: "scroll" }, element("table", { class: "matrix" }, element("thead", {}, head), body));
}

function matrixCell(cell) {
  if (!cell) return element("td", { class: "none" }, "-");
  const { row, index } = cell;
  if (row.label === report.tuned_baseline && !isNumber(row.ratio)) {
    // Its sampler is its own; the baseline was compared with it, which is the inverse.
    const base = rows.find((other) => other.scene === row.scene && other.label === report.baseline &&
      other.budget_s === row.budget_s && isNumber(other.ratio_tuned));
    if (base) return matrixCellOf(row, index, 1 / base.ratio_tuned, 1 / base.ratio_tuned_hi, 1 / base.ratio_tuned_lo);
  }
  return matrixCellOf(row, index, row.ratio, row.ratio_lo, row.ratio_hi);
}

/** @param ratio  to the baseline, with its interval */
function matrixCellOf(row, index, ratio, lo, hi) {
  const isBaseline = row.label === report.baseline;
  const kind = row.verdict === "failed" || isBaseline ? "none" : standing(ratio, lo, hi);
  const mark = { better: "\u25b2 ", worse: "\u25bc ", undecided: "\u2248 ", none: "" }[kind];
  const value = row.verdict === "failed" ? "failed" : isBaseline ? "baseline"
    : mark + ratioText(ratio) + (isNumber(ratio) ? "\u00d7" : "");
  const range = isBaseline ? "" : rangeText(lo, hi);
  const td = element("td", { class: kind },
    element("a", { href: "#row-" + index, class: "value", title: row.note || null }, value));
  if (range) td.append(element("span", { class: "range" }, range));
  if (isNumber(row.ratio_published) && !isBaseline) {
    td.append(element("span", { class: "paper" }, "published " + ratioText(row.ratio_published) + "\u00d7"));
  }
  if (isBiased(row)) td.append(element("span", { class: "range" }, "biased " + percentText(row.bias_rel)));
  return td;
}

function fillSummary() {
  const place = section("summary");
  if (!rows.length) {
    place.append(element("p", {}, "There are no measured rows in this folder."));
  } else {
    place.append(matrix());
    place.append(element("p", { class: "soft" },
      `Ratio of efficiencies 1/(T \u00d7 MSE) in ${report.primary_time === "cpu" ? "CPU" : "wall"} time, with its ` +
      `${100 * report.confidence} % interval over blocks. \u25b2 the interval is above 1, \u25bc below, \u2248 it holds 1. ` +
      "Every cell leads to its row."));
  }
  const titles = { result: "Methods", leader: "Scenes", caution: "What to be careful about" };
  for (const kind of Object.keys(titles)) {
    const texts = report.statements.filter((s) => s.kind === kind).map((s) => s.text);
    if (!texts.length) continue;
    place.append(element("h3", {}, titles[kind]));
    place.append(element("ul", { class: "statements" }, ...texts.map((text) => element("li", {}, text))));
  }
  if (report.stale_rows) {
    place.append(element("p", {}, `${report.stale_rows} rows are of cells that the config no longer has; they are left out.`));
  }
  if (report.missing.length) {
    place.append(element("h3", {}, "Missing in this folder"));
    place.append(element("ul", { class: "statements", id: "missing" },
      ...report.missing.slice(0, 20).map((text) => element("li", {}, text)),
      ...(report.missing.length > 20 ? [element("li", {}, `and ${report.missing.length - 20} more`)] : [])));
  }
}

/** Columns of the big table: title, value to sort by, text; "text" columns to the left. */
function efficiencyColumns() {
  const several = hasSeveralSamplers;
  const has = (name) => rows.some((row) => isNumber(row[name]));
  const columns = [
    { title: "Scene", key: (r) => r.scene, text: (r) => r.scene, left: true },
    { title: "Method", key: (r) => r.label, text: (r) => r.label, left: true, swatch: true },
    several && { title: "Sampler", key: (r) => r.sampler, text: (r) => r.sampler, left: true },
    { title: "SPP", key: (r) => r.spp, text: (r) => String(r.spp) },
    { title: "SRL", key: (r) => r.srl, text: srlText },
    has("population") && { title: "Population", key: (r) => r.population, text: (r) => numberText(r.population) },
    { title: "T (CPU)", key: (r) => r.T_cpu_s, text: (r) => secondsText(r.T_cpu_s) },
    { title: "MSE", key: (r) => r.err, text: (r) => numberText(r.err) },
    { title: "relMSE", key: (r) => r.relmse, text: (r) => numberText(r.relmse) },
    { title: "Efficiency", key: (r) => r.eff_cpu, text: (r) => numberText(r.eff_cpu) },
    { title: "Ratio", key: (r) => r.ratio, text: (r) => ratioText(r.ratio) + " " + rangeText(r.ratio_lo, r.ratio_hi) },
    has("ratio_published") && { title: "Published", key: (r) => r.ratio_published, text: (r) => ratioText(r.ratio_published) },
    has("ratio_tuned") && { title: "To " + report.tuned_baseline, key: (r) => r.ratio_tuned,
      text: (r) => ratioText(r.ratio_tuned) + " " + rangeText(r.ratio_tuned_lo, r.ratio_tuned_hi) },
    { title: "Per ray", key: (r) => r.ratio_rays, text: (r) => ratioText(r.ratio_rays) },
    { title: "P_eff", key: (r) => r.p_eff, text: (r) => numberText(r.p_eff) },
    { title: "Bias", key: (r) => r.bias_rel, text: (r) => percentText(r.bias_rel) },
    { title: "Verdict", key: (r) => r.verdict, left: true,
      text: (r) => r.verdict + (isBiased(r) ? ", biased" : "") },
  ];
  return columns.filter((column) => column);
}

function compare(a, b) {
  const missing = (v) => v === null || v === undefined || v === "";
  if (missing(a) || missing(b)) return missing(a) - missing(b);
  return typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b));
}

function fillEfficiency() {
  const place = section("efficiency");
  if (!rows.length) { place.append(element("p", {}, "Nothing was measured.")); return; }
  const columns = efficiencyColumns();
  const head = element("tr");
  const body = element("tbody");
  const lines = rows.map((row, index) => efficiencyLine(row, index, columns));
  let sorted = { column: -1, descending: false };
  columns.forEach((column, c) => {
    const th = element("th", { scope: "col", class: column.left ? "text" : null });
    th.append(element("button", { type: "button", onclick: () => {
      sorted = { column: c, descending: sorted.column === c && !sorted.descending };
      for (const other of head.children) other.removeAttribute("aria-sort");
      th.setAttribute("aria-sort", sorted.descending ? "descending" : "ascending");
      const order = rows.map((row, index) => ({ index, key: column.key(row) }));
      order.sort((a, b) => {
        const value = compare(a.key, b.key);
        const isEmpty = a.key === null || b.key === null;
        return (sorted.descending && !isEmpty ? -value : value) || a.index - b.index;
      });
      body.append(...order.map((item) => lines[item.index]));
    } }, column.title));
    head.append(th);
  });
  head.append(element("th", { scope: "col" }, "Runs"));
  body.append(...lines);
  place.append(element("div", { class: "scroll" },
    element("table", { id: "efficiency-table" }, element("thead", {}, head), body)));
  place.append(element("div", { id: "runs", "aria-live": "polite" }));
  const epsilon = report.relmse_epsilon;
  place.append(element("p", { class: "soft" },
    "MSE is debiased by the two halves of the reference; relMSE divides by reference\u00b2 + " +
    `${epsilon} mean(reference)\u00b2. Biased: the mean error differs from 0, p \u2264 ${report.bias_level} after Holm over the table. ` +
    (report.published_source ? "Published: " + report.published_source + "." : "")));
}

function efficiencyLine(row, index, columns) {
  const line = element("tr", { id: "row-" + index, "data-scene": row.scene });
  for (const column of columns) {
    const td = element("td", { class: column.left ? "text" : null }, column.text(row));
    if (column.swatch) td.prepend(swatch(methodName(row)));
    line.append(td);
  }
  line.append(element("td", {}, element("button", { type: "button", onclick: () => showRuns(row) },
    `${row.n_blocks} runs`)));
  return line;
}

function runsOf(row) {
  const same = ["scene", "label", "sampler", "params", "spp", "srl", "srl_initial", "population", "budget_s"];
  return report.runs.rows.filter((run) => same.every((name) => run[name] === row[name]));
}

/** The raw rows behind one row of the table, and how to run one of their pixels again. */
function showRuns(row) {
  const names = ["run_id", "block", "attempt", "time_cpu_s", "time_wall_s", "rays", "mse", "relmse", "mean_error",
    "p_eff", "status", "contaminated"];
  const place = document.getElementById("runs");
  place.replaceChildren(element("h3", {}, `Runs of ${methodName(row)} on ${row.scene}, SRL ${srlText(row)}, SPP ${row.spp}`));
  if (row.note) place.append(element("p", {}, "Note: " + row.note + "."));
  const head = element("tr", {}, ...names.map((name) => element("th", { scope: "col" }, name)));
  const body = element("tbody", {}, ...runsOf(row).map((run) => element("tr", {},
    ...names.map((name) => element("td", {}, isNumber(run[name]) ? numberText(run[name]) : String(run[name] ?? ""))))));
  place.append(element("div", { class: "scroll" }, element("table", {}, element("thead", {}, head), body)));
  const first = runsOf(row)[0];
  if (first) place.append(element("p", {}, "Every sample of a pixel: ", element("code", {}, replayCommand(first.run_id, 0, 0))));
}

function shellQuoted(text) {
  return /^[\w@%+=:,./-]+$/.test(text) ? text : "'" + text.replaceAll("'", "'\\''") + "'";
}

function replayCommand(runId, x, y) {
  return `penumbra replay ${shellQuoted(report.folder)} --row ${runId} --pixel ${x},${y}`;
}

function facts(pairs) {
  const list = element("dl", { class: "facts" });
  for (const [name, value] of pairs) {
    if (value === null || value === undefined || value === "") continue;
    list.append(element("dt", {}, name), element("dd", {}, String(value)));
  }
  return list;
}

function fillProvenance() {
  const place = section("provenance");
  const environment = report.environment;
  if (environment) {
    const pairs = [];
    for (const [group, content] of Object.entries(environment)) {
      if (group === "sessions" || group === "builds") continue;
      if (content && typeof content === "object") {
        for (const [name, value] of Object.entries(content)) pairs.push([`${group} ${name}`.replaceAll("_", " "), value]);
      } else {
        pairs.push([group.replaceAll("_", " "), content]);
      }
    }
    (environment.sessions ?? []).forEach((session, i) =>
      pairs.push([`session ${i + 1}`, `${session.started}, commit ${session.commit}, ` +
        (session.build ? `build ${session.build}, ` : "") + session.command_line]));
    // The one that is described above is among them.
    const builds = Object.entries(environment.builds ?? {});
    if (builds.length > 1) {
      for (const [id, build] of builds) {
        pairs.push([`build ${id}`, `commit ${build.commit}, ${build.compiler}, ${build.preset}: ${build.flags}`]);
      }
    }
    place.append(facts(pairs));
  } else {
    place.append(element("p", {}, "environment.json is missing: nobody knows what machine and build made these rows."));
  }
  place.append(element("h3", {}, "Raw data"));
  place.append(element("ul", {}, ...report.files.map((file) =>
    element("li", {}, element("a", { href: file.name }, file.name), ` ${Math.ceil(file.bytes / 1024)} kB`))));
}
