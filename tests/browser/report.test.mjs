// A report as its reader has it: opened from disk, without a network.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { cpSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const penumbra = process.env.PENUMBRA;
const temporary = mkdtempSync(join(tmpdir(), "penumbra-report-"));
const results = join(temporary, "smoke");
let browser;

function run(...args) {
  return execFileSync(penumbra, args, { encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] });
}

before(async () => {
  run("run", join(process.env.PENUMBRA_ROOT, "configs/smoke.json"), "--out", results);
  browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
});

after(async () => {
  await browser?.close();
  rmSync(temporary, { recursive: true, force: true });
});

/** Opens the report of a folder; whatever it logs as an error or asks a network for is kept. */
async function open(folder, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, ...options });
  const page = await context.newPage();
  const faults = [];
  page.on("console", (message) => { if (message.type() === "error") faults.push(message.text()); });
  page.on("pageerror", (error) => faults.push(error.message));
  page.on("requestfailed", (request) => faults.push("failed: " + request.url().slice(0, 200)));
  page.on("request", (request) => {
    if (!/^(file|data|blob):/.test(request.url())) faults.push("network: " + request.url());
  });
  await page.goto(pathToFileURL(join(folder, "report.html")).href);
  return { page, faults };
}

/** The viewer with its first picture shown. */
async function openViewer(page) {
  await page.locator("#images").scrollIntoViewIfNeeded();
  await page.waitForFunction(() => document.querySelector("#readout [data-value]") !== null);
}

test("the page opens from disk without an error or a request to a network", async () => {
  const { page, faults } = await open(results);
  await openViewer(page);
  assert.equal(await page.title(), "smoke - Penumbra report");
  assert.ok(await page.locator("#summary li").count() > 0, "sentences");
  assert.ok(await page.locator("#plots svg").count() >= 3, "plots");
  assert.deepEqual(faults, []);
});

test("a click on a column sorts the table, another turns it round", async () => {
  const { page } = await open(results);
  const header = page.locator("#efficiency-table thead th", { hasText: /^MSE$/ });
  const column = await header.evaluate((th) => th.cellIndex);
  const values = () => page.locator(`#efficiency-table tbody tr td:nth-child(${column + 1})`).allTextContents();
  const numbers = async () => (await values()).map(Number);
  await header.locator("button").click();
  const rising = await numbers();
  assert.deepEqual(rising, [...rising].sort((a, b) => a - b));
  assert.equal(await header.getAttribute("aria-sort"), "ascending");
  await header.locator("button").press("Enter");
  assert.deepEqual(await numbers(), [...rising].reverse());
  assert.equal(await header.getAttribute("aria-sort"), "descending");
});

test("keys flip between pictures and looks", async () => {
  const { page, faults } = await open(results);
  await openViewer(page);
  const pressed = () => page.locator("#images [data-key][aria-pressed=true]").textContent();
  const canvas = page.locator("#panes canvas").first();
  const bits = () => canvas.evaluate((c) => c.toDataURL().length + ":" + c.getContext("2d").getImageData(0, 0, c.width, c.height).data.reduce((a, b) => (a * 31 + b) | 0, 7));
  await canvas.focus();
  await page.keyboard.press("0");
  assert.equal(await pressed(), "Reference");
  await page.waitForFunction(() => document.querySelector("#images [role=status]").textContent === "");
  const reference = await bits();
  await page.keyboard.press("2");
  assert.notEqual(await pressed(), "Reference");
  await page.waitForFunction(() => document.querySelector("#images [role=status]").textContent === "");
  assert.notEqual(await bits(), reference);
  await page.keyboard.press("f");
  assert.equal(await pressed(), "Reference", "back to the picture before");
  await page.keyboard.press("1");
  await page.keyboard.press("s");
  await page.waitForFunction(() => document.querySelector("#images canvas.scale").hidden === false);
  await page.keyboard.press("g");
  assert.ok(await page.locator("#panes canvas").count() > 2, "side by side");
  assert.deepEqual(faults, []);
});

test("the value under the pointer is that of the EXR file", async () => {
  const { page } = await open(results);
  await openViewer(page);
  const canvas = page.locator("#panes canvas").first();
  await canvas.scrollIntoViewIfNeeded();
  const box = await canvas.boundingBox();
  for (const [u, v] of [[0.31, 0.42], [0.77, 0.8]]) {
    await page.mouse.move(box.x + u * box.width, box.y + v * box.height);
    const pixel = [Math.floor(u * 96), Math.floor(v * 54)].join(",");
    await page.waitForFunction((text) => document.getElementById("pixel").textContent === text,
      "Pixel " + pixel.replace(",", ", "));
    const key = await page.locator("#images [data-key][aria-pressed=true]").getAttribute("data-key");
    const shown = await page.locator(`#readout tr[data-key="${key}"] td[data-value]`)
      .evaluateAll((cells) => cells.map((cell) => Number(cell.dataset.value)));
    const command = await page.locator("#readout code.command").textContent();
    const [, row] = command.match(/--row (\w+)/);
    const replay = JSON.parse(run("replay", results, "--row", row, "--pixel", pixel, "--json"));
    assert.deepEqual(shown, replay.stored.value.map(Math.fround));
  }
});

