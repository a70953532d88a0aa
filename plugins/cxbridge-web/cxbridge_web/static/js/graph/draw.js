// A state machine as a drawing.
import { el, note, svg } from "cx/dom.js";
import { DotError, parseDot } from "cx/graph/dot.js";
import { layered } from "cx/graph/layout.js";

const LETTER = 7.3,
  SMALL = 6.4,
  LINE = 14,
  MARGIN = 26,
  HEIGHT = 34,
  MOST_LABEL = 40;
// the colours of Fawkes' machine graphs: ends, the way that was taken, what has no writer or reader
const ENDS = { "#6fdd6f": "final", "#ff8080": "failed" },
  TAKEN = "#ff8000",
  WAY = [TAKEN, "#ffc080"],
  ALONE = ["red", "purple"],
  ICONS = { final: "✓ ", failed: "✗ " };
let drawings = 0;

const shorten = (text) => (text.length > MOST_LABEL ? text.slice(0, MOST_LABEL - 1) + "…" : text);
const plain = (label = "") => label.replace(/\\[nlr]/g, " ");
const classes = (...names) => names.filter(Boolean).join(" ");

/**
 * @param only nodes with this text in their names, and what they are connected with; "": all
 * @param empty what to tell when there are no nodes
 * @param href(name) where a node leads to; "": nowhere
 * @returns an element: the drawing, or the text with the reason why there is none
 */
export function drawGraph(text, label, { only = "", empty = "The graph is empty.", href = () => "" } = {}) {
  let graph;
  try {
    graph = parseDot(text);
  } catch (error) {
    if (!(error instanceof DotError)) throw error;
    return el.div(note(error.message), el.pre(text));
  }
  if (only) keepNear(graph, only);
  const nodes = [...graph.nodes.values()].map(nodeOf),
    edges = merge(graph.edges),
    isWide = graph.attributes.rankdir === "LR";
  if (!nodes.length) return note(only ? "Nothing matches" : empty);
  const result = isWide ? sideways(nodes, edges) : layered(nodes, edges),
    loops = edges.filter((edge) => edge.from === edge.to),
    width = result.width + 2 * MARGIN + Math.max(0, ...loops.map((edge) => edge.width + 30)),
    height = result.height + 2 * MARGIN,
    id = "arrow" + ++drawings;
  const about = {
    viewBox: `${-MARGIN} ${-MARGIN} ${width} ${height}`,
    width,
    height,
    role: nodes.some((node) => href(node.name)) ? "group" : "img",
    "aria-label": label,
  };
  const picture = svg(
    "svg.graph",
    about,
    svg.title(label),
    svg.defs(["", "-taken"].map((kind) => arrow(id, kind))),
    edges.map((edge, at) => edgeLine(edge, result.edges[at].path, id, isWide)),
    edges.map((edge, at) => edgeLabels(edge, result.edges[at].label)),
    nodes.map((node) => state(node, result.nodes.get(node.name), href(node.name))),
  );
  const box = { tabindex: 0, role: "group", "aria-label": label };
  return el("div.graph-box", box, picture, words(nodes, edges));
}

function nodeOf({ name, label, shape = "", color, active }) {
  const text = plain(label),
    byName = name.startsWith("FINAL") ? "final" : name.startsWith("FAILED") ? "failed" : "",
    end = shape.startsWith("double") ? ENDS[color] || byName : "",
    kind = ALONE.includes(color) ? "alone" : shape === "octagon" ? "owner" : end,
    width = Math.max(64, shorten(text).length * LETTER + 28);
  return {
    ...{ name, label: text, width, height: HEIGHT, kind },
    isActive: active === "true",
    isWay: WAY.includes(color),
  };
}
const arrow = (id, kind) =>
  svg.marker(
    {
      ...{ id: id + kind, class: "arrow" + kind, viewBox: "0 0 10 10", refX: 9, refY: 5 },
      ...{ markerWidth: 8, markerHeight: 8, orient: "auto-start-reverse" },
    },
    svg.path({ d: "M0 1L10 5L0 9z" }),
  );
