// Beside the timeline: what is chosen, from the goal to its action, its skill call, its log lines and its why.
import { button, durationText, el, none, pairs } from "cx/dom.js";
import { goalOutcome, actionOutcome, outcomeBadge } from "cx/outcome.js";
import { axisText } from "cx/timeline/paint.js";
import { pathTo, resolve } from "cx/timeline/path.js";
import { outcomeAt, timesOf } from "cx/timeline/spans.js";
import { causes, errorsAt } from "cx/timeline/why.js";

const MOST = 200; // entries of a list

export class Detail {
  /** @param timeline the component: {history, host, now} */
  constructor(timeline) {
    this.timeline = timeline;
    this.box = el("aside", { class: "tl-detail", "aria-label": "Details", hidden: true });
    this.sign = "";
    this.answer = null; // of the daemon, to why
  }

  get history() {
    return this.timeline.history;
  }
  href(path) {
    return this.timeline.host.href(path);
  }

  draw(path) {
    const levels = resolve(path, this.history),
      { item } = levels,
      isEmpty = !path.goal && !path.skill;
    this.box.hidden = isEmpty;
    if (isEmpty) {
      this.sign = "";
      return;
    }
    const { now } = this.timeline;
    const sign = JSON.stringify([
      path,
      this.history.revision,
      this.answer,
      item && outcomeAt(item) === "running" ? Math.floor(now.time / 1e6) : 0,
    ]);
    if (sign === this.sign) return;
    this.sign = sign;
    const focused = this.box.contains(document.activeElement)
      ? document.activeElement.getAttribute("href")
      : null;
    this.box.replaceChildren(
      this.crumbs(path, levels),
      ...(item ? this.content(path, item) : [none("It is not there", "Not yet, or not any more.")]),
    );
    if (focused) {
      const again = [...this.box.querySelectorAll("a")].find((a) => a.getAttribute("href") === focused);
      if (again) again.focus();
    }
  }

  /** From the whole down to what is shown: each level leads back. */
  crumbs(path, { goal, action, call }) {
    const entries = [["All", {}]];
    if (goal) entries.push([goal.id, { goal: path.goal }]);
    if (action) entries.push([action.id + " " + action.text, { goal: path.goal, action: path.action }]);
    if (call) entries.push([call.text, { ...path, what: undefined }]);
    if (path.what) entries.push([path.what === "log" ? "Log" : "Why", path]);
    return el(
      "nav",
      { class: "tl-crumbs", "aria-label": "Breadcrumb" },
      el(
        "ol",
        {},
        entries.map(([text, to], at) =>
          el(
            "li",
            {},
            at === entries.length - 1
              ? el("b", { "aria-current": "page" }, text)
              : el("a", { href: this.href(to) }, text),
          ),
        ),
      ),
      el("a", { class: "tl-close", href: this.href({}), "aria-label": "close", title: "close" }, "✕"),
    );
  }

  content(path, item) {
    if (path.what === "log") return this.log(item);
    if (path.what === "why") return this.why(item);
    const more = el(
      "p",
      { class: "tl-more" },
      el("a", { href: this.href({ ...path, what: "log" }) }, "Log lines"),
      el("a", { href: this.href({ ...path, what: "why" }) }, "Why"),
      ...this.timeline.host.links(path).map(([href, text]) => el("a", { href }, text)),
      button("Zoom to it", () => this.timeline.zoomToSelection(), { class: "quiet" }),
    );
    const body =
      item.kind === "goal" ? this.goal(item) : item.kind === "action" ? this.action(item) : this.call(item);
    return [...body, more];
  }

  at(point) {
    const { host } = this.timeline;
    return button(axisText(point.time, 0.001, 1e6, host.zero), () => host.setCursor(point), {
      class: "tl-time",
      title: "go to this moment",
    });
  }
  head(title, outcome, text) {
    return el("h3", {}, title + " ", outcomeBadge(outcome, text));
  }
  times(item) {
    const { begin, start, end, waited, ran } = timesOf(item, this.history),
      soFar = start && !end ? this.timeline.now.time - start.time : null;
    return [
      ["began", this.at(begin)],
      ["waited", waited ? durationText(waited) : ""],
      [
        "ran",
        ran !== null ? durationText(ran) : soFar !== null ? durationText(Math.max(0, soFar)) + " so far" : "",
      ],
      ["ended", end ? this.at(end) : ""],
    ];
  }
  list(title, items, entry) {
    if (!items.length) return null;
    return el(
      "section",
      {},
      el("h4", {}, title),
      el(
        "ul",
        { class: "tl-list" },
        items.slice(0, MOST).map((each) => el("li", {}, entry(each))),
      ),
      items.length > MOST ? el("p", { class: "dim" }, "and " + (items.length - MOST) + " more") : null,
    );
  }
  link(item, text) {
    return [
      outcomeBadge(outcomeAt(item) || "formulated"),
      " ",
      el("a", { href: this.href(pathTo(item)) }, text),
    ];
  }

