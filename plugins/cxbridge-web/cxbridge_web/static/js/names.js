// Keys of goals, names in events, and a binary search.
export const MAIN_ENV = "executive"; // the environment of an agent without a name
/** The key of a goal: its id; outside of MAIN_ENV with the environment in front. */
export const goalKey = (env, id) => (!env || env === MAIN_ENV ? id : env + ":" + id);
/** A symbol as a text; "" for nil. */
export const bare = (symbol) => (symbol === "nil" ? "" : symbol);
/** Whether the goal of an event has no id yet: the core sets the id at once, in a further event. */
export const isUnnamed = ({ kind, goal, mode }) => kind === "goal" && goal === "nil" && mode === "FORMULATED";
/** The values of a printed multislot, `(a "b c")`; strings without their quotes. */
export const fields = (text = "") =>
  [...text.slice(1, -1).matchAll(/"([^"]*)"|[^\s"]+/g)].map(([word, string]) => string ?? word);

/** The name of the skill in a skill string. */
export const skillOf = (text) => /^[^{(\s]*/.exec(text)[0];

/** The number of leading elements that meet a condition, by binary search: no later element may meet it. */
export function countWhile(list, meets) {
  let low = 0,
    high = list.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (meets(list[middle])) low = middle + 1;
    else high = middle;
  }
  return low;
}
