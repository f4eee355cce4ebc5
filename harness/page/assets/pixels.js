// Pixels: loading them from the scripts beside the page, and turning them into colours.

const packedPixels = new Map();  // key -> base64, as scripts bring it
const loadedPixels = new Map();  // key -> promise of Float32Array, channel after channel

/** Called by the scripts of report_files/ and by embedded ones. */
function penumbraPixels(key, base64) {
  packedPixels.set(key, base64);
}

function loadScript(source) {
  return new Promise((resolve, reject) => {
    document.head.append(element("script", { src: source, onload: resolve,
      onerror: () => reject(new Error(`${source} is missing beside the page`)) }));
  });
}

async function unpacked(base64) {
  const packed = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = bytes.length / 4;
  const sorted = new Uint8Array(bytes.length);
  for (let b = 0; b < 4; ++b) {
    for (let i = 0; i < count; ++i) sorted[4 * i + b] = bytes[b * count + i];
  }
  return new Float32Array(sorted.buffer);
}

/** The pixels of a picture, loaded when first asked for. */
function pixelsOf(image) {
  if (!loadedPixels.has(image.key)) {
    loadedPixels.set(image.key, (async () => {
      if (!packedPixels.has(image.key)) await loadScript(image.script);
      const values = await unpacked(packedPixels.get(image.key));
      packedPixels.delete(image.key);
      return values;
    })());
  }
  return loadedPixels.get(image.key);
}

function luminance(values, n, i) {
  return 0.2126 * values[i] + 0.7152 * values[n + i] + 0.0722 * values[2 * n + i];
}

// Tables of 256 colours from a few control points. Viridis: van der Walt and Smith, public domain.
const kViridis = [[68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142], [31, 158, 137], [53, 183, 121],
  [110, 206, 88], [181, 222, 43], [253, 231, 37]];
const kBlueWhiteRed = [[5, 48, 97], [67, 147, 195], [247, 247, 247], [214, 96, 77], [103, 0, 31]];

function colorTable(stops) {
  const table = new Uint8ClampedArray(256 * 3);
  for (let i = 0; i < 256; ++i) {
    const at = i / 255 * (stops.length - 1);
    const low = Math.min(Math.floor(at), stops.length - 2);
    for (let c = 0; c < 3; ++c) table[3 * i + c] = stops[low][c] + (at - low) * (stops[low + 1][c] - stops[low][c]);
  }
  return table;
}
const kTables = { viridis: colorTable(kViridis), signed: colorTable(kBlueWhiteRed) };

function srgb(linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055;
}

// Curves map exposed radiance to [0, 1]; each is followed by the sRGB transfer function.
const kToneCurves = {
  "clip at 1": (v) => Math.min(v, 1),
  "Reinhard": (v) => v / (1 + v),
  "logarithm": (v) => Math.min(1, Math.log2(1 + 255 * v) / 8),
};

const kNotFinite = [255, 0, 255];

function putColor(data, i, r, g, b) {
  data[4 * i] = r;
  data[4 * i + 1] = g;
  data[4 * i + 2] = b;
  data[4 * i + 3] = 255;
}

function toneMapped(values, width, height, stops, curve) {
  const image = new ImageData(width, height);
  const n = width * height;
  const gain = 2 ** stops;
  const tone = kToneCurves[curve];
  for (let i = 0; i < n; ++i) {
    const rgb = [values[i], values[n + i], values[2 * n + i]];
    if (!rgb.every(Number.isFinite)) putColor(image.data, i, ...kNotFinite);
    else putColor(image.data, i, ...rgb.map((v) => 255 * srgb(tone(Math.max(0, v * gain)))));
  }
  return image;
}

/** @param scale  {min, max, table} */
function falseColored(scalars, width, height, scale) {
  const image = new ImageData(width, height);
  const table = kTables[scale.table];
  for (let i = 0; i < scalars.length; ++i) {
    if (!Number.isFinite(scalars[i])) { putColor(image.data, i, ...kNotFinite); continue; }
    const t = Math.max(0, Math.min(1, (scalars[i] - scale.min) / (scale.max - scale.min)));
    const c = 3 * Math.round(255 * t);
    putColor(image.data, i, table[c], table[c + 1], table[c + 2]);
  }
  return image;
}

/** Luminance of a picture less the reference's. */
function signedError(values, reference, n) {
  const error = new Float32Array(n);
  for (let i = 0; i < n; ++i) error[i] = luminance(values, n, i) - luminance(reference, n, i);
  return error;
}

/** The value that a share of all finite |values| do not exceed. */
function quantileOfSize(arrays, share) {
  const sizes = [];
  for (const values of arrays) {
    const step = Math.max(1, Math.floor(values.length / 50000));
    for (let i = 0; i < values.length; i += step) if (Number.isFinite(values[i])) sizes.push(Math.abs(values[i]));
  }
  if (!sizes.length) return 1;
  sizes.sort((a, b) => a - b);
  return sizes[Math.min(sizes.length - 1, Math.floor(share * sizes.length))] || sizes.at(-1) || 1;
}
