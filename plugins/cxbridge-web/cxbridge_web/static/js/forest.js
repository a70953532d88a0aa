// Trees of goals.

/** The parent of each goal, "" for roots. If goals are each other's parents, the first goal is a root. */
function parentsOf(goals) {
  const there = new Set(goals.map((goal) => goal.key)),
    parents = new Map(goals.map((goal) => [goal.key, there.has(goal.parent) ? goal.parent : ""])),
    settled = new Set();
  for (const { key } of goals) {
    const path = new Set();
    let at = key;
    while (at && !settled.has(at) && !path.has(at)) {
      path.add(at);
      at = parents.get(at);
    }
    if (path.has(at)) {
      const way = [...path],
        ring = new Set(way.slice(way.indexOf(at)));
      parents.set(goals.find((each) => ring.has(each.key)).key, "");
    }
    for (const each of path) settled.add(each);
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
 * @param isFlat only the goals that fit, without their trees
 * @param fits whether a goal is wanted
 * @param closed keys of goals whose children are hidden
 */
export function rowsOf({ roots, children }, { isFlat, fits, closed }) {
  const items = [],
    stack = roots.map((goal) => [goal, 0]).reverse();
  while (stack.length) {
    const [goal, depth] = stack.pop(),
      kids = children.get(goal.key),
      open = kids ? isFlat || !closed.has(goal.key) : null;
    if (fits(goal))
      items.push({
        goal,
        depth: isFlat ? 0 : depth,
        open: isFlat ? null : open,
        inside: open === false ? countBelow(goal, children) : 0,
      });
    if (open) stack.push(...kids.map((kid) => [kid, depth + 1]).reverse());
  }
  return items;
}

const MOST_BELOW = 9999;
function countBelow(goal, children) {
  let count = 0;
  const stack = [goal];
  while (stack.length && count <= MOST_BELOW) {
    const kids = children.get(stack.pop().key) || [];
    count += kids.length;
    stack.push(...kids);
  }
  return count;
}
