// A state machine as a drawing.
import { el, svg } from "cx/dom.js";
import { DotError, parseDot } from "cx/graph/dot.js";
import { layered } from "cx/graph/layout.js";

const LETTER = 7.3,
  SMALL = 6.4,
  LINE = 14,
  MARGIN = 26,
  MOST_LABEL = 40;
const ENDS = { "#6fdd6f": "final", "#ff8080": "failed" };
let drawings = 0;

const shorten = (text) => (text.length > MOST_LABEL ? text.slice(0, MOST_LABEL - 1) + "…" : text);
const plain = (label) => label.replace(/\\[nlr]/g, " ");

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
    return el.div(el("p.dim", error.message), el.pre(text));
  }
  if (only) keepNear(graph, only);
  const nodes = [...graph.nodes.values()].map((node) => ({ ...node, label: plain(node.label) })),
    isWide = graph.attributes.rankdir === "LR";
  if (!nodes.length) return el("p.dim", only ? "Nothing matches" : empty);
  for (const node of nodes) {
    node.width = Math.max(64, shorten(node.label).length * LETTER + 28);
    node.height = 34;
    node.kind = (node.shape || "").startsWith("double")
      ? ENDS[node.color] ||
        (node.name.startsWith("FINAL") ? "final" : node.name.startsWith("FAILED") ? "failed" : "")
      : "";
    if (node.color === "red" || node.color === "purple") node.kind = "alone";
    else if (node.shape === "octagon") node.kind = "owner";
    node.way = node.color === "#ff8000" || node.color === "#ffc080";
  }
  const edges = merge(graph.edges),
    loops = edges.filter((edge) => edge.from === edge.to);
  const result = isWide ? sideways(nodes, edges) : layered(nodes, edges);
  const width = result.width + 2 * MARGIN + Math.max(0, ...loops.map((edge) => edge.width + 30)),
    height = result.height + 2 * MARGIN,
    id = "arrow" + ++drawings;
  const picture = svg(
    "svg.graph",
    {
      viewBox: `${-MARGIN} ${-MARGIN} ${width} ${height}`,
      width,
      height,
      role: nodes.some((node) => href(node.name)) ? "group" : "img",
      "aria-label": label,
    },
    svg.title(label),
    svg.defs(
      ["", "-taken"].map((kind) =>
        svg.marker(
          {
            id: id + kind,
            viewBox: "0 0 10 10",
            refX: 9,
            refY: 5,
            markerWidth: 8,
            markerHeight: 8,
            orient: "auto-start-reverse",
            class: "arrow" + kind,
          },
          svg.path({ d: "M0 1L10 5L0 9z" }),
        ),
      ),
    ),
  );
  edges.forEach((edge, number) => {
    const { path } = result.edges[number];
    picture.append(
      svg.path({
        class: "edge" + (edge.taken ? " taken" : "") + (/dotted|dashed/.test(edge.style) ? " dotted" : ""),
        d: curve(path, edge.from === edge.to, isWide),
        "marker-end": `url(#${id}${edge.taken ? "-taken" : ""})`,
      }),
    );
  });
  edges.forEach((edge, number) => {
    const { label: middle } = result.edges[number];
    edge.labels.forEach((line, at) => {
      const y = middle.y + (at - (edge.labels.length - 1) / 2) * LINE;
      picture.append(
        svg.text(
          { class: "edge-label" + (edge.taken ? " taken" : ""), x: middle.x, y: y + 4 },
          svg.title(line),
          shorten(line),
        ),
      );
    });
  });
  for (const node of nodes) {
    const { x, y } = result.nodes.get(node.name);
    const state = svg.g(
      { class: "node " + node.kind + (node.active === "true" ? " active" : "") + (node.way ? " way" : "") },
      svg.title(node.label + (node.active === "true" ? " (active)" : "")),
      svg.rect({
        x: x - node.width / 2,
        y: y - node.height / 2,
        width: node.width,
        height: node.height,
        rx: 9,
      }),
    );
    if (node.kind === "final" || node.kind === "failed")
      state.append(
        svg("rect.inner", {
          x: x - node.width / 2 + 3,
          y: y - node.height / 2 + 3,
          width: node.width - 6,
          height: node.height - 6,
          rx: 6,
        }),
      );
    state.append(
      svg.text(
        { x, y: y + 4.5 },
        (node.kind === "final" ? "✓ " : node.kind === "failed" ? "✗ " : node.active === "true" ? "▶ " : "") +
          shorten(node.label),
      ),
    );
    picture.append(
      href(node.name) ? svg.a({ href: href(node.name), "aria-label": node.label }, state) : state,
    );
  }
  return el(
    "div.graph-box",
    { tabindex: 0, role: "group", "aria-label": label },
    picture,
    words(nodes, edges),
  );
}

/** Leave what has the text in its name, and its neighbours. */
function keepNear(graph, text) {
  const found = new Set([...graph.nodes.keys()].filter((name) => name.toLowerCase().includes(text))),
    near = new Set(found);
  graph.edges = graph.edges.filter((edge) => found.has(edge.from) || found.has(edge.to));
  for (const edge of graph.edges) {
    near.add(edge.from);
    near.add(edge.to);
  }
  for (const name of graph.nodes.keys()) if (!near.has(name)) graph.nodes.delete(name);
}

/** The layout from left to right: the one from the top, turned. */
function sideways(nodes, edges) {
  const turned = (each) => ({ ...each, width: each.height, height: each.width }),
    turn = (point) => ({ x: point.y, y: point.x });
  const result = layered(nodes.map(turned), edges.map(turned));
  return {
    width: result.height,
    height: result.width,
    nodes: new Map([...result.nodes].map(([name, node]) => [name, turn(node)])),
    edges: result.edges.map(({ path, label }) => ({ path: path.map(turn), label: turn(label) })),
  };
}

/** Edges between the same nodes are one line with several labels. */
function merge(edges) {
  const merged = new Map();
  for (const edge of edges) {
    const key = edge.from + "\n" + edge.to;
    if (!merged.has(key)) merged.set(key, { ...edge, labels: [], taken: false });
    const one = merged.get(key),
      label = plain(edge.label || "");
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

function curve(points, isLoop, isWide) {
  const [first, ...rest] = points;
  let path = `M${first.x} ${first.y}`,
    last = first;
  if (isLoop)
    return (
      path + `C${points[1].x} ${points[1].y} ${points[2].x} ${points[2].y} ${points[3].x} ${points[3].y}`
    );
  for (const point of rest) {
    if (isWide) {
      const half = (last.x + point.x) / 2;
      path += `C${half} ${last.y} ${half} ${point.y} ${point.x} ${point.y}`;
    } else {
      const half = (last.y + point.y) / 2;
      path += `C${last.x} ${half} ${point.x} ${half} ${point.x} ${point.y}`;
    }
    last = point;
  }
  return path;
}

/** The same in words, for those who do not see it. */
function words(nodes, edges) {
  const name = new Map(nodes.map((node) => [node.name, node.label]));
  return el(
    "ul.hear-only",
    nodes.filter((node) => node.active === "true").map((node) => el.li("active: " + node.label)),
    edges.map((edge) =>
      el.li(
        name.get(edge.from) +
          " to " +
          name.get(edge.to) +
          (edge.labels.length ? ": " + edge.labels.join("; ") : "") +
          (edge.taken ? " (taken)" : ""),
      ),
    ),
  );
}
