// The image viewer: all pictures of a scene under one zoom, one exposure and one scale.

const kModes = { radiance: "Radiance", error: "Absolute error", signed: "Signed error" };

class Viewer {
  constructor(place) {
    this.place = place;
    this.zoom = { scale: 1, x: 0.5, y: 0.5 };  // x, y: of the picture, at the middle of a pane
    this.mode = "radiance";
    this.curve = "clip at 1";
    this.exposure = report.exposure ?? 0;
    this.split = null;     // place of the slider in [0, 1], or nothing
    this.grid = false;
    this.cursor = null;    // pixel under the pointer
    this.drawn = new Map();  // what was coloured, by picture and look
    this.build();
    this.setScene(unique(report.images.map((image) => image.scene))[0]);
  }

  // ---- controls ----

  build() {
    const names = unique(report.images.map((image) => image.scene));
    this.sceneSelect = choice("Scene", names, (scene) => this.setScene(scene));
    this.layerSelect = choice("Layer", [], (layer) => this.setLayer(layer));
    this.pictures = element("div", { class: "choices", role: "group", "aria-label": "Pictures" });
    this.modes = element("div", { class: "choices", role: "group", "aria-label": "What is shown" });
    for (const [mode, title] of Object.entries(kModes)) {
      this.modes.append(element("button", { type: "button", "data-mode": mode, onclick: () => this.setMode(mode) }, title));
    }
    this.exposureInput = element("input", { type: "range", min: -8, max: 8, step: 0.25, value: this.exposure,
      "aria-label": "Exposure in stops", oninput: () => this.setExposure(Number(this.exposureInput.value)) });
    this.exposureText = element("output", {}, "");
    this.curveSelect = choice("Tone curve", Object.keys(kToneCurves), (curve) => { this.curve = curve; this.draw(); });
    this.sliderButton = element("button", { type: "button", "aria-pressed": "false", onclick: () => this.toggleSplit() }, "Slider");
    this.gridButton = element("button", { type: "button", "aria-pressed": "false", onclick: () => this.toggleGrid() }, "Side by side");
    this.crops = element("div", { class: "choices", role: "group", "aria-label": "Crops" });
    this.panes = element("div", { class: "panes", id: "panes" });
    this.scaleCanvas = element("canvas", { class: "scale", width: 600, height: 64, role: "img", "aria-label": "Colour scale" });
    this.readout = element("div", { class: "readout", id: "readout", "aria-live": "polite" });
    this.status = element("p", { class: "soft", role: "status" });
    this.place.append(
      element("div", { class: "bar" }, element("label", {}, "Scene", this.sceneSelect), element("label", {}, "Layer", this.layerSelect), this.modes),
      element("div", { class: "bar" }, this.pictures),
      element("div", { class: "bar" }, element("label", {}, "Exposure", this.exposureInput, this.exposureText),
        element("label", {}, "Curve", this.curveSelect), this.sliderButton, this.gridButton,
        element("button", { type: "button", onclick: () => this.setZoom({ scale: 1, x: 0.5, y: 0.5 }) }, "Whole picture"), this.crops),
      element("div", { class: "viewer" }, element("div", {}, this.panes, this.scaleCanvas, this.status), this.readout),
      element("p", { class: "soft" }, "Keys, with the picture focused: 0 reference, 1 to 9 pictures, left and right next, F back to the one before, ",
        "E error, S signed error, R radiance, C slider, G side by side, [ ] exposure, + - zoom, arrows with Shift pan, H whole picture. ",
        "Wheel zooms, dragging pans."));
  }