const edgeLine = ({ from, to, taken, style }, path, id, isWide) =>
  svg.path({
    class: classes("edge", taken && "taken", /dotted|dashed/.test(style) && "dotted"),
    d: curve(path, from === to, isWide),
    "marker-end": `url(#${id}${taken ? "-taken" : ""})`,
  });
const edgeLabels = ({ labels, taken }, { x, y }) =>
  labels.map((line, at) => {
    const place = { x, y: y + (at - (labels.length - 1) / 2) * LINE + 4 };
    return svg.text(
      { class: classes("edge-label", taken && "taken"), ...place },
      svg.title(line),
      shorten(line),
    );
  });
function state({ label, width, height, kind, isActive, isWay }, { x, y }, href) {
  const rect = (inset, more) =>
    svg.rect({
      ...{ x: x - width / 2 + inset, y: y - height / 2 + inset, rx: 9 - inset },
      ...{ width: width - 2 * inset, height: height - 2 * inset, ...more },
    });
  const drawn = svg.g(
    { class: classes("node", kind, isActive && "active", isWay && "way") },
    svg.title(label + (isActive ? " (active)" : "")),
    rect(0),
    kind in ICONS && rect(3, { class: "inner" }),
    svg.text({ x, y: y + 4.5 }, (ICONS[kind] || (isActive ? "▶ " : "")) + shorten(label)),
  );
  return href ? svg.a({ href, "aria-label": label }, drawn) : drawn;
}

/** Keep the nodes with the text in their names, and their neighbours. */
function keepNear(graph, text) {
  const found = new Set([...graph.nodes.keys()].filter((name) => name.toLowerCase().includes(text)));
  graph.edges = graph.edges.filter(({ from, to }) => found.has(from) || found.has(to));
  const near = new Set([...found, ...graph.edges.flatMap(({ from, to }) => [from, to])]);
  graph.nodes = new Map([...graph.nodes].filter(([name]) => near.has(name)));
}

/** The layout from left to right: the one from the top, turned. */
function sideways(nodes, edges) {
  const turned = (each) => ({ ...each, width: each.height, height: each.width }),
    turn = (point) => ({ x: point.y, y: point.x }),
    { width, height, ...result } = layered(nodes.map(turned), edges.map(turned));
  return {
    width: height,
    height: width,
    nodes: new Map([...result.nodes].map(([name, node]) => [name, turn(node)])),
    edges: result.edges.map(({ path, label }) => ({ path: path.map(turn), label: turn(label) })),
  };
}

/** Edges between the same nodes are one line with several labels. */
function merge(edges) {
  return [...Map.groupBy(edges, ({ from, to }) => from + "\n" + to).values()].map((same) => {
    const labels = same
      .map(({ taillabel, label }) => [taillabel, plain(label)].filter(Boolean).join(": "))
      .filter(Boolean);
    return {
      ...same[0],
      labels,
      taken: same.some(({ taillabel, color }) => taillabel || color === TAKEN),
      width: Math.max(0, ...labels.map((line) => shorten(line).length * SMALL)),
      height: labels.length * LINE,
    };
  });
}

function curve([first, ...rest], isLoop, isWide) {
  const at = ({ x, y }) => x + " " + y,
    middle = (a, b, key) => (a[key] + b[key]) / 2;
  if (isLoop) return "M" + at(first) + "C" + rest.map(at).join(" ");
  let path = "M" + at(first),
    last = first;
  for (const point of rest) {
    const bends = isWide
      ? [last, point].map(({ y }) => ({ x: middle(last, point, "x"), y }))
      : [last, point].map(({ x }) => ({ x, y: middle(last, point, "y") }));
    path += "C" + [...bends, point].map(at).join(" ");
    last = point;
  }
  return path;
}

/** The graph in words, for screen readers. */
function words(nodes, edges) {
  const name = new Map(nodes.map((node) => [node.name, node.label])),
    active = nodes.filter((node) => node.isActive).map(({ label }) => "active: " + label);
  const ways = edges.map(({ from, to, labels, taken }) => {
    const told = labels.length ? ": " + labels.join("; ") : "";
    return name.get(from) + " to " + name.get(to) + told + (taken ? " (taken)" : "");
  });
  return el(
    "ul.hear-only",
    [...active, ...ways].map((text) => el.li(text)),
  );
}