test("where the time goes is shown by ray, by estimate and as shares, and missing where it was not measured", async () => {
  const { page, faults } = await open(results);
  const figure = page.locator("figure", { hasText: "Where the time goes: checkerboard" });
  const axis = () => figure.locator("svg .role-axis-title").first().textContent();
  const stages = ["trace", "sample", "weigh", "adapt", "set up", "between estimates"];
  assert.deepEqual((await figure.locator("svg .role-legend-label text").allTextContents()).sort(), [...stages].sort());
  assert.equal(await figure.locator("svg .mark-rect.role-mark path").count(), 4 * stages.length, "a bar per method and sampler");
  const ray = await axis();
  await figure.locator("select").selectOption("share");
  assert.notEqual(await axis(), ray);
  assert.match(await axis(), /%/);
  await figure.screenshot({ path: "stages.png" });
  assert.deepEqual(faults, []);

  const copy = join(temporary, "without-stages");
  cpSync(results, copy, { recursive: true });
  rmSync(join(copy, "stages.csv"));
  run("report", copy);
  const without = await open(copy);
  assert.match(await without.page.locator("#missing").textContent(), /stages\.csv/);
  assert.equal(await without.page.locator("figure", { hasText: "Where the time goes" }).count(), 0);
  assert.deepEqual(without.faults, []);
});

test("the theme changes and plots follow", async () => {
  const { page } = await open(results, { colorScheme: "light" });
  const look = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const light = await look();
  await page.locator("#theme").click();
  assert.notEqual(await look(), light);
  assert.equal(await page.locator("#theme").getAttribute("aria-pressed"), "true");
});

test("nothing is wider than the window at 1280 and 390 pixels", async () => {
  for (const width of [1280, 390]) {
    const { page } = await open(results, { viewport: { width, height: 900 } });
    await openViewer(page);
    const excess = await page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
    assert.ok(excess <= 0, `${excess} pixels at ${width}`);
    await page.evaluate(() => window.scrollTo(0, 0));
    await page.screenshot({ path: `report-${width}.png`, fullPage: true });
  }
});

test("a scene can be shown alone, by button and by address", async () => {
  const copy = join(temporary, "scenes");
  cpSync(results, copy, { recursive: true });
  const measurements = join(copy, "measurements.csv");
  const [head, ...lines] = readFileSync(measurements, "utf8").trimEnd().split("\n");
  const renamed = lines.map((line) => line.replace(/^(\w+),checkerboard,/, "$1x,attic,"));
  writeFileSync(measurements, [head, ...lines, ...renamed, ""].join("\n"));
  run("report", copy);
  const { page, faults } = await open(copy);
  const visible = () => page.locator("#efficiency-table tbody tr:visible").count();
  assert.equal(await visible(), 8);
  await page.getByRole("button", { name: "attic", exact: true }).click();
  assert.equal(await visible(), 4);
  const address = page.url();
  assert.match(address, /#scene=attic$/);
  await page.getByRole("button", { name: "All scenes" }).click();
  assert.equal(await visible(), 8);
  await page.goto(address);
  await page.reload();
  assert.equal(await visible(), 4);
  assert.deepEqual(faults, []);
});

test("embedded pictures need no folder", async () => {
  const copy = join(temporary, "embedded");
  cpSync(results, copy, { recursive: true });
  run("report", copy, "--embed");
  rmSync(join(copy, "report_files"), { recursive: true, force: true });
  const { page, faults } = await open(copy);
  await openViewer(page);
  assert.deepEqual(faults, []);
});

test("a partial folder gives a page that says what is missing", async () => {
  const copy = join(temporary, "partial");
  cpSync(results, copy, { recursive: true });
  rmSync(join(copy, "images"), { recursive: true });
  rmSync(join(copy, "environment.json"));
  writeFileSync(join(copy, "config.resolved.json"), "{");
  assert.ok(readdirSync(copy).includes("measurements.csv"));
  run("report", copy);
  const { page, faults } = await open(copy);
  const missing = await page.locator("#missing").textContent();
  assert.match(missing, /config\.resolved\.json/);
  assert.match(missing, /picture of checkerboard, MIS/);
  assert.match(await page.locator("#provenance").textContent(), /environment\.json is missing/);
  assert.ok(await page.locator("#efficiency-table tbody tr").count() > 0, "rows are there");
  assert.deepEqual(faults, []);
});
