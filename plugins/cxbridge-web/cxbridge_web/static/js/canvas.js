// A canvas that fills its box on screens of any density, drawn once a frame, in the page's colours.
import { el } from "cx/dom.js";

export const SERIES_COLOURS = 8;
const FONT = "12px system-ui, sans-serif";

/** Round steps for a grid: 1, 2 or 5 times a power of ten, about `count` of them. */
export function niceStep(span, count) {
  const rough = span / Math.max(1, count);
  if (!(rough > 0) || !Number.isFinite(rough)) return 1;
  const power = 10 ** Math.floor(Math.log10(rough)),
    times = rough / power;
  return power * (times < 1.5 ? 1 : times < 3.5 ? 2 : times < 7.5 ? 5 : 10);
}

/** The colours of the page as they are now. */
export function palette(node = document.documentElement) {
  const style = getComputedStyle(node),
    of = (name) => style.getPropertyValue(name).trim();
  return {
    text: of("--text"),
    dim: of("--dim"),
    line: of("--line"),
    back: of("--card") || of("--back"),
    focus: of("--focus"),
    panel: of("--panel"),
    series: Array.from({ length: SERIES_COLOURS }, (_, at) => of("--series-" + (at + 1))),
  };
}

export class Canvas {
  /** @param paint(context, width, height, colours) draws all of it */
  constructor(paint) {
    this.paint = paint;
    this.node = el.canvas({ "aria-hidden": "true" });
    this.context = this.node.getContext("2d");
    this.frame = 0;
    this.sizes = new ResizeObserver(() => this.later());
    this.sizes.observe(this.node);
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.changed = () => this.later();
    this.dark.addEventListener("change", this.changed);
    this.looks = new MutationObserver(this.changed); // the page's own switch for light and dark
    this.looks.observe(document.documentElement, { attributes: true });
  }

  get width() {
    return this.node.clientWidth;
  }
  get height() {
    return this.node.clientHeight;
  }

  later() {
    this.frame ||= requestAnimationFrame(() => {
      this.frame = 0;
      this.draw();
    });
  }

  draw() {
    const { width, height } = this,
      density = window.devicePixelRatio || 1;
    if (!width || !height) return;
    const wide = Math.round(width * density),
      high = Math.round(height * density);
    if (this.node.width !== wide) this.node.width = wide;
    if (this.node.height !== high) this.node.height = high;
    this.context.setTransform(density, 0, 0, density, 0, 0);
    this.context.font = FONT;
    this.paint(this.context, width, height, palette());
  }

  /** The drawing as a picture, with lines of text above it. Returns a promise of a blob. */
  picture(lines = []) {
    const { width, height } = this,
      density = 2,
      above = lines.length * 18 + (lines.length ? 10 : 0),
      copy = el.canvas({ width: width * density, height: (height + above) * density }),
      context = copy.getContext("2d"),
      colours = palette();
    context.scale(density, density);
    context.fillStyle = colours.back;
    context.fillRect(0, 0, width, height + above);
    context.font = FONT;
    lines.forEach(({ text, colour }, at) => {
      context.fillStyle = colour || colours.text;
      context.fillText(text, 10, 18 * (at + 1), width - 20);
    });
    context.translate(0, above);
    this.paint(context, width, height, colours);
    return new Promise((done) => {
      copy.toBlob(done, "image/png");
    });
  }

  gone() {
    cancelAnimationFrame(this.frame);
    this.sizes.disconnect();
    this.looks.disconnect();
    this.dark.removeEventListener("change", this.changed);
  }
}

/** Let the browser save something under a name. */
export function save(blob, name) {
  const url = URL.createObjectURL(blob),
    link = el.a({ href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
