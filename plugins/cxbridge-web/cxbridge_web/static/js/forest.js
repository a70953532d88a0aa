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
