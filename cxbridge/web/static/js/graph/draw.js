// A state machine as a drawing.
import { el, svg } from "../dom.js";
import { DotError, parseDot } from "./dot.js";
import { layered } from "./layout.js";

const LETTER = 7.3, SMALL = 6.4, LINE = 14, MARGIN = 26, MOST_LABEL = 34;
const ENDS = { "#6fdd6f": "final", "#ff8080": "failed" };
let drawings = 0;

const shorten = (text) => (text.length > MOST_LABEL ? text.slice(0, MOST_LABEL - 1) + "…" : text);
const plain = (label) => label.replace(/\\[nlr]/g, " ");

/** @returns an element: the drawing, or the text with the reason why there is none. */
export function drawGraph(text, label) {
  let graph;
  try {
    graph = parseDot(text);
  } catch (error) {
    if (!(error instanceof DotError)) throw error;
    return el("div", {}, el("p", { class: "dim" }, error.message), el("pre", {}, text));
  }
  const nodes = [...graph.nodes.values()].map((node) => ({ ...node, label: plain(node.label) }));
  if (!nodes.length) return el("p", { class: "dim" }, "The graph is empty.");
  for (const node of nodes) {
    node.width = Math.max(64, shorten(node.label).length * LETTER + 28);
    node.height = 34;
    node.kind = (node.shape || "").startsWith("double") ? ENDS[node.color] || (node.name.startsWith("FINAL") ? "final" : node.name.startsWith("FAILED") ? "failed" : "") : "";
    node.way = node.color === "#ff8000" || node.color === "#ffc080";
  }
  const edges = merge(graph.edges), loops = edges.filter((edge) => edge.from === edge.to);
  const result = layered(nodes, edges);
  const width = result.width + 2 * MARGIN + Math.max(0, ...loops.map((edge) => edge.width + 30)), height = result.height + 2 * MARGIN, id = "arrow" + ++drawings;
  const picture = svg("svg", { class: "graph", viewBox: `${-MARGIN} ${-MARGIN} ${width} ${height}`, width, height, role: "img", "aria-label": label },
    svg("title", {}, label),
    svg("defs", {}, ["", "-taken"].map((kind) => svg("marker", { id: id + kind, viewBox: "0 0 10 10", refX: 9, refY: 5, markerWidth: 8, markerHeight: 8, orient: "auto-start-reverse", class: "arrow" + kind },
      svg("path", { d: "M0 1L10 5L0 9z" })))));
  edges.forEach((edge, number) => {
    const { path } = result.edges[number];
    picture.append(svg("path", { class: "edge" + (edge.taken ? " taken" : "") + (edge.style === "dotted" ? " dotted" : ""), d: curve(path, edge.from === edge.to), "marker-end": `url(#${id}${edge.taken ? "-taken" : ""})` }));
  });
  edges.forEach((edge, number) => {
    const { label: middle } = result.edges[number];
    edge.labels.forEach((line, at) => {
      const y = middle.y + (at - (edge.labels.length - 1) / 2) * LINE;
      picture.append(svg("text", { class: "edge-label" + (edge.taken ? " taken" : ""), x: middle.x, y: y + 4 }, svg("title", {}, line), shorten(line)));
    });
  });
  for (const node of nodes) {
    const { x, y } = result.nodes.get(node.name);
    const state = svg("g", { class: "node " + node.kind + (node.active === "true" ? " active" : "") + (node.way ? " way" : "") },
      svg("title", {}, node.label + (node.active === "true" ? " (active)" : "")),
      svg("rect", { x: x - node.width / 2, y: y - node.height / 2, width: node.width, height: node.height, rx: 9 }));
    if (node.kind) state.append(svg("rect", { class: "inner", x: x - node.width / 2 + 3, y: y - node.height / 2 + 3, width: node.width - 6, height: node.height - 6, rx: 6 }));
    state.append(svg("text", { x, y: y + 4.5 }, (node.kind === "final" ? "✓ " : node.kind === "failed" ? "✗ " : node.active === "true" ? "▶ " : "") + shorten(node.label)));
    picture.append(state);
  }
  return el("div", { class: "graph-box", tabindex: 0, role: "group", "aria-label": label }, picture, words(nodes, edges));
}

/** Edges between the same nodes are one line with several labels. */
function merge(edges) {
  const merged = new Map();
  for (const edge of edges) {
    const key = edge.from + "\n" + edge.to;
    if (!merged.has(key)) merged.set(key, { ...edge, labels: [], taken: false });
    const one = merged.get(key), label = plain(edge.label || "");
    if (label) one.labels.push((edge.taillabel ? edge.taillabel + ": " : "") + label);
    else if (edge.taillabel) one.labels.push(edge.taillabel);
    if (edge.taillabel || edge.color === "#ff8000") one.taken = true;
  }
  for (const one of merged.values()) {
    one.width = Math.max(0, ...one.labels.map((line) => shorten(line).length * SMALL));
    one.height = one.labels.length * LINE;
  }
  return [...merged.values()];
}

function curve(points, isLoop) {
  const [first, ...rest] = points;
  let path = `M${first.x} ${first.y}`, last = first;
  if (isLoop) return path + `C${points[1].x} ${points[1].y} ${points[2].x} ${points[2].y} ${points[3].x} ${points[3].y}`;
  for (const point of rest) {
    const half = (last.y + point.y) / 2;
    path += `C${last.x} ${half} ${point.x} ${half} ${point.x} ${point.y}`;
    last = point;
  }
  return path;
}

/** The same in words, for those who do not see it. */
function words(nodes, edges) {
  const name = new Map(nodes.map((node) => [node.name, node.label]));
  return el("ul", { class: "hear-only" }, nodes.filter((node) => node.active === "true").map((node) => el("li", {}, "active: " + node.label)),
    edges.map((edge) => el("li", {}, name.get(edge.from) + " to " + name.get(edge.to) + (edge.labels.length ? ": " + edge.labels.join("; ") : "") + (edge.taken ? " (taken)" : ""))));
}
