// The run: moments, and what was at each. A step is a transition; moment m is after m steps.
cx.run = (() => {
  const data = cx.data;
  const end = Math.max(data.end, 1);

  // the data as the events that they were: [seq, event]
  const events = [];
  for (const [id, cls, sub, env, parent, states] of data.goals) {
    for (const [at, [seq, time, mode, outcome, error]] of states.entries()) {
      events.push([seq, { kind: "goal", is_new: at === 0, time_us: time, env, goal: id, goal_class: cls, sub_type: sub,
        parent: parent === null ? "" : data.goals[parent][0], mode, outcome, error }]);
    }
  }
  data.actions.forEach(([, goal, plan, id, name, env, states], number) => {
    for (const [seq, time, state] of states) events.push([seq, { kind: "plan-action", time_us: time, env, goal, plan, action_id: id, action: name, state, number }]);
  });
  data.calls.forEach(([env, skiller, text, msgid, seq, time, endSeq, endTime, status, error], number) => {
    // calls with names of their own already
    const call = { kind: "skill", env, skiller, skill_string: text, msgid, lane: number };
    events.push([seq, { ...call, time_us: time, status: "S_RUNNING" }]);
    if (endSeq !== null) events.push([endSeq, { ...call, time_us: endTime, status, error }]);
  });
  data.spans.forEach(([planner, goal, seq, time, endSeq, endTime, status, text], call) => {
    events.push([seq, { kind: "planner", time_us: time, env: "", planner, goal, call, status: "started", problem: text }]);
    if (endSeq !== null) events.push([endSeq, { kind: "planner", time_us: endTime, env: "", planner, goal, call, status, reason: text }]);
  });
  for (const row of data.log) {
    if (row.length > 4 && row[2] === "E") events.push([row[0], { kind: "log", time_us: row[1], level: "E", component: data.components[row[3]], text: row[4] }]);
  }
  events.sort((a, b) => a[0] - b[0]);

  // steps in order, with a line that says what each was
  const lineOf = (event) => {
    if (event.kind === "goal") return "goal " + event.goal + " " + event.mode + (["", "UNKNOWN"].includes(event.outcome) ? "" : " " + event.outcome);
    if (event.kind === "plan-action") return "action " + event.action + " of " + event.goal + " " + event.state;
    if (event.kind === "skill") return "skill " + event.skill_string + " " + (event.status === "S_RUNNING" ? "begins" : event.status);
    return event.planner + " " + (event.status === "started" ? "begins" : event.status);
  };
  const history = new cx.History(), steps = [], actions = [], calls = [];
  for (const [seq, event] of events) {
    history.apply(event);
    if (event.kind === "skill") calls[event.lane] = history.lastCalls.get(event.lane);
    if (event.kind === "plan-action") actions[event.number] ??= history.actionAt(history.keyOf(event.env, event.goal), event.plan, event.action_id);
    while (steps.length < history.steps) steps.push({ seq, time: event.time_us, line: lineOf(event) });
  }
  for (const [action, call, guessed] of data.links) history.link(actions[action], calls[call], guessed);
  history.begin = 0;
  history.time = end;
  const transitions = steps.length;
  if (!transitions) {
    for (const [seq, time, uid] of data.changes) steps.push({ seq, time, line: "write of " + data.interfaces[uid][0] });
    for (const row of data.log) if (row.length > 4) steps.push({ seq: row[0], time: row[1], line: row[4] });
    steps.sort((a, b) => a.seq - b.seq);
  }
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

  // moves that come at once are drawn once
  const listeners = [];
  let isScheduled = false;
  function notify() {
    if (!isScheduled) setTimeout(() => {
      isScheduled = false;
      for (const listener of listeners) listener();
    });
    isScheduled = true;
  }
  let moment = steps.length;
  const run = {
    history, steps, transitions, end, upTo,
    get moment() { return moment; },
    get seq() { return moment === steps.length ? Infinity : moment ? seqs[moment - 1] : seqs[0] - 1; },
    get time() { return moment === steps.length ? data.end : moment ? steps[moment - 1].time : steps[0].time; },
    // of the history: it has no steps when there were no transitions
    get step() { return transitions ? (moment === steps.length ? Infinity : moment) : Infinity; },
    stepOf: (seq) => upTo(seqs, seq),
    go(wanted) {
      moment = Math.max(0, Math.min(steps.length, Math.round(wanted)));
      notify();
    },
    goToSeq: (seq) => run.go(upTo(seqs, seq)),
    goToTime: (time) => run.go(upTo(steps, time, (step) => step.time)),
    onChange: (listener) => listeners.push(listener),
    seconds: (time) => (time / 1e6).toFixed(3) + " s",
  };
  return run;
})();
