// What was at a moment, and the lists: skills, rules, log, interfaces.
(() => {
  const { el, get, run, data } = cx;
  const { virtual, table } = cx.lists;
  const jump = (seq, time) => el("button", { type: "button", class: "jump", on: { click: () => run.goToSeq(seq) } }, run.seconds(time));

  // the moment
  const RULES = 6, LINES = 6;
  const lines = data.log.filter((row) => row.length > 4);
  function listOf(title, items, none, cls) {
    return el("div", { class: cls }, el("h3", {}, title), items.length ? el("ul", { class: "plain" }, items.map((item) => el("li", {}, item))) : el("p", { class: "none" }, none));
  }
  const { history } = run;
  const OVER = new Set(["FINAL", "FAILED", "FORMULATED"]);
  function goalsNow() {
    const counts = new Map();
    let there = 0;
    for (const goal of history.goals.values()) {
      const change = cx.lastUpTo(goal.changes, run.step);
      if (!change || change.mode === "RETRACTED") continue;
      there += 1;
      const text = change.mode + (["", "UNKNOWN"].includes(change.outcome) ? "" : " " + change.outcome);
      counts.set(text, [cx.goalOutcome(change), (counts.get(text) || [0, 0])[1] + 1]);
    }
    return listOf("Goals: " + there, [...counts].map(([text, [outcome, count]]) => [cx.outcomeBadge(outcome, text), " " + count]), "none now");
  }
  function runningNow() {
    const items = [];
    for (const action of history.actions.values()) {
      const change = cx.lastUpTo(action.changes, run.step);
      if (change && !OVER.has(change.state)) items.push([cx.outcomeBadge(cx.actionOutcome(change.state), change.state), " ", el("b", {}, action.name), " of " + action.goal]);
      if (items.length >= 12) { items.push("and perhaps more: see the timeline"); break; }
    }
    for (const call of history.calls) {
      if (call.begin.step <= run.step && (call.end === null || call.end.step > run.step)) {
        items.push([cx.outcomeBadge("running", call.skiller), " ", el("code", {}, call.text)]);
      }
    }
    return listOf("Actions and skills under way", items, "none now");
  }
  function rulesNow() {
    const flat = data.firings;
    let low = 0, high = flat.length / 3;
    while (low < high) { const middle = (low + high) >> 1; if (flat[middle * 3] <= run.seq) low = middle + 1; else high = middle; }
    const items = [];
    for (let i = Math.max(0, low - RULES); i < low; i++) items.push([el("code", {}, data.rules[flat[i * 3 + 2]][1]), el("span", { class: "dim" }, " " + run.seconds(flat[i * 3 + 1]))]);
    return listOf("Rules that fired last", items, data.rules.length ? "none yet" : "no firings recorded");
  }
  function linesNow() {
    const count = run.upTo(lines, run.seq, (row) => row[0]);
    return listOf("Log", lines.slice(Math.max(0, count - LINES), count).map((row) => [el("span", { class: "lv lv-" + row[2] }, row[2]), " ", el("span", { class: "dim" }, data.components[row[3]] + ": "), row[4]]), "nothing yet", "wide-one");
  }
  const now = get("now");
  function drawNow() {
    now.replaceChildren(goalsNow(), runningNow(), rulesNow(), linesNow());
    get("now-at").textContent = run.steps.length && run.moment < run.steps.length ? "at " + run.seconds(run.time) + ", after step " + run.moment : "at the end of the recording";
    for (const [uid, block] of open) fillValues(uid, block);
  }

  // skills
  const took = (call) => (call.end === null ? Infinity : call.end.time - call.begin.time);
  table(get("skill-table"), "Skills", [
    ["begin", (call) => run.seconds(call.begin.time), (call) => call.begin.step, true],
    ["skiller", (call) => call.skiller, (call) => call.skiller],
    ["skill", (call) => el("code", {}, call.text), (call) => call.text],
    ["took", (call) => (call.end === null ? "not over" : cx.durationText(took(call))), took, true],
    ["came to", (call) => cx.outcomeBadge(cx.outcomeAt(call), call.end === null ? "still running" : call.status), (call) => call.status],
    ["error", (call) => call.error, (call) => call.error],
  ], history.calls, (call) => run.go(call.begin.step));

  // rules
  const many = new Set(data.rules.map((rule) => rule[0])).size > 1;
  const columns = [
    ["rule", (rule) => el("code", {}, rule[1]), (rule) => rule[1]],
    ["fired", (rule) => String(rule[2]), (rule) => rule[2], true],
    ["first", (rule) => jump(rule[3], rule[4]), (rule) => rule[3], true],
    ["last", (rule) => jump(rule[5], rule[6]), (rule) => rule[5], true],
  ];
  if (many) columns.push(["environment", (rule) => rule[0], (rule) => rule[0]]);
  table(get("rule-table"), "Rules", columns, data.rules);

  // log
  const LEVELS = { E: "error", W: "warning", I: "info", D: "debug" };
  const box = get("log-rows"), counter = get("log-count"), find = get("log-find"), full = get("log-full");
  let shown = [], chosen = null;
  const boxes = Object.fromEntries(Object.keys(LEVELS).map((level) => [level, get("level-" + level)]));
  const list = virtual(box, () => 22, (at) => {
    const row = shown[at];
    if (row.length <= 4) return el("div", { class: "line gap" }, row[2] + " lines of level " + row[3] + " left out here");
    const later = row[0] > run.seq;
    return el("div", { role: "option", id: "line" + at, "aria-selected": String(row === chosen), class: "line lv-" + row[2] + (row === chosen ? " selected" : "") + (later ? " later" : "") },
      el("span", { class: "n" }, (row[1] / 1e6).toFixed(3)), el("span", { class: "lv" }, row[2]), el("span", { class: "dim from" }, data.components[row[3]]), el("span", { class: "text" }, row[4].split("\n", 1)[0]));
  });
  function sift() {
    const wanted = find.value.toLowerCase();
    shown = data.log.filter((row) => row.length <= 4 ? boxes[row[3]].checked && !wanted
      : boxes[row[2]].checked && (!wanted || row[4].toLowerCase().includes(wanted) || data.components[row[3]].toLowerCase().includes(wanted)));
    list.set(shown.length);
    counter.textContent = shown.length + " of " + data.log.length + " lines";
  }
  function chooseLine(at) {
    if (at < 0 || at >= shown.length || shown[at].length <= 4) return;
    chosen = shown[at];
    full.textContent = cx.visible(run.seconds(chosen[1]) + "  " + LEVELS[chosen[2]] + "  " + data.components[chosen[3]] + "\n" + chosen[4]);
    full.hidden = false;
    list.show(at);
    box.setAttribute("aria-activedescendant", "line" + at);
  }
  box.addEventListener("click", (event) => {
    const node = event.target.closest(".line[role=option]");
    if (node) chooseLine(Number(node.id.slice(4)));
  });
  box.addEventListener("keydown", (event) => {
    const moves = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10, Home: -shown.length, End: shown.length };
    if (event.key === "Enter" && chosen) run.goToSeq(chosen[0]);
    else if (event.key in moves) chooseLine(Math.max(0, Math.min(shown.length - 1, shown.indexOf(chosen) + moves[event.key])));
    else return;
    event.preventDefault();
  });
  for (const level of Object.keys(LEVELS)) boxes[level].addEventListener("change", sift);
  find.addEventListener("input", sift);
  get("log-now").addEventListener("click", () => chooseLine(run.upTo(shown, run.seq, (row) => row[0]) - 1));
  get("log-go").addEventListener("click", () => { if (chosen) run.goToSeq(chosen[0]); });
  sift();

  // interfaces: the values at the moment, of those that are open
  const open = new Map(), place = get("interface-list");
  const byUid = data.interfaces.map(() => []);
  for (const row of data.changes) byUid[row[2]].push(row);
  const fields = byUid.map((rows) => { const names = new Set(); for (const row of rows) for (const name in row[3]) names.add(name); return names; });
  const sent = data.interfaces.map(() => []);
  for (const row of data.messages) sent[row[2]].push(row);
  function fillValues(number, block) {
    const found = new Map();
    const count = run.upTo(byUid[number], run.seq, (row) => row[0]);
    for (let at = count - 1; at >= 0 && found.size < fields[number].size; at--) {
      for (const [name, value] of Object.entries(byUid[number][at][3])) if (!found.has(name)) found.set(name, value);
    }
    const values = new Map([...fields[number]].filter((name) => found.has(name)).map((name) => [name, found.get(name)]));
    const latest = new Set(count ? Object.keys(byUid[number][count - 1][3]) : []);
    const before = run.upTo(sent[number], run.seq, (row) => row[0]), messages = sent[number].slice(Math.max(0, before - 8), before);
    block.replaceChildren(
      values.size ? el("dl", { class: "pairs" }, [...values].flatMap(([name, value]) => [el("dt", {}, name), el("dd", { class: latest.has(name) ? "code fresh" : "code" }, value === "" ? "(empty)" : value)]))
        : el("p", { class: "none" }, "not written yet"),
      count ? el("p", { class: "dim" }, "last change at " + run.seconds(byUid[number][count - 1][1]) + "; what it changed is underlined") : "",
      messages.length ? listOf("Messages, the last " + messages.length + " of " + before, messages.map((row) => [jump(row[0], row[1]), " ", el("code", {}, row[3])]), "") : "");
  }
  if (!data.interfaces.length) place.append(el("p", { class: "none" }, "none recorded"));
  data.interfaces.forEach(([uid, writes, changes, messages, first, last], number) => {
    const block = el("div", { class: "values" });
    place.append(el("details", { on: { toggle: (event) => {
      if (event.target.open) { open.set(number, block); fillValues(number, block); } else open.delete(number);
    } } }, el("summary", {}, el("b", {}, uid), " ", el("span", { class: "dim" },
      writes + " writes, " + changes + " of them changes" + (messages ? ", " + messages + " messages" : "") + (writes ? "; " + run.seconds(first) + " to " + run.seconds(last) : ""))), block));
  });

  run.onChange(() => { drawNow(); list.redraw(); });
  drawNow();
  const wanted = /^#t=([0-9.]+)$/.exec(location.hash);
  if (wanted) run.goToTime(Number(wanted[1]) * 1e6);
})();