  setScene(scene) {
    this.scene = scene;
    this.sceneSelect.value = scene;
    const layers = unique(report.images.filter((i) => i.scene === scene).map((i) => i.layer));
    this.layerSelect.replaceChildren(...layers.map((value) => element("option", { value }, value)));
    this.zoom = { scale: 1, x: 0.5, y: 0.5 };
    this.drawn.clear();
    this.crops.replaceChildren(...report.crops.filter((crop) => crop.scene === scene).map((crop) =>
      element("button", { type: "button", onclick: () => this.showCrop(crop.rectangle) }, "Crop: " + crop.name)));
    this.setLayer("radiance");
  }

  setLayer(layer) {
    this.layer = layer;
    this.layerSelect.value = layer;
    this.list = report.images.filter((image) => image.scene === this.scene && image.layer === layer);
    this.modes.hidden = layer !== "radiance";
    this.pictures.replaceChildren(...this.list.map((image, i) =>
      element("button", { type: "button", "data-key": image.key, title: i < 10 ? "key " + this.keyOf(i) : null, onclick: () => this.select(image.key) },
        image.label ? swatch(methodName(image)) : "", this.title(image))));
    this.before = null;
    this.select(this.list[Math.min(layer === "radiance" ? 1 : 0, this.list.length - 1)].key);
  }

  keyOf(index) {
    return this.layer === "radiance" ? index : index + 1;
  }

  title(image) {
    return image.label ? methodName(image) : "Reference";
  }

  image(key) {
    return this.list.find((image) => image.key === key);
  }

  select(key) {
    if (key !== this.key) this.before = this.key ?? null;
    this.key = key;
    for (const button of this.pictures.children) button.setAttribute("aria-pressed", String(button.dataset.key === key));
    this.layout();
  }

  step(by) {
    const at = this.list.findIndex((image) => image.key === this.key);
    this.select(this.list[(at + by + this.list.length) % this.list.length].key);
  }

  setMode(mode) { this.mode = mode; this.draw(); }
  setExposure(stops) {
    this.exposure = Math.max(-8, Math.min(8, stops));
    this.exposureInput.value = this.exposure;
    this.draw();
  }
  toggleSplit() { this.split = this.split === null ? 0.5 : null; this.grid = false; this.layout(); }
  toggleGrid() { this.grid = !this.grid; this.split = null; this.layout(); }

  setZoom(zoom) {
    const scale = Math.max(1, Math.min(64, zoom.scale));
    const margin = 0.5 / scale;
    const inside = (v) => Math.max(margin, Math.min(1 - margin, v));
    this.zoom = { scale, x: inside(zoom.x), y: inside(zoom.y) };
    this.paint();
  }

  showCrop([x, y, w, h]) {
    const { width, height } = this.list[0];
    this.setZoom({ scale: Math.min(width / w, height / h), x: (x + w / 2) / width, y: (y + h / 2) / height });
  }

  // ---- panes ----

  /** Makes the panes that are shown: one, or one per picture. */
  layout() {
    this.sliderButton.setAttribute("aria-pressed", String(this.split !== null));
    this.gridButton.setAttribute("aria-pressed", String(this.grid));
    const keys = this.grid ? this.list.map((image) => image.key) : [this.key];
    const columns = this.grid ? Math.ceil(Math.sqrt(keys.length)) : 1;
    this.panes.style.gridTemplateColumns = `repeat(${columns}, minmax(0, 1fr))`;
    this.paneList = keys.map((key) => this.makePane(key));
    const focused = this.panes.contains(document.activeElement);
    this.panes.replaceChildren(...this.paneList.map((pane) => pane.node));
    if (focused) this.paneList[0].canvas.focus({ preventScroll: true });
    this.draw();
  }

