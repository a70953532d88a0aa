// The run: moments, and what was at each. A step is a transition; moment m is after m steps.
cx.run = (() => {
  const data = cx.data;
  const tables = Object.fromEntries(Object.entries(data.looks).map(([kind, table]) => [kind, new Map(Object.entries(table))]));
  const names = (kind) => (state) => tables[kind].get(state) || ["other", "?"];
  const look = { mode: names("mode"), outcome: names("outcome"), action: names("action"), skill: names("skill") };
  const ENDED = new Set(["FINISHED", "EVALUATED", "RETRACTED"]);
  function goalLook(mode, outcome) {
    const known = tables.outcome.get(outcome);
    if (known && ENDED.has(mode)) return known;
    return look.mode(mode);
  }
  const goalText = (mode, outcome) => (tables.outcome.has(outcome) ? mode + " " + outcome : mode);

  const goals = data.goals.map(([id, cls, sub, env, parent, states], number) => ({
    kind: "goal", number, id, cls, sub, env, parent, children: [], actions: [],
    states: states.map(([seq, time, mode, outcome, error]) => ({
      seq, time, mode, outcome, error, look: goalLook(mode, outcome), text: goalText(mode, outcome), gone: mode === "RETRACTED",
    })),
  }));
  const roots = [];
  for (const goal of goals) (goal.parent === null ? roots : goals[goal.parent].children).push(goal);
  const strays = [];
  const actions = data.actions.map(([goal, goalId, plan, id, name, env, states]) => {
    const action = {
      kind: "action", goal: goal === null ? null : goals[goal], goalId, plan, id, name, env, children: [],
      states: states.map(([seq, time, state]) => ({ seq, time, text: state, look: look.action(state), gone: false })),
    };
    (goal === null ? strays : goals[goal].actions).push(action);
    return action;
  });
  const calls = data.calls.map(([env, skiller, text, msgid, seq, time, endSeq, endTime, status, error]) => ({
    env, skiller, text, msgid, seq, time, endSeq, endTime, status, error, look: look.skill(status),
  }));

  // steps in order, with a line that says what each was
  const steps = [];
  for (const goal of goals) for (const state of goal.states) {
    steps.push({ seq: state.seq, time: state.time, line: "goal " + goal.id + " " + state.text, row: goal });
  }
  for (const action of actions) for (const state of action.states) {
    steps.push({ seq: state.seq, time: state.time, line: "action " + action.name + " of " + action.goalId + " " + state.text, row: action });
  }
  for (const call of calls) {
    steps.push({ seq: call.seq, time: call.time, line: "skill " + call.text + " begins" });
    if (call.endSeq !== null && call.endSeq !== call.seq) steps.push({ seq: call.endSeq, time: call.endTime, line: "skill " + call.text + " " + call.status });
  }
  for (const [name, , seq, time, endSeq, endTime, status] of data.spans) {
    steps.push({ seq, time, line: name + " begins" });
    if (endSeq !== null) steps.push({ seq: endSeq, time: endTime, line: name + " " + status });
  }
  const transitions = steps.length;
  if (!transitions) {
    for (const [seq, time, uid] of data.changes) steps.push({ seq, time, line: "write of " + data.interfaces[uid][0] });
    for (const row of data.log) if (row.length > 4) steps.push({ seq: row[0], time: row[1], line: row[4] });
  }
  steps.sort((a, b) => a.seq - b.seq);
  const seqs = steps.map((step) => step.seq);

  // how many of sorted numbers are at most this one
  function upTo(list, number, key) {
    let low = 0, high = list.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((key ? key(list[middle]) : list[middle]) <= number) low = middle + 1; else high = middle;
    }
    return low;
  }
  const last = (list, seq) => list[upTo(list, seq, (each) => each.seq) - 1];

  // moves that come at once are drawn once
  const listeners = [], changed = new Set();
  function tell(what) {
    if (!changed.size) setTimeout(() => {
      const all = [...changed];
      changed.clear();
      for (const each of all) for (const listener of listeners) listener(each);
    });
    changed.add(what);
  }
  let moment = steps.length, selected = null;
  const run = {
    goals, roots, strays, actions, calls, steps, transitions, end: Math.max(data.end, 1), upTo, last,
    get moment() { return moment; },
    get seq() { return moment === steps.length ? Infinity : moment ? seqs[moment - 1] : seqs[0] - 1; },
    get time() { return moment === steps.length ? data.end : moment ? steps[moment - 1].time : steps[0].time; },
    get selected() { return selected; },
    stepOf: (seq) => upTo(seqs, seq),
    go(wanted) {
      moment = Math.max(0, Math.min(steps.length, Math.round(wanted)));
      tell("moment");
    },
    goToSeq: (seq) => run.go(upTo(seqs, seq)),
    goToTime: (time) => run.go(upTo(steps, time, (step) => step.time)),
    select(row) { selected = row; tell("selection"); },
    onChange: (listener) => listeners.push(listener),
    seconds: (time) => (time / 1e6).toFixed(3) + " s",
    duration(time) {
      if (time < 1000) return time + " µs";
      if (time < 1e6) return (time / 1e3).toFixed(1) + " ms";
      if (time < 60e6) return (time / 1e6).toFixed(3) + " s";
      return Math.floor(time / 60e6) + " min " + ((time % 60e6) / 1e6).toFixed(1) + " s";
    },
  };
  return run;
})();
