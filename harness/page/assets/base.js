"use strict";
// Data, numbers, colours and themes: what every part of the page shares.

const report = JSON.parse(document.getElementById("data").textContent);

/** Makes an element. @param attributes  "on..." are listeners, others are set as attributes */
function element(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}

function section(id) {
  return document.getElementById(id);
}

const isNumber = (value) => typeof value === "number" && Number.isFinite(value);

/** Three significant digits; "-" where there is none. */
function numberText(value) {
  if (!isNumber(value)) return value === null || value === undefined ? "-" : String(value);
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e-3 && size < 1e5) return String(Number(value.toPrecision(3)));
  return value.toExponential(2).replace("e+", "e");
}

function secondsText(value) {
  if (!isNumber(value)) return "-";
  if (value >= 1) return numberText(value) + " s";
  return value >= 1e-3 ? numberText(value * 1e3) + " ms" : numberText(value * 1e6) + " us";
}

function ratioText(value) {
  if (!isNumber(value)) return "-";
  return value >= 0.1 && value < 1000 ? value.toFixed(2) : numberText(value);
}

function rangeText(lo, hi, text = ratioText) {
  return isNumber(lo) && isNumber(hi) ? `[${text(lo)}, ${text(hi)}]` : "";
}

function percentText(value) {
  if (!isNumber(value)) return "-";
  return (value >= 0 ? "+" : "-") + (100 * Math.abs(value)).toFixed(2) + " %";
}

function srlText(row) {
  return row.srl_adaptive ? `${row.srl_initial}-${row.srl_adaptive}` : String(row.srl);
}

function unique(values) {
  return [...new Set(values)];
}

const rows = report.efficiency.rows;
const scenes = unique(rows.map((row) => row.scene));
const hasSeveralSamplers = new Set(rows.map((row) => row.sampler)).size > 1;

/** How a method is named wherever it is shown: with its sampler where the label has several. */
const samplersOf = new Map();
for (const row of rows) {
  if (!samplersOf.has(row.label)) samplersOf.set(row.label, new Set());
  samplersOf.get(row.label).add(row.sampler);
}
function methodName(row) {
  const samplers = samplersOf.get(row.label);
  return samplers && samplers.size > 1 ? `${row.label} (${row.sampler})` : row.label;
}
const methods = unique(rows.map(methodName));

// One colour per estimator on every page, told apart with all common colour-vision deficiencies
// (Okabe and Ito); methods of one estimator differ in symbol and dash as well.
const kEstimatorColors = {
  mis: "#0072b2", alsd: "#e69f00", mdhi: "#009e73", pmc_hi: "#d55e00",
  bsdf: "#cc79a7", light: "#56b4e9", uniform: "#8a8a8a",
};
const kOtherColors = ["#7f5539", "#6a51a3", "#b59b00", "#3b7a57"];
const kSymbols = ["circle", "square", "triangle-up", "diamond", "cross", "triangle-down"];
const kDashes = [[1, 0], [6, 3], [2, 2], [8, 3, 2, 3], [4, 4], [1, 3]];

function estimatorColor(estimator) {
  if (kEstimatorColors[estimator]) return kEstimatorColors[estimator];
  let sum = 0;
  for (const c of estimator) sum += c.codePointAt(0);
  return kOtherColors[sum % kOtherColors.length];
}

const styles = new Map();
for (const row of rows) {
  const name = methodName(row);
  if (styles.has(name)) continue;
  const siblings = [...styles.values()].filter((s) => s.estimator === row.estimator).length;
  styles.set(name, {
    estimator: row.estimator,
    color: estimatorColor(row.estimator),
    symbol: kSymbols[siblings % kSymbols.length],
    dash: kDashes[siblings % kDashes.length],
  });
}

function swatch(name) {
  const style = styles.get(name);
  return element("span", { class: "swatch", style: `background:${style ? style.color : "#888"}` });
}

/** The rows that stand for their method, with their places in the table. */
function headlineRows() {
  return report.headline.map((index) => ({ row: rows[index], index }));
}

function isBiased(row) {
  return isNumber(row.bias_p_holm) && row.bias_p_holm <= report.bias_level;
}

function standing(ratio, lo, hi) {
  if (!isNumber(ratio)) return "none";
  if (!isNumber(lo) || !isNumber(hi)) return "undecided";
  if (lo > 1) return "better";
  return hi < 1 ? "worse" : "undecided";
}

/** Shows one scene alone, or all where it is null: a page of its own, linked as #scene=NAME. */
const sceneListeners = [];
function showScene(scene) {
  for (const node of document.querySelectorAll("[data-scene]")) {
    node.hidden = scene !== null && node.dataset.scene !== scene;
  }
  for (const button of document.querySelectorAll("#scenes button")) {
    button.setAttribute("aria-pressed", String(button.value === (scene ?? "")));
  }
  for (const listener of sceneListeners) listener(scene);
}
function sceneOfAddress() {
  const scene = decodeURIComponent((location.hash.match(/^#scene=(.*)$/) ?? [])[1] ?? "");
  return scenes.includes(scene) ? scene : null;
}

const themeListeners = [];
function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  const button = document.getElementById("theme");
  button.setAttribute("aria-pressed", String(theme === "dark"));
  for (const listener of themeListeners) listener();
}
function themeColor(name) {
  return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
}

function download(name, url) {
  const link = element("a", { href: url, download: name });
  document.body.append(link);
  link.click();
  link.remove();
}
