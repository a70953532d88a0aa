// What changed from one drawing of a state graph to the next: a dot goes along the transition, the state
// that is active now lights up. Nothing moves for those who want less motion.

const WAY_MS = 450,
  LIGHT_MS = 700,
  MOST_KNOWN = 50;
const known = new Map(); // the states of a graph -> those that were active when it was drawn last
const NAMESPACE = "http://www.w3.org/2000/svg";

/** The edges by which the active states were reached: from those that were active, else those just taken. */
function ways(edges, before, now) {
  const fresh = now.filter((name) => !before.includes(name)),
    into = edges.filter((edge) => !fresh.includes(edge.from) && fresh.includes(edge.to));
  const direct = into.filter((edge) => before.includes(edge.from));
  return { fresh, way: direct.length ? direct : into.filter((edge) => edge.taken) };
}

/**
 * Compare a drawing with the last one of the same states.
 * @param shapes.nodes, shapes.edges elements by the state's name, and by the edge's number
 */
export function animate(picture, nodes, edges, shapes) {
  const states = nodes.map((node) => node.name).join("\n"),
    now = nodes.filter((node) => node.active === "true").map((node) => node.name),
    before = known.get(states);
  known.delete(states);
  known.set(states, now);
  if (known.size > MOST_KNOWN) known.delete(known.keys().next().value);
  if (!before || matchMedia("(prefers-reduced-motion: reduce)").matches) return;
  const { fresh, way } = ways(edges, before, now);
  for (const edge of way) travel(picture, shapes.edges[edges.indexOf(edge)]);
  for (const name of fresh) {
    const timing = { duration: LIGHT_MS, delay: way.length ? WAY_MS : 0, easing: "ease-out" };
    shapes.nodes
      .get(name)
      .querySelector("rect")
      .animate([{ strokeWidth: "10px" }, { strokeWidth: "2.4px" }], timing);
  }
}

/** A dot goes along a path. */
function travel(picture, path) {
  const dot = document.createElementNS(NAMESPACE, "circle");
  dot.setAttribute("r", "6");
  dot.setAttribute("class", "traveller");
  dot.style.offsetPath = 'path("' + path.getAttribute("d") + '")';
  picture.append(dot);
  const going = dot.animate([{ offsetDistance: "0%" }, { offsetDistance: "100%" }], {
    duration: WAY_MS,
    easing: "ease-in-out",
    fill: "both",
  });
  going.addEventListener("finish", () => dot.remove());
}
