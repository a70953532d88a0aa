// Goals over time, a row each below its parent; plan-actions, skills, interfaces and log as rows of their own.
(() => {
  const { el, svg, get, run, data } = cx;
  const box = get("rows"), slider = get("moment"), told = get("told"), axis = get("axis");
  const narrow = window.matchMedia("(max-width: 700px)");
  let printing = false;
  const high = () => (narrow.matches && !printing ? 40 : 24);
  const BAR = 14;
  let scale = run.transitions && run.end > 1 ? "time" : "step";
  let from = 0, to = 1, rows = [], at = 0, wanted = "";
  const whole = () => (scale === "time" ? run.end : Math.max(run.steps.length, 1));

  const closed = new Set();
  const withActions = get("with-actions");
  withActions.checked = run.goals.length + run.actions.length <= 300;

  // which rows there are
  const extra = [];
  const skillers = new Map();
  for (const call of run.calls) {
    const key = call.env + "\n" + call.skiller;
    if (!skillers.has(key)) skillers.set(key, { kind: "skiller", title: call.skiller, note: "skiller", calls: [], children: [] });
    skillers.get(key).calls.push(call);
  }
  extra.push(...skillers.values());
  if (data.spans.length) {
    extra.push({ kind: "skiller", title: "planner", note: "calls", children: [], calls: data.spans.map(([name, goal, seq, time, endSeq, endTime, status, text]) => ({
      text: name + (goal ? " for " + goal : "") + (text ? ": " + text : ""), seq, time, endSeq, endTime, status,
      look: status === "found" ? ["done", "✓"] : endSeq === null ? ["active", "▶"] : ["failed", "✗"] })) });
  }
  const logged = data.log.filter((row) => row.length > 4);
  for (const [level, title, tone] of [["E", "errors", "failed"], ["W", "warnings", "active"]]) {
    const marks = logged.filter((row) => row[2] === level);
    if (marks.length) extra.push({ kind: "marks", title, note: marks.length + " log lines", tone, marks, children: [] });
  }
  const byUid = data.interfaces.map(() => []);
  for (const row of data.changes) byUid[row[2]].push(row);
  byUid.forEach((marks, number) => {
    if (marks.length) extra.push({ kind: "marks", title: data.interfaces[number][0], note: marks.length + " changes", tone: "planned", marks, children: [] });
  });
  if (data.facts.length > 2) extra.push({ kind: "curve", title: "facts", note: "since the begin", children: [] });

  const matches = (goal) => (goal.id + " " + goal.cls + " " + goal.states[goal.states.length - 1].text).toLowerCase().includes(wanted);
  const below = (row) => [...row.children, ...(withActions.checked && row.actions ? row.actions : [])];
  const opens = (row) => below(row).length > 0;
  const isOpen = (row) => !closed.has(row);
  const onlyNow = get("only-now");
  const there = (row) => { const state = run.last(row.states, run.seq); return state !== undefined && !state.gone; };
  function list() {
    const shown = (row) => !onlyNow.checked || there(row);
    if (wanted) rows = run.goals.filter((row) => matches(row) && shown(row)).map((row) => ({ row, depth: 0 }));
    else {
      rows = [];
      const stack = [...run.roots].reverse().map((row) => ({ row, depth: 0 }));
      while (stack.length) {
        const each = stack.pop();
        // a goal that is gone may have children that are there
        if (shown(each.row)) rows.push(each);
        if (isOpen(each.row)) for (const row of below(each.row).reverse()) stack.push({ row, depth: each.depth + 1 });
      }
      for (const row of [...(withActions.checked ? run.strays.filter(shown) : []), ...extra]) rows.push({ row, depth: 0 });
    }
    at = Math.max(0, rows.findIndex((each) => each.row === run.selected));
    view.set(rows.length);
    const count = rows.filter((each) => each.row.kind === "goal").length, all = run.goals.length;
    get("count").textContent = (count === all ? "" : count + " of ") + all + (all === 1 ? " goal" : " goals");
  }
  function setOpen(row, wish) {
    if (!opens(row)) return;
    if (wish) closed.delete(row); else closed.add(row);
    list();
  }

  // where things are
  const MARGIN = 24;  // on the right, for the outcomes of what ends with the run
  let width = 600;
  const place = (seq, time) => (((scale === "time" ? time : run.stepOf(seq)) / whole() - from) / (to - from)) * (width - MARGIN);
  const endOf = () => ((1 - from) / (to - from)) * (width - MARGIN);
  const clip = (x) => Math.max(-4, Math.min(width + 4, x));

  // where a plan-action ends that is not over: with its goal, or with the recording
  const OVER = new Set(["FINAL", "FAILED"]);
  function endOfAction(action) {
    const final = action.states[action.states.length - 1];
    if (OVER.has(final.text)) return place(final.seq, final.time);
    const gone = action.goal && action.goal.states.find((state) => state.gone && state.seq > final.seq);
    return gone ? place(gone.seq, gone.time) : endOf();
  }
  function bars(states, finish) {
    const parts = [], middle = high() - 19;
    const begin = place(states[0].seq, states[0].time);
    let stop = begin;
    states.forEach((state, number) => {
      const next = states[number + 1];
      const x = clip(place(state.seq, state.time));
      const end = clip(next ? place(next.seq, next.time) : finish);
      if (state.gone) return;
      stop = Math.max(stop, end);
      if (end - x < 0.4) return;
      parts.push(svg("rect", { x, y: middle, width: end - x, height: BAR, class: "bar t-" + state.look[0] }));
      if (state.look[0] === "failed") parts.push(svg("rect", { x, y: middle, width: end - x, height: BAR, fill: "url(#hatch)" }));
      const room = end - x;
      if (room > 16) parts.push(svg("text", { x: Math.max(x, 0) + 4, y: middle + 11, class: "in" },
        room > 8 * state.text.length + 24 ? state.look[1] + " " + state.text : state.look[1]));
    });
    if (stop - begin < 3 && begin > -4 && begin < width + 4) {
      const look = states.filter((state) => !state.gone).pop() || states[0];
      parts.push(svg("path", { d: `M${begin - 4} ${middle + 7}l4 -6l4 6l-4 6z`, class: "bar t-" + look.look[0] }));
      stop = begin + 4;
    }
    const final = states[states.length - 1];
    if (final.gone && stop > -4 && stop < width) {
      parts.push(svg("rect", { x: stop + 2, y: middle, width: BAR, height: BAR, rx: 3, class: "bar t-" + final.look[0] }),
        svg("text", { x: stop + 2 + BAR / 2, y: middle + 11, class: "in mid" }, final.look[1]));
    }
    return parts;
  }
  function callBars(calls) {
    const parts = [], middle = high() - 19;
    for (const call of calls) {
      const x = clip(place(call.seq, call.time)), end = clip(call.endSeq === null ? endOf() : place(call.endSeq, call.endTime));
      if (end < 0 || x > width) continue;
      const room = Math.max(end - x, 2);
      parts.push(svg("rect", { x, y: middle, width: room, height: BAR, class: "bar t-" + call.look[0] }, svg("title", {}, call.text + " " + call.status)));
      if (call.look[0] === "failed") parts.push(svg("rect", { x, y: middle, width: room, height: BAR, fill: "url(#hatch)" }));
      if (room > 24) parts.push(svg("text", { x: Math.max(x, 0) + 4, y: middle + 11, class: "in" },
        call.look[1] + " " + call.text.slice(0, Math.max(0, Math.floor((room - 26) / 6.5)))));
    }
    return parts;
  }
  function ticks(marks, tone) {
    // as many as there are pixels: marks at the same place are one
    const parts = [], seen = new Set(), middle = high() - 19;
    for (const mark of marks) {
      const x = Math.round(place(mark[0], mark[1]));
      if (x < 0 || x > width || seen.has(x)) continue;
      seen.add(x);
      parts.push(svg("rect", { x: x - 1, y: middle, width: 2, height: BAR, class: "tick t-" + tone }));
    }
    return parts;
  }
  function curve() {
    const points = [], middle = high() - 20;
    let most = 1, least = 0;
    for (let i = 1; i < data.facts.length; i += 3) { most = Math.max(most, data.facts[i + 1]); least = Math.min(least, data.facts[i + 1]); }
    for (let i = 0; i < data.facts.length; i += 3) {
      const x = clip(place(data.facts[i], data.facts[i + 1])), y = middle + 15 - ((data.facts[i + 2] - least) / Math.max(1, most - least)) * 15;
      if (points.length) points.push([x, points[points.length - 1][1]]);
      points.push([x, y]);
    }
    points.push([clip(endOf()), points[points.length - 1][1]]);
    return [svg("polyline", { points: points.map(([x, y]) => x.toFixed(1) + "," + y.toFixed(1)).join(" "), class: "curve" })];
  }

  function label(row, depth) {
    const fold = opens(row) ? el("span", { class: "fold", "aria-hidden": "true" }, isOpen(row) ? "▾" : "▸") : el("span", { class: "fold" });
    let parts;
    if (row.kind === "goal") {
      const state = run.last(row.states, run.seq);
      parts = [el("i", { class: "state t-" + (state ? state.look[0] : "gone"), "aria-hidden": "true" }, state ? state.look[1] : "·"), " ",
        el("b", {}, row.id), " ", el("span", { class: "dim" }, row.cls), el("span", { class: "hear" }, state ? ", " + state.text : ", not yet there")];
    } else if (row.kind === "action") {
      const state = run.last(row.states, run.seq);
      parts = [el("i", { class: "state t-" + (state ? state.look[0] : "gone"), "aria-hidden": "true" }, state ? state.look[1] : "·"), " ",
        row.id + " ", el("span", {}, row.name), el("span", { class: "hear" }, state ? ", " + state.text : ", not yet there")];
    } else parts = [el("b", {}, row.title), " ", el("span", { class: "dim" }, row.note)];
    const node = el("div", { class: "label", title: row.kind === "goal" ? row.id + " " + row.cls : row.kind === "action" ? row.plan + " " + row.name : row.title }, fold, parts);
    node.style.paddingLeft = Math.min(depth, narrow.matches ? 8 : 12) * (narrow.matches ? 8 : 14) + "px";
    return node;
  }
  // pictures stay as they are until the axis changes; only the line of the moment moves
  let pictures = new Map(), drawn = "";
  function pictureOf(row) {
    const wanted = [scale, from, to, width, high()].join();
    if (drawn !== wanted || pictures.size > 500) { pictures = new Map(); drawn = wanted; }
    let picture = pictures.get(row);
    if (!picture) {
      picture = svg("svg", { class: "track", width, height: high(), "aria-hidden": "true" });
      if (row.kind === "goal") picture.append(...bars(row.states, endOf()));
      else if (row.kind === "action") picture.append(...bars(row.states, endOfAction(row)));
      else if (row.kind === "skiller") picture.append(...callBars(row.calls));
      else if (row.kind === "marks") picture.append(...ticks(row.marks, row.tone));
      else picture.append(...curve());
      picture.append(svg("line", { y1: 0, y2: high(), class: "now" }));
      pictures.set(row, picture);
    }
    const x = clip(now());
    picture.lastChild.setAttribute("x1", x);
    picture.lastChild.setAttribute("x2", x);
    return picture;
  }
  function draw(number) {
    const { row, depth } = rows[number];
    const picture = pictureOf(row);
    return el("div", {
      role: "treeitem", id: "row" + number, class: "row" + (row === run.selected ? " selected" : "") + (row.kind === "goal" || row.kind === "action" ? "" : " side"),
      "aria-level": depth + 1, "aria-setsize": rows.length, "aria-posinset": number + 1,
      "aria-selected": String(row === run.selected), "aria-expanded": opens(row) ? String(isOpen(row)) : null,
    }, label(row, depth), picture);
  }
  const now = () => place(run.seq, run.time);
  const view = cx.lists.virtual(box, high, draw);

  function drawAxis() {
    const parts = [], span = (to - from) * whole(), start = from * whole();
    const unit = scale === "time" ? 1e6 : 1;
    const rough = span / unit / Math.max(2, width / 110), power = 10 ** Math.floor(Math.log10(rough));
    let step = [1, 2, 5, 10].map((each) => each * power).find((each) => each >= rough);
    if (scale === "step") step = Math.max(1, Math.round(step));
    for (let mark = Math.ceil(start / unit / step) * step; mark * unit <= start + span; mark += step) {
      const x = ((mark * unit - start) / span) * (width - MARGIN);
      parts.push(svg("line", { x1: x, x2: x, y1: 14, y2: 20, class: "rule" }),
        svg("text", { x: Math.min(Math.max(x, 2), width - 40), y: 12, class: "after" }, scale === "time" ? String(Number(mark.toFixed(6))) + " s" : "#" + mark));
    }
    const x = now();
    if (x >= 0 && x <= width) parts.push(svg("path", { d: `M${x - 5} 12h10l-5 8z`, class: "hand" }));
    axis.setAttribute("width", width);
    axis.replaceChildren(...parts);
  }
  const PAPER = 480;  // report.css gives the tracks as much on paper
  function measure() { width = printing ? PAPER : Math.max(80, get("measure").clientWidth); }
  function redraw() { measure(); drawAxis(); view.redraw(); }
  function zoom(factor) {
    const middle = run.steps.length ? (scale === "time" ? run.time : run.moment) / whole() : 0.5, span = Math.min(1, Math.max(1e-6, (to - from) * factor));
    from = Math.max(0, Math.min(1 - span, middle - span / 2));
    to = from + span;
    redraw();
  }

  // moments
  slider.max = run.steps.length;
  slider.value = run.moment;
  slider.disabled = !run.steps.length;
  slider.addEventListener("input", () => run.go(Number(slider.value)));
  get("back").addEventListener("click", () => run.go(run.moment - 1));
  get("forth").addEventListener("click", () => run.go(run.moment + 1));
  get("zoom-in").addEventListener("click", () => zoom(0.5));
  get("zoom-out").addEventListener("click", () => zoom(2));
  get("zoom-all").addEventListener("click", () => { from = 0; to = 1; redraw(); });
  get("zoom-steps").addEventListener("click", () => {
    const list = run.steps;
    from = 0; to = 1;
    if (scale === "time" && list.length) {
      const span = Math.max(list[list.length - 1].time - list[0].time, whole() * 1e-6);
      from = Math.max(0, list[0].time - span * 0.01) / whole();
      to = Math.min(1, from + (span * 1.02) / whole());
    }
    redraw();
  });
  for (const name of ["time", "step"]) {
    get("by-" + name).addEventListener("click", () => { scale = name; from = 0; to = 1; press(); redraw(); });
  }
  function press() { for (const name of ["time", "step"]) get("by-" + name).setAttribute("aria-pressed", String(scale === name)); }
  get("find").addEventListener("input", () => { wanted = get("find").value.toLowerCase(); list(); });
  withActions.addEventListener("change", list);
  onlyNow.addEventListener("change", list);
  get("open-all").addEventListener("click", () => { closed.clear(); list(); });
  get("close-all").addEventListener("click", () => { for (const goal of run.goals) closed.add(goal); list(); });

  // rows
  function choose(number) {
    if (number < 0 || number >= rows.length) return;
    at = number;
    run.select(rows[at].row);
    view.show(at);
    box.setAttribute("aria-activedescendant", "row" + at);
  }
  box.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !rows.length) return;
    const row = rows[at].row, page = Math.max(1, Math.floor(box.clientHeight / high()) - 1);
    const moves = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -rows.length, End: rows.length };
    if (event.key in moves) choose(run.selected === null ? 0 : Math.max(0, Math.min(rows.length - 1, at + moves[event.key])));
    else if (event.key === "ArrowRight") setOpen(row, true);
    else if (event.key === "ArrowLeft") {
      if (opens(row) && isOpen(row)) setOpen(row, false);
      else choose(rows.slice(0, at).findLastIndex((each) => each.depth < rows[at].depth));
    } else if (event.key === "+") zoom(0.5);
    else if (event.key === "-") zoom(2);
    else if (event.key === "," ) run.go(run.moment - 1);
    else if (event.key === ".") run.go(run.moment + 1);
    else return;
    event.preventDefault();
  });
  box.addEventListener("click", (event) => {
    const node = event.target.closest(".row");
    if (!node) return;
    const number = Number(node.id.slice(3)), row = rows[number].row;
    const track = event.target.closest(".track");
    if (event.target.closest(".fold") && opens(row)) setOpen(row, !isOpen(row));
    else {
      choose(number);
      if (track) {
        const part = from + ((event.clientX - track.getBoundingClientRect().left) / (width - MARGIN)) * (to - from);
        if (scale === "time") run.goToTime(part * whole()); else run.go(part * whole());
      }
    }
  });
  run.onChange((what) => {
    if (what === "moment") {
      slider.value = run.moment;
      const part = (scale === "time" ? run.time : run.moment) / whole();
      if (part < from || part > to) { const span = to - from; from = Math.max(0, Math.min(1 - span, part - span / 2)); to = from + span; }
      drawAxis();
    }
    tell();
    if (what === "moment" && onlyNow.checked) list(); else view.redraw();
  });
  function tell() {
    const step = run.steps[run.moment - 1];
    const text = !run.steps.length ? "nothing happened" : run.moment === run.steps.length ? "the end, " + run.seconds(run.time)
      : run.moment ? run.seconds(run.time) + ", " + step.line : run.seconds(run.time) + ", before the first";
    told.textContent = cx.visible("step " + run.moment + " of " + run.steps.length + ": " + text);
    slider.setAttribute("aria-valuetext", told.textContent);
  }
  press(); measure(); list(); redraw(); tell();
  window.addEventListener("resize", redraw);
  window.addEventListener("beforeprint", () => { printing = true; redraw(); });
  window.addEventListener("afterprint", () => { printing = false; redraw(); });
  new ResizeObserver(redraw).observe(get("measure"));
})();
