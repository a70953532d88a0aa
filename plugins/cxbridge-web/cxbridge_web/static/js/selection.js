// The selection, which all views share: goal, action, skill, moment and environment. The address has the
// selection, so that a link shows the same to a colleague.

/** The empty selection. `time`: microseconds since the epoch, null: now. */
const NOTHING = { goal: "", action: "", skill: "", time: null, env: "" };
const NAMES = Object.keys(NOTHING);
const WRITE_MS = 300; // browsers refuse addresses that change too often

function decode(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

/** An address `#/view/part?name=value` taken apart. */
export function parseAddress(hash) {
  const [, path, query] = /^([^?]*)\??(.*)$/s.exec(hash);
  return { path, parts: path.slice(2).split("/").map(decode), query: new URLSearchParams(query) };
}

export class Selection {
  value = { ...NOTHING };
  timer = null;

  /** @param target gets an event `select` with each change; its detail has the values, and `changed`, their names */
  constructor(target) {
    this.target = target;
  }

  /** Change the given names. An action and a skill belong to their goal: another goal clears both. */
  merge(given) {
    const isOther = "goal" in given && given.goal !== this.value.goal,
      next = { ...this.value, ...(isOther && { action: "", skill: "" }), ...given },
      changed = NAMES.filter((name) => next[name] !== this.value[name]);
    if (!changed.length) return;
    this.value = Object.fromEntries(NAMES.map((name) => [name, next[name] ?? NOTHING[name]]));
    this.timer ??= setTimeout(() => this.write(), WRITE_MS);
    this.target.dispatchEvent(new CustomEvent("select", { detail: { changed, ...this.value } }));
  }

  /** Write the selection into the address, without a step in the history. The query omits values of the path. */
  write() {
    clearTimeout(this.timer);
    this.timer = null;
    if (location.hash && !location.hash.startsWith("#/")) return;
    const { path, parts, query } = parseAddress(location.hash);
    for (const [name, value] of Object.entries(this.value)) {
      if (value === NOTHING[name] || parts.slice(1).includes(String(value))) query.delete(name);
      else query.set(name, String(value));
    }
    const text = query.toString(),
      wanted = (path || "#/") + (text && "?" + text);
    if (wanted !== location.hash && path) history.replaceState(history.state, "", wanted);
  }

  read(query) {
    const { time, ...given } = Object.fromEntries([...query].filter(([name]) => name in NOTHING));
    this.merge(/^\d+$/.test(time) ? { ...given, time: Number(time) } : given);
  }
}
