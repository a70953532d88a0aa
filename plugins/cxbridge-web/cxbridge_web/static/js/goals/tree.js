// Trees of goals: from the goals that there are to the rows that are shown.

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

/**
 * The rows, in their order.
 * @param isFlat only what fits, without its tree
 * @param fits whether a goal is wanted
 * @param closed keys of goals whose children are hidden
 */
export function rowsOf(goals, parents, children, { isFlat, fits, closed }) {
  const items = [],
    stack = goals
      .filter((goal) => !parents.get(goal.key))
      .reverse()
      .map((goal) => [goal, 0]);
  while (stack.length) {
    const [goal, depth] = stack.pop(),
      kids = children.get(goal.key),
      isOpen = kids ? isFlat || !closed.has(goal.key) : null;
    if (fits(goal))
      items.push({
        goal,
        depth: isFlat ? 0 : depth,
        open: isFlat ? null : isOpen,
        inside: isOpen === false ? countBelow(goal, children) : 0,
      });
    if (isOpen) for (let at = kids.length - 1; at >= 0; at--) stack.push([kids[at], depth + 1]);
  }
  return items;
}