  makePane(key) {
    const { width, height } = this.list[0];
    const canvas = element("canvas", { tabindex: 0, role: "img", "aria-label": `${this.title(this.image(key))}, ${this.scene}`,
      onkeydown: (event) => this.onKey(event), onpointermove: (event) => this.onMove(event, canvas),
      onpointerdown: (event) => this.onDown(event, canvas), onpointerup: () => { this.drag = null; } });
    canvas.addEventListener("wheel", (event) => this.onWheel(event, canvas), { passive: false });
    canvas.width = Math.max(width, 960);
    canvas.height = Math.round(canvas.width * height / width);
    const node = element("div", { class: "pane" }, canvas, element("span", { class: "name" }, this.title(this.image(key))));
    const other = this.split !== null ? this.otherKey() : null;
    if (other) node.append(element("span", { class: "name right" }, this.title(this.image(other))));
    return { key, canvas, node, other };
  }

  /** What the slider shows at its right: the picture before, or else the reference. */
  otherKey() {
    if (this.before && this.image(this.before) && this.before !== this.key) return this.before;
    return (this.list.find((image) => image.key !== this.key) ?? this.list[0]).key;
  }

  // ---- colours ----

  /** Scalars of the present look: error, or a map's values. */
  async scalarsOf(image) {
    const values = await pixelsOf(image);
    if (image.channels === 1) return values;
    const reference = await pixelsOf(this.list[0]);
    const error = signedError(values, reference, image.width * image.height);
    return this.mode === "error" ? error.map(Math.abs) : error;
  }

  /** One scale for all pictures of the scene, so that colours can be compared. */
  async sharedScale() {
    if (this.layer === "radiance" && this.mode === "radiance") return null;
    const key = `${this.layer}/${this.mode}/scale`;
    if (!this.drawn.has(key)) {
      const arrays = await Promise.all(this.list.filter((i) => i.label).map((image) => this.scalarsOf(image)));
      const limit = quantileOfSize(arrays, this.layer === "radiance" ? 0.99 : 1);
      const signed = this.layer === "radiance" && this.mode === "signed";
      this.drawn.set(key, { min: signed ? -limit : 0, max: limit, table: signed ? "signed" : "viridis" });
    }
    return this.drawn.get(key);
  }

  async coloured(image, scale) {
    const look = scale ? this.mode : `${this.exposure}/${this.curve}`;
    const key = `${image.key}/${look}`;
    if (!this.drawn.has(key)) {
      const data = scale ? falseColored(await this.scalarsOf(image), image.width, image.height, scale)
        : toneMapped(await pixelsOf(image), image.width, image.height, this.exposure, this.curve);
      const canvas = document.createElement("canvas");
      canvas.width = image.width;
      canvas.height = image.height;
      canvas.getContext("2d").putImageData(data, 0, 0);
      if (this.drawn.size > 60) this.drawn.clear();
      this.drawn.set(key, canvas);
    }
    return this.drawn.get(key);
  }

  /** Colours what is shown and paints it. */
  async draw() {
    for (const button of this.modes.children) button.setAttribute("aria-pressed", String(button.dataset.mode === this.mode));
    this.exposureText.textContent = `${this.exposure >= 0 ? "+" : ""}${this.exposure} stops`;
    const turn = this.turn = {};
    this.status.textContent = "loading";
    try {
      const scale = await this.sharedScale();
      for (const pane of this.paneList) {
        pane.left = await this.coloured(this.image(pane.key), scale);
        pane.right = pane.other ? await this.coloured(this.image(pane.other), scale) : null;
        if (turn !== this.turn) return;
      }
      this.status.textContent = "";
      this.drawScale(scale);
      this.paint();
      this.showReadout();
    } catch (fault) {
      this.status.textContent = fault.message;
    }
  }

  paint() {
    const { width, height } = this.list[0];
    for (const pane of this.paneList) {
      if (!pane.left) continue;
      const { canvas } = pane;
      const context = canvas.getContext("2d");
      const w = width / this.zoom.scale, h = height / this.zoom.scale;
      const x = this.zoom.x * width - w / 2, y = this.zoom.y * height - h / 2;
      context.imageSmoothingEnabled = this.zoom.scale < 1;
      context.drawImage(pane.left, x, y, w, h, 0, 0, canvas.width, canvas.height);
      if (pane.right) {
        const at = Math.round(this.split * canvas.width);
        context.save();
        context.beginPath();
        context.rect(at, 0, canvas.width - at, canvas.height);
        context.clip();
        context.drawImage(pane.right, x, y, w, h, 0, 0, canvas.width, canvas.height);
        context.restore();
        context.fillStyle = "#fff";
        context.fillRect(at - 1, 0, 2, canvas.height);
      }
    }
  }

