// The marks of errors on the axis: log lines of level error, and skill calls that ended with an error.
const cachedMarks = new WeakMap(); // history -> its marks, and their revision

/**
 * The marks of a history, in order; marks of skill calls also have `call`.
 * @returns {{kind: "error" | "failure", time: number, step: number, component: string, text: string}[]}
 */
export function marksOf(history) {
  const { revision, calls, errors } = history,
    cached = cachedMarks.get(history);
  if (cached && cached.revision === revision) return cached.marks;
  const failures = calls.filter(({ error, end }) => error && end).map(markOf),
    marks = [...errors, ...failures].sort((a, b) => a.step - b.step || a.time - b.time);
  cachedMarks.set(history, { revision, marks });
  return marks;
}

function markOf(call) {
  const { end, skiller: component, text, error } = call;
  return { kind: "failure", ...end, component, text: text + " failed: " + error, call };
}
