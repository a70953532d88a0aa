// The timeline on paper: pictures of all rows, below each other, in the colours of paper.
import { el } from "cx/dom.js";
import { AXIS, Painter } from "cx/timeline/paint.js";
import { palette } from "cx/timeline/texture.js";
import { TimeWindow } from "cx/timeline/window.js";

const WIDTH = 1000, // pixels of the picture; the paper scales it
  NAMES = 260,
  HIGH = 24,
  ROWS = 40, // of a picture: it is not torn apart
  MOST = 1000,
  RATIO = 2;

/** From now on, `timeline` prints. Returns what ends that. */
export function printsTimeline(timeline) {
  const box = el("div", { class: "tl-paper", hidden: true });
  timeline.box.append(box);
  const before = () => {
    const rows = timeline.items.slice(0, MOST),
      colours = palette(box, RATIO);
    box.hidden = false;
    const pictures = [];
    for (let at = 0; at < rows.length; at += ROWS)
      pictures.push(picture(timeline, rows.slice(at, at + ROWS), colours));
    const rest = timeline.items.length - rows.length;
    box.replaceChildren(
      ...pictures,
      rest > 0 ? el("p", {}, "The first " + MOST + " of " + timeline.items.length + " rows.") : "",
    );
  };
  const after = () => {
    box.replaceChildren();
    box.hidden = true;
  };
  window.addEventListener("beforeprint", before);
  window.addEventListener("afterprint", after);
  return () => {
    window.removeEventListener("beforeprint", before);
    window.removeEventListener("afterprint", after);
  };
}

function picture(timeline, rows, colours) {
  const canvas = el("canvas", {}),
    height = AXIS + rows.length * HIGH,
    { window: screen } = timeline;
  canvas.width = WIDTH * RATIO;
  canvas.height = height * RATIO;
  canvas.style.aspectRatio = WIDTH + " / " + height;
  const context = canvas.getContext("2d");
  context.scale(RATIO, RATIO);
  const paper = new TimeWindow(screen.range);
  Object.assign(paper, { axis: screen.axis, from: screen.from, to: screen.to, width: WIDTH - NAMES });
  const painter = new Painter(context, {
    ...timeline.scene,
    window: paper,
    palette: colours,
    high: HIGH,
    selected: "",
  });
  context.translate(NAMES, 0);
  painter.axis(height);
  context.save();
  context.beginPath();
  context.rect(0, 0, WIDTH - NAMES, height);
  context.clip();
  for (const [at, row] of rows.entries()) painter.row(row, AXIS + at * HIGH);
  context.restore();
  context.translate(-NAMES, 0);
  context.fillStyle = colours.text;
  context.beginPath();
  context.rect(0, 0, NAMES - 6, height);
  context.clip();
  for (const [at, row] of rows.entries()) {
    const name = row.kind === "action" ? row.item.id + " " + row.item.text : row.name;
    context.fillText(name, 4 + Math.min(row.depth, 12) * 12, AXIS + at * HIGH + HIGH / 2);
  }
  return canvas;
}