  drawScale(scale) {
    const context = this.scaleCanvas.getContext("2d");
    const { width, height } = this.scaleCanvas;
    context.clearRect(0, 0, width, height);
    this.scaleCanvas.hidden = !scale;
    if (!scale) return;
    const table = kTables[scale.table];
    for (let i = 0; i < width - 80; ++i) {
      const c = 3 * Math.round(255 * i / (width - 81));
      context.fillStyle = `rgb(${table[c]},${table[c + 1]},${table[c + 2]})`;
      context.fillRect(40 + i, 22, 1, 16);
    }
    context.fillStyle = themeColor("ink");
    context.font = "13px sans-serif";
    context.textAlign = "center";
    for (let k = 0; k <= 4; ++k) {
      context.fillText(numberText(scale.min + k / 4 * (scale.max - scale.min)), 40 + k / 4 * (width - 80), 56);
    }
    const title = this.layer !== "radiance" ? this.layer
      : (this.mode === "signed" ? "luminance less the reference's" : "|luminance less the reference's|") + " [W/(m\u00b2 sr)], 99 % of all pictures' pixels";
    context.fillText(title, width / 2, 14);
  }

  // ---- pointer and keys ----

  pixelAt(event, canvas) {
    const { width, height } = this.list[0];
    const box = canvas.getBoundingClientRect();
    const u = (event.clientX - box.left) / box.width, v = (event.clientY - box.top) / box.height;
    const x = (this.zoom.x + (u - 0.5) / this.zoom.scale) * width;
    const y = (this.zoom.y + (v - 0.5) / this.zoom.scale) * height;
    const inside = (value, size) => Math.max(0, Math.min(size - 1, Math.floor(value)));
    return { u, v, x: inside(x, width), y: inside(y, height) };
  }

  onDown(event, canvas) {
    canvas.setPointerCapture(event.pointerId);
    const { u } = this.pixelAt(event, canvas);
    this.drag = { x: event.clientX, y: event.clientY, zoom: { ...this.zoom }, slider: this.split !== null && Math.abs(u - this.split) < 0.02 };
  }

  onMove(event, canvas) {
    const at = this.pixelAt(event, canvas);
    if (this.drag && this.drag.slider) {
      this.split = Math.max(0, Math.min(1, at.u));
      this.paint();
    } else if (this.drag && event.buttons) {
      const box = canvas.getBoundingClientRect();
      const { zoom } = this.drag;
      this.setZoom({ scale: zoom.scale, x: zoom.x - (event.clientX - this.drag.x) / box.width / zoom.scale,
        y: zoom.y - (event.clientY - this.drag.y) / box.height / zoom.scale });
    }
    this.cursor = { x: at.x, y: at.y };
    this.showReadout();
  }

  onWheel(event, canvas) {
    if (!event.ctrlKey && document.activeElement !== canvas && this.zoom.scale === 1 && event.deltaY > 0) return;
    event.preventDefault();
    const { u, v } = this.pixelAt(event, canvas);
    const factor = 2 ** (-event.deltaY / 240);
    const scale = Math.max(1, Math.min(64, this.zoom.scale * factor));
    const shift = (1 / this.zoom.scale - 1 / scale);
    this.setZoom({ scale, x: this.zoom.x + (u - 0.5) * shift, y: this.zoom.y + (v - 0.5) * shift });
  }