  goal(goal) {
    const { error } = goal.changes.findLast((each) => each.error) || {},
      children = [...this.history.goals.values()].filter((each) => each.parent === goal.key),
      parent = this.history.goals.get(goal.parent);
    return [
      this.head("Goal " + goal.id, outcomeAt(goal), undefined),
      error ? el("p", { class: "error-box" }, error) : null,
      pairs([
        ["class", goal.cls === goal.id ? "" : goal.cls],
        ["sub-type", goal.subType],
        ["parent", parent ? el("a", { href: this.href({ goal: parent.key }) }, parent.id) : ""],
        ...this.times(goal),
        ["environment", goal.env === "executive" ? "" : goal.env],
      ]),
      this.list("Plan", goal.actions, (action) => this.link(action, action.id + " " + action.text)),
      this.list("Sub-goals", children, (child) => this.link(child, child.id)),
      this.list("Transitions", goal.changes, (change) => [
        this.at(change),
        " ",
        outcomeBadge(
          goalOutcome(change),
          change.mode + (change.outcome === "UNKNOWN" ? "" : " " + change.outcome),
        ),
      ]),
    ].filter(Boolean);
  }
  action(action) {
    const { calls } = action,
      probably = calls.some((call) => call.guessed);
    return [
      this.head("Action " + action.id + " " + action.text, outcomeAt(action)),
      pairs([["plan", action.plan], ...this.times(action)]),
      this.list(probably ? "Probably its skill calls" : "Skill calls", calls, (call) =>
        this.link(call, call.skiller + ": " + call.text),
      ) || el("p", { class: "dim" }, "No skill call is known for it."),
      this.list("States", action.changes, (change) => [
        this.at(change),
        " ",
        outcomeBadge(actionOutcome(change.state), change.state),
      ]),
    ].filter(Boolean);
  }
  call(call) {
    return [
      this.head("Skill", outcomeAt(call)),
      el("p", {}, el("code", {}, call.text)),
      call.error ? el("p", { class: "error-box" }, call.error) : null,
      pairs([
        ["robot", call.skiller],
        [
          call.guessed ? "probably of" : "of",
          call.action ? el("a", { href: this.href(pathTo(call.action)) }, call.action.text) : "",
        ],
        ...this.times(call),
        ["status", call.status],
      ]),
    ].filter(Boolean);
  }

  log(item) {
    const { begin, end } = timesOf(item, this.history),
      lines = this.timeline.host.lines(begin, end || this.timeline.now);
    if (!lines.length) return [none("No log lines", "Nothing was logged in this time.")];
    return [
      el("h3", {}, "Log lines in its time ", el("span", { class: "dim" }, String(lines.length))),
      el(
        "ol",
        { class: "tl-log" },
        lines
          .slice(0, MOST)
          .map((line) => this.logLine(line, el("span", { class: "dim" }, line.component + ": "), line.text)),
      ),
      lines.length > MOST ? el("p", { class: "dim" }, "and " + (lines.length - MOST) + " more") : null,
    ].filter(Boolean);
  }

  /** A line of the log: its moment, its level, and what it says. */
  logLine(line, ...words) {
    return el(
      "li",
      {},
      this.at(line),
      " ",
      el("b", { class: "lv lv-" + line.level }, line.level),
      " ",
      words,
    );
  }

  why(item) {
    const chain = causes(item, this.history),
      last = chain.at(-1).item,
      lines = errorsAt(last, this.history);
    const { host } = this.timeline;
    if (host.explain && item.kind === "goal" && (!this.answer || this.answer.key !== item.key)) {
      this.answer = { key: item.key, lines: [] };
      host.explain(item).then((answer) => {
        this.answer = { key: item.key, lines: answer };
        this.timeline.later();
      });
    }
    const answer = this.answer && this.answer.key === item.key ? this.answer.lines : [];
    return [
      el("h3", {}, "Why"),
      el(
        "ol",
        { class: "tl-why" },
        chain.map(({ outcome, text, path }) =>
          el("li", {}, outcomeBadge(outcome), " ", el("a", { href: this.href(path) }, text)),
        ),
        lines.map((line) => this.logLine(line, line.component + ": " + line.text)),
      ),
      answer.length
        ? el(
            "details",
            {},
            el("summary", {}, "The executive's explanation"),
            el("pre", {}, answer.join("\n")),
          )
        : null,
    ].filter(Boolean);
  }
}
