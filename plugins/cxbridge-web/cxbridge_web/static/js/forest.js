// Trees of goals.

/**
 * The keys of the parents by the keys of the goals; "" for roots. In a cycle of parents, the first goal is a
 * root.
 */
function parentsOf(goals) {
  const keys = new Set(goals.map((goal) => goal.key)),
    parents = new Map(goals.map((goal) => [goal.key, keys.has(goal.parent) ? goal.parent : ""])),
    settled = new Set(); // keys of goals that are known to have a root
  for (const { key } of goals) {
    const path = new Set(); // the goal and its ancestors, up to a settled goal
    let at = key;
    while (at && !settled.has(at) && !path.has(at)) {
      path.add(at);
      at = parents.get(at);
    }
    if (path.has(at)) {
      const pathKeys = [...path],
        cycle = new Set(pathKeys.slice(pathKeys.indexOf(at)));
      parents.set(goals.find((goal) => cycle.has(goal.key)).key, "");
    }
    for (const pathKey of path) settled.add(pathKey);
  }
  return parents;
}

/** The trees of goals: {parents: key -> key, children: key -> goals, roots}. */
export function forestOfGoals(goals) {
  const parents = parentsOf(goals),
    children = Map.groupBy(goals, (goal) => parents.get(goal.key)),
    roots = children.get("") || [];
  children.delete("");
  return { parents, children, roots };
}

/**
 * The rows of a table, in the order of the trees.
 * @param isFlat whether to list the goals without their trees, also those below closed goals
 * @param fits(goal) whether to list a goal
 * @param closed the keys of goals whose children are hidden
 * @returns {{goal, depth, open, inside}[]} `open` is null for a goal without children; `inside` is the number
 * of hidden goals below a closed goal
 */
export function rowsOf({ roots, children }, { isFlat, fits, closed }) {
  const rows = [],
    stack = roots.map((goal) => [goal, 0]).reverse();
  while (stack.length) {
    const [goal, depth] = stack.pop(),
      childGoals = children.get(goal.key),
      open = childGoals ? isFlat || !closed.has(goal.key) : null;
    if (fits(goal))
      rows.push({
        goal,
        depth: isFlat ? 0 : depth,
        open: isFlat ? null : open,
        inside: open === false ? countBelow(goal, children) : 0,
      });
    if (open) stack.push(...childGoals.map((child) => [child, depth + 1]).reverse());
  }
  return rows;
}

const MOST_BELOW = 9999; // a greater number is not counted exactly
/** The number of goals below a goal. */
function countBelow(goal, children) {
  let count = 0;
  const stack = [goal];
  while (stack.length && count <= MOST_BELOW) {
    const childGoals = children.get(stack.pop().key) || [];
    count += childGoals.length;
    stack.push(...childGoals);
  }
  return count;
}