  onKey(event) {
    const pan = 0.1 / this.zoom.scale;
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.shiftKey && moves[event.key]) {
      const [x, y] = moves[event.key];
      this.setZoom({ ...this.zoom, x: this.zoom.x + x * pan, y: this.zoom.y + y * pan });
    } else if (/^[0-9]$/.test(event.key)) {
      const index = this.layer === "radiance" ? Number(event.key) : Number(event.key) - 1;
      if (this.list[index]) this.select(this.list[index].key);
    } else {
      const actions = {
        ArrowLeft: () => this.step(-1), ArrowRight: () => this.step(1),
        f: () => { if (this.before && this.image(this.before)) this.select(this.before); },
        e: () => this.setMode("error"), s: () => this.setMode("signed"), r: () => this.setMode("radiance"),
        c: () => this.toggleSplit(), g: () => this.toggleGrid(),
        "[": () => this.setExposure(this.exposure - 0.5), "]": () => this.setExposure(this.exposure + 0.5),
        "+": () => this.setZoom({ ...this.zoom, scale: this.zoom.scale * 1.5 }),
        "-": () => this.setZoom({ ...this.zoom, scale: this.zoom.scale / 1.5 }),
        h: () => this.setZoom({ scale: 1, x: 0.5, y: 0.5 }),
      };
      const action = actions[event.key] ?? actions[event.key.toLowerCase()];
      if (!action) return;
      action();
    }
    event.preventDefault();
  }

  // ---- values under the pointer ----

  async showReadout() {
    const { width, height } = this.list[0];
    const at = this.cursor ?? { x: Math.floor(width / 2), y: Math.floor(height / 2) };
    const index = at.y * width + at.x;
    const n = width * height;
    const shown = this.list.filter((image) => loadedPixels.has(image.key));
    const values = await Promise.all(shown.map((image) => pixelsOf(image).catch(() => null)));
    const isRadiance = this.layer === "radiance";
    const body = element("tbody");
    let reference = null;
    shown.forEach((image, i) => {
      if (!values[i]) return;
      const pixel = isRadiance ? [0, 1, 2].map((c) => values[i][c * n + index]) : [values[i][index]];
      if (!image.label) reference = pixel;
      const line = element("tr", { "data-key": image.key }, element("th", { class: "text", scope: "row" }, this.title(image)));
      for (const value of pixel) line.append(element("td", { "data-value": String(value), title: String(value) }, String(Number(value.toPrecision(4)))));
      if (isRadiance) {
        const brightness = (p) => 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
        const relative = reference && image.label ? brightness(pixel) / brightness(reference) - 1 : null;
        line.append(element("td", {}, relative === null ? "" : percentText(relative)));
      }
      body.append(line);
    });
    const names = isRadiance ? ["R", "G", "B", "to ref."] : [this.layer];
    const head = element("tr", {}, element("th", { class: "text", scope: "col" }, "Picture"), ...names.map((name) => element("th", { scope: "col" }, name)));
    const image = this.image(this.key);
    this.readout.replaceChildren(
      element("p", {}, element("strong", { id: "pixel" }, `Pixel ${at.x}, ${at.y}`)),
      element("div", { class: "scroll" }, element("table", {}, element("thead", {}, head), body)),
      ...(image && image.run_id ? [element("p", {}, "Every sample of this pixel, ", this.title(image), ":"),
        element("p", {}, element("code", { class: "command" }, replayCommand(image.run_id, at.x, at.y)))] : []));
  }
}

function fillImages() {
  const place = section("images");
  if (!report.images.length) {
    place.append(element("p", {}, "There are no pictures in this folder (images/*.exr)."));
    return;
  }
  const viewer = new Viewer(place);
  themeListeners.push(() => viewer.draw());
  const follow = (scene) => { if (scene !== null && viewer.list[0].scene !== scene && report.images.some((i) => i.scene === scene)) viewer.setScene(scene); };
  sceneListeners.push(follow);
  follow(sceneOfAddress());
}
