// What is chosen, as the parts of an address: goal/KEY/action/PLAN ID/skill/NUMBER.
const NAMES = ["goal", "action", "skill"];

/** @returns {{goal?: string, action?: string, skill?: string}} */
export function pathOf(parts) {
  const path = {};
  for (let at = 0; at < parts.length; at++)
    if (NAMES.includes(parts[at]) && parts[at + 1]) path[parts[at]] = parts[++at];
  return path;
}

export const partsOf = (path) => NAMES.flatMap((name) => (path[name] ? [name, path[name]] : []));

/** The path of a goal, an action or a skill call. */
export function pathTo(item) {
  if (item.kind === "goal") return { goal: item.key };
  if (item.kind === "action") return { goal: item.goal, action: item.path };
  if (item.kind !== "skill") return {};
  const { action } = item;
  return { ...(action ? pathTo(action) : {}), skill: String(item.number) };
}

/** What a path leads to: each of its levels that there is. */
export function resolve(path, history) {
  const goal = path.goal && history.goals.get(path.goal),
    action = path.action && history.actions.get(path.goal + "\n" + path.action),
    call = path.skill && history.callOf(Number(path.skill));
  return {
    goal: goal || null,
    action: action || null,
    call: call || null,
    item: call || action || goal || null,
  };
}
