// The page's timeline within a report, and the bar that goes through its moments.
(() => {
  const { get, run, data } = cx;
  const { history } = run;

  // lanes besides goals and robots: warnings, interfaces, facts
  const pointAt = (seq, time, more) => ({ time, step: run.transitions ? run.stepOf(seq) : 0, ...more });
  const lines = data.log.filter((row) => row.length > 4);
  const lanes = [];
  const warnings = lines.filter((row) => row[2] === "W");
  if (warnings.length) lanes.push({ kind: "marks", title: "warnings", note: warnings.length + " log lines", outcome: "rejected",
    points: warnings.map((row) => pointAt(row[0], row[1], { component: data.components[row[3]], text: row[4] })) });
  const byUid = data.interfaces.map(() => []);
  for (const [seq, time, number, changed] of data.changes) byUid[number].push(pointAt(seq, time, { changed }));
  byUid.forEach((points, number) => {
    for (const point of points) {
      Object.defineProperty(point, "text", { get: () => Object.entries(point.changed).map(([name, value]) => name + " = " + value).join(", ") });
    }
    if (points.length) lanes.push({ kind: "marks", title: data.interfaces[number][0], note: points.length + " changes", points });
  });
  if (data.facts.length > 2) {
    const points = [];
    for (let at = 0; at < data.facts.length; at += 3) points.push(pointAt(data.facts[at], data.facts[at + 1], { value: data.facts[at + 2] }));
    lanes.push({ kind: "curve", title: "facts", note: "since the begin", points });
  }

  const address = (path) => "#/timeline" + cx.partsOf(path).map((part) => "/" + encodeURIComponent(part)).join("");
  const decode = (text) => { try { return decodeURIComponent(text); } catch { return text; } };
  const host = {
    history, isLive: false, zero: 0, explain: null,
    now: () => ({ time: run.end, step: history.steps }),
    cursor: () => ({ time: run.time, step: Math.min(run.step, history.steps) }),
    setCursor(point) { if (point) { if (run.transitions) run.go(point.step); else run.goToTime(point.time); } },
    href: address,
    go(path, isReplaced) {
      if (isReplaced) window.history.replaceState(null, "", address(path)); else location.hash = address(path);
      route();
    },
    lines(from, to) {
      const first = run.upTo(lines, from.time - 1, (row) => row[1]), end = run.upTo(lines, to.time, (row) => row[1]);
      return lines.slice(first, end).map((row) => pointAt(row[0], row[1], { level: row[2], component: data.components[row[3]], text: row[4] }));
    },
    links: () => [],
  };
  const timeline = new cx.Timeline(host, { embedded: true, lanes });
  cx.timeline = timeline;
  get("timeline-place").append(timeline.box);
  function route() {
    if (location.hash.startsWith("#/timeline")) timeline.show(cx.pathOf(location.hash.slice(2).split("/").slice(1).map(decode)));
    else if (location.hash === "") timeline.show({});
  }
  window.addEventListener("hashchange", route);
  route();

  // the bar
  const slider = get("moment"), output = get("told");
  slider.max = run.steps.length;
  slider.disabled = !run.steps.length;
  slider.addEventListener("input", () => run.go(Number(slider.value)));
  get("back").addEventListener("click", () => run.go(run.moment - 1));
  get("forth").addEventListener("click", () => run.go(run.moment + 1));
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input, select, textarea")) return;
    if (event.key === "," || event.key === ".") run.go(run.moment + (event.key === "." ? 1 : -1));
  });
  function showStep() {
    slider.value = run.moment;
    const step = run.steps[run.moment - 1];
    const text = !run.steps.length ? "nothing happened" : run.moment === run.steps.length ? "the end, " + run.seconds(run.time)
      : run.moment ? run.seconds(run.time) + ", " + step.line : run.seconds(run.time) + ", before the first";
    output.textContent = cx.visible("step " + run.moment + " of " + run.steps.length + ": " + text);
    slider.setAttribute("aria-valuetext", output.textContent);
  }
  run.onChange(() => { showStep(); timeline.later(); });
  showStep();
})();
