// Errors: log lines of level error, and skill calls that failed.
const known = new WeakMap(); // history -> its marks, and of which revision they are

/** @returns {{time: number, step: number, component: string, text: string}[]} in order */
export function marksOf(history) {
  const before = known.get(history);
  if (before && before.revision === history.revision) return before.marks;
  const failed = history.calls.filter(({ error, end }) => error && end).map(markOf);
  const marks = [...history.errors, ...failed].sort((a, b) => a.step - b.step || a.time - b.time);
  known.set(history, { revision: history.revision, marks });
  return marks;
}

const markOf = (call) => ({
  kind: "failure",
  ...call.end,
  component: call.skiller,
  text: call.text + " failed: " + call.error,
  call,
});
