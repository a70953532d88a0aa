// Errors: log lines of level error, and skill calls that failed.
const known = new WeakMap(); // history -> its marks, and their revision

/** @returns {{time: number, step: number, component: string, text: string}[]} in order */
export function marksOf(history) {
  const { revision, calls, errors } = history,
    before = known.get(history);
  if (before && before.revision === revision) return before.marks;
  const failed = calls.filter(({ error, end }) => error && end).map(markOf),
    marks = [...errors, ...failed].sort((a, b) => a.step - b.step || a.time - b.time);
  known.set(history, { revision, marks });
  return marks;
}

function markOf(call) {
  const { end, skiller: component, text, error } = call;
  return { kind: "failure", ...end, component, text: text + " failed: " + error, call };
}
