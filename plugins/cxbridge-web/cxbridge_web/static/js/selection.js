// What all views look at together: the chosen goal, action and skill, the moment, the environment. The address
// holds it, so that a link shows the same to somebody else.

/** The names of what can be selected. `time`: microseconds since the epoch, null: now. */
const NOTHING = { goal: "", action: "", skill: "", time: null, env: "" };
const NAMES = Object.keys(NOTHING);
const WRITE_MS = 300; // browsers refuse addresses that change too often

const decode = (text) => {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
};

/** An address `#/view/part?name=value` taken apart. */
export function parseAddress(hash) {
  const at = hash.indexOf("?"),
    path = at < 0 ? hash : hash.slice(0, at);
  return {
    path,
    parts: path.slice(2).split("/").map(decode),
    query: new URLSearchParams(at < 0 ? "" : hash.slice(at + 1)),
  };
}

export class Selection {
  /** @param target gets an event `select` with each change; its detail has `changed`: names */
  constructor(target) {
    this.target = target;
    this.value = { ...NOTHING };
    this.timer = null;
  }

  /** Take over what is given; the rest stays. An action and a skill belong to their goal. */
  merge(given) {
    const next = { ...this.value, ...given };
    if ("goal" in given && given.goal !== this.value.goal)
      for (const name of ["action", "skill"]) if (!(name in given)) next[name] = NOTHING[name];
    const changed = NAMES.filter((name) => next[name] !== this.value[name]);
    if (!changed.length) return;
    this.value = Object.fromEntries(NAMES.map((name) => [name, next[name] ?? NOTHING[name]]));
    this.timer ??= setTimeout(() => this.write(), WRITE_MS);
    this.target.dispatchEvent(new CustomEvent("select", { detail: { changed, ...this.value } }));
  }

  /** Write it into the address, without a step in the history. What the path says is not said again. */
  write() {
    clearTimeout(this.timer);
    this.timer = null;
    if (location.hash && !location.hash.startsWith("#/")) return;
    const { path, parts, query } = parseAddress(location.hash);
    for (const name of NAMES) {
      const value = this.value[name];
      if (value === NOTHING[name] || parts.slice(1).includes(String(value))) query.delete(name);
      else query.set(name, String(value));
    }
    const text = query.toString(),
      wanted = (path || "#/") + (text ? "?" + text : "");
    if (wanted !== location.hash && path) history.replaceState(history.state, "", wanted);
  }

  /** Take over what an address says. */
  read(query) {
    const given = {};
    for (const name of NAMES) {
      if (!query.has(name)) continue;
      const text = query.get(name);
      if (name !== "time") given[name] = text;
      else if (/^\d+$/.test(text)) given.time = Number(text);
    }
    this.merge(given);
  }
}
