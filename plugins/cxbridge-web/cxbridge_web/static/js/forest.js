// Trees of goals.

/** The parent of each goal that is there, "" for roots. Of goals that are each other's parents the first is a root. */
export function parentsOf(goals) {
  const there = new Set(goals.map((goal) => goal.key)),
    settled = new Set();
  const parents = new Map(goals.map((goal) => [goal.key, there.has(goal.parent) ? goal.parent : ""]));
  for (const goal of goals) {
    const path = new Set();
    let at = goal.key;
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

/** The goals below each goal: key -> goals. @param parents as parentsOf has them */
export function childrenOf(goals, parents) {
  const children = new Map();
  for (const goal of goals) {
    const parent = parents.get(goal.key);
    if (!parent) continue;
    if (children.has(parent)) children.get(parent).push(goal);
    else children.set(parent, [goal]);
  }
  return children;
}
