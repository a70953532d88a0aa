// The selection, which all views share: goal, action, skill, moment and environment. The address has the
// selection, so that a link shows the same to a colleague.

/** The empty selection. `time`: microseconds since the epoch, null: now. */
const NOTHING = { goal: "", action: "", skill: "", time: null, env: "" };
const NAMES = Object.keys(NOTHING);
const WRITE_MS = 300; // browsers refuse addresses that change too often

/** Decode a part of an address; a malformed part stays as it is. */
function decode(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

/**
 * An address `#/view/part?name=value` taken apart.
 * @returns {path, parts, query}: the path with its `#/`, its decoded parts, and the query as URLSearchParams
 */
export function parseAddress(hash) {
  const [, path, query] = /^([^?]*)\??(.*)$/s.exec(hash);
  return { path, parts: path.slice(2).split("/").map(decode), query: new URLSearchParams(query) };
}

export class Selection {
  value = { ...NOTHING };
  timer = null; // of the next write into the address

  /**
   * @param target gets an event `select` after each change; its `detail` has all values, and `changed`: the
   * names of the changed values
   */
  constructor(target) {
    this.target = target;
  }

  /** Change some values. An action and a skill belong to their goal, so another goal clears both. */
  merge(changes) {
    const isOtherGoal = "goal" in changes && changes.goal !== this.value.goal,
      next = { ...this.value, ...(isOtherGoal && { action: "", skill: "" }), ...changes },
      changed = NAMES.filter((name) => next[name] !== this.value[name]);
    if (!changed.length) return;
    this.value = Object.fromEntries(NAMES.map((name) => [name, next[name] ?? NOTHING[name]]));
    this.timer ??= setTimeout(() => this.write(), WRITE_MS);
    this.target.dispatchEvent(new CustomEvent("select", { detail: { changed, ...this.value } }));
  }

  /**
   * Write the selection into the address, without a step in the history. The query omits values of the path.
   */
  write() {
    clearTimeout(this.timer);
    this.timer = null;
    if (location.hash && !location.hash.startsWith("#/")) return; // the skip link
    const { path, parts, query } = parseAddress(location.hash);
    for (const [name, value] of Object.entries(this.value)) {
      if (value === NOTHING[name] || parts.slice(1).includes(String(value))) query.delete(name);
      else query.set(name, String(value));
    }
    const queryText = query.toString(),
      address = path + (queryText && "?" + queryText);
    if (address !== location.hash && path) history.replaceState(history.state, "", address);
  }

  /** Take the values that the query of an address has; a malformed time is left out. */
  read(query) {
    const { time, ...texts } = Object.fromEntries([...query].filter(([name]) => name in NOTHING));
    this.merge(/^\d+$/.test(time) ? { ...texts, time: Number(time) } : texts);
  }
}
