// Keys of goals: an environment other than the executive's own is part of the name.
export const MAIN_ENV = "executive";
export const goalKey = (env, id) => (!env || env === MAIN_ENV ? id : env + ":" + id);
export const bare = (symbol) => (symbol === "nil" ? "" : symbol);
/** Whether a goal has no id in an event: the core gives the goal an id at once, and its life begins with that. */
export const isUnnamed = ({ kind, goal, mode }) => kind === "goal" && goal === "nil" && mode === "FORMULATED";
/** The fields of a multislot as CLIPS prints them in parentheses; strings without their quotes. */
export const fields = (text = "") =>
  [...text.slice(1, -1).matchAll(/"([^"]*)"|[^\s"]+/g)].map(([word, string]) => string ?? word);

/** The name of the skill in a skill string. */
export const skillOf = (text) => /^[^{(\s]*/.exec(text)[0];

/** How many elements of an ordered list come before the first that does not meet a condition. */
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
