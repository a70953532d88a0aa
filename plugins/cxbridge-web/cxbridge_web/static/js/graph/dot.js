// Reads the part of the dot language that Skillers and the blackboard write: nodes, edges, attributes,
// subgraphs.
const TOKEN = /"((?:\\.|[^"\\])*)"|(->|[{}[\];,=])|([^\s"{}[\];,=]+)/gs;

export class DotError extends Error {}

/**
 * @returns {nodes: Map name -> {name, label, ...attributes}, edges: [{from, to, ...attributes}],
 * attributes}
 */
export function parseDot(text) {
  const tokens = [...text.matchAll(TOKEN)].map((match) =>
    match[2]
      ? { sign: match[2] }
      : { word: match[1] !== undefined ? match[1].replaceAll('\\"', '"') : match[3] },
  );
  let at = 0;
  const graph = { nodes: new Map(), edges: [], attributes: {} };
  let usual = {}; // attributes of nodes to come
  const sign = (wanted) => tokens[at] && tokens[at].sign === wanted && Boolean(++at);
  function word() {
    if (!tokens[at] || tokens[at].word === undefined) throw new DotError("The graph is cut off or is none");
    return tokens[at++].word;
  }
  function attributes() {
    const found = {};
    while (sign("[")) {
      while (!sign("]")) {
        const name = word();
        found[name] = sign("=") ? word() : "true";
        sign(",") || sign(";");
      }
    }
    return found;
  }
  function node(name, more = {}) {
    if (!graph.nodes.has(name)) graph.nodes.set(name, { name, label: name, ...usual });
    Object.assign(graph.nodes.get(name), more);
  }
  /** Where an edge goes to: a node, or several in braces. */
  function ends() {
    if (!sign("{")) return [word()];
    const names = [];
    while (!sign("}")) if (!sign(";") && !sign(",")) names.push(word());
    return names;
  }
  function body() {
    while (!sign("}")) {
      if (sign("{")) {
        body();
        continue;
      }
      const name = word();
      if (name === "subgraph") {
        if (tokens[at] && tokens[at].word !== undefined) at++;
        if (!sign("{")) throw new DotError("The graph is cut off");
        body();
      } else if (sign("=")) graph.attributes[name] = word();
      else if (sign("->")) {
        const path = [[name], ends()];
        while (sign("->")) path.push(ends());
        const more = attributes();
        for (let step = 1; step < path.length; step++) {
          for (const from of path[step - 1]) {
            node(from);
            for (const to of path[step]) {
              node(to);
              graph.edges.push({ ...more, from, to });
            }
          }
        }
      } else {
        const more = attributes();
        if (name === "graph" || name === "node" || name === "edge") {
          if (name === "graph") Object.assign(graph.attributes, more);
          else if (name === "node") usual = { ...usual, ...more };
        } else node(name, more);
      }
      sign(";");
    }
  }
  sign("");
  if (word() !== "digraph") throw new DotError("This is not a graph");
  if (!sign("{")) {
    word();
    if (!sign("{")) throw new DotError("The graph is cut off");
  }
  body();
  return graph;
}
