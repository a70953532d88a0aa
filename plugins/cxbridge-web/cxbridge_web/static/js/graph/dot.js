// Reads the part of the dot language that Skillers and the blackboard write: nodes, edges, attributes,
// subgraphs.
const TOKEN = /"((?:\\.|[^"\\])*)"|(->|[{}[\];,=])|([^\s"{}[\];,=]+)/gs;

export class DotError extends Error {}

class Tokens {
  at = 0;
  constructor(text) {
    this.all = [...text.matchAll(TOKEN)].map(([, quoted, sign, plain]) =>
      sign ? { sign } : { word: quoted?.replaceAll('\\"', '"') ?? plain },
    );
  }
  /** Pass over one of these signs. Returns whether it was next. */
  sign(...wanted) {
    const isNext = wanted.includes(this.all[this.at]?.sign ?? "");
    if (isNext) this.at += 1;
    return isNext;
  }
  get isWord() {
    return this.all[this.at]?.word !== undefined;
  }
  word() {
    if (!this.isWord) throw new DotError("The graph is cut off or is none");
    return this.all[this.at++].word;
  }
  begin() {
    if (this.isWord) this.word(); // the name of a graph
    if (!this.sign("{")) throw new DotError("The graph is cut off");
  }
  attributes() {
    const found = {};
    while (this.sign("["))
      while (!this.sign("]")) {
        const name = this.word();
        found[name] = this.sign("=") ? this.word() : "true";
        this.sign(",", ";");
      }
    return found;
  }
  ends() {
    if (!this.sign("{")) return [this.word()];
    const names = [];
    while (!this.sign("}")) if (!this.sign(";", ",")) names.push(this.word());
    return names;
  }
}

/**
 * @returns {nodes: Map name -> {name, label, ...attributes}, edges: [{from, to, ...attributes}], attributes}
 */
export function parseDot(text) {
  const tokens = new Tokens(text),
    graph = { nodes: new Map(), edges: [], attributes: {} },
    usual = {}, // attributes of nodes to come
    attributed = new Map(Object.entries({ graph: graph.attributes, node: usual, edge: {} }));
  function node(name, more = {}) {
    if (!graph.nodes.has(name)) graph.nodes.set(name, { name, label: name, ...usual });
    Object.assign(graph.nodes.get(name), more);
  }
  function edges(path) {
    const more = tokens.attributes();
    path.flat().forEach((name) => node(name));
    for (const [at, heads] of path.slice(1).entries())
      for (const from of path[at]) graph.edges.push(...heads.map((to) => ({ ...more, from, to })));
  }
  function statement() {
    const name = tokens.word();
    if (name === "subgraph") {
      tokens.begin();
      body();
    } else if (tokens.sign("=")) graph.attributes[name] = tokens.word();
    else if (tokens.sign("->")) {
      const path = [[name], tokens.ends()];
      while (tokens.sign("->")) path.push(tokens.ends());
      edges(path);
    } else {
      const more = tokens.attributes(),
        target = attributed.get(name);
      if (target) Object.assign(target, more);
      else node(name, more);
    }
  }
  function body() {
    while (!tokens.sign("}")) {
      if (tokens.sign("{")) body();
      else statement();
      tokens.sign(";");
    }
  }
  if (tokens.word() !== "digraph") throw new DotError("This is not a graph");
  tokens.begin();
  body();
  return graph;
}
