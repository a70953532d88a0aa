// The story of a run, beside the timeline while nothing is chosen: its outcome, the goals that were wanted, what the
// robots do now, and what went wrong and why.
import { part } from "cx/api.js";
import { durationText, el, none, timeOfDay } from "cx/dom.js";
import { linked } from "cx/links.js";
import { goalOutcome, isOpen, NAMES, OUTCOMES, outcomeBadge } from "cx/outcome.js";
import { causes, errorOf, forestOf, lateAfter, longestOf, overcome, reasonOf } from "cx/story/causes.js";
import { pathTo } from "cx/timeline/path.js";
import { outcomeAt } from "cx/timeline/spans.js";
import { ask, causeList } from "cx/why.js";

const MOST = 6,
  ASK_MS = 3000,
  STILL_US = 5e6; // without a transition for so long a run stands still
const RANK = { failed: 0, running: 1, formulated: 2, rejected: 3, completed: 4, retracted: 5 };

export class Story {
  /** @param host of the timeline */
  constructor(host) {
    this.host = host;
    this.answer = null; // of the server to why
    this.asked = "";
    this.askedAt = -Infinity;
    this.tellsAll = false;
  }

  /** Whether the run is over, as a recording is. */
  get isOver() {
    const { app, isLive } = this.host;
    return !isLive || Boolean(app.status?.result);
  }
  get isStill() {
    const { history } = this.host;
    return history.steps > 0 && this.host.now().time - history.stepTimes.at(-1) > STILL_US;
  }

  /** Changes when the story has to be drawn again. */
  sign() {
    const { history, isLive } = this.host;
    return [history.revision, this.answer, isLive ? Math.floor(this.host.now().time / 1e6) : 0];
  }

  /** Ask the server why, when other goals have failed or the run stands still, and not too often. */
  ask(bad, later) {
    const { app } = this.host,
      wanted = JSON.stringify([bad.map(({ key }) => key), this.isStill]);
    if (!bad.length || wanted === this.asked || performance.now() - this.askedAt < ASK_MS) return;
    this.asked = wanted;
    this.askedAt = performance.now();
    ask(app, "run", "", bad[0].env).then(
      (data) => {
        this.answer = data;
        later();
      },
      () => {}, // nothing explains this run: the events tell what they can
    );
  }

  /** @param later called when there is more to draw */
  draw(later) {
    const { history, isLive } = this.host,
      now = this.host.now(),
      roots = [...forestOf(history).roots].sort((a, b) => RANK[outcomeAt(a)] - RANK[outcomeAt(b)]);
    if (!roots.length && !history.calls.length)
      return none(
        "Nothing has happened yet",
        isLive ? "The story begins with the first goal." : "There is no goal in this recording.",
      );
    const open = history.calls.filter(({ end }) => !end),
      longest = open.length ? longestOf(history) : null,
      failed = roots.filter((goal) => outcomeAt(goal) === "failed"),
      waiting = roots.filter((goal) => isOpen(outcomeAt(goal))),
      stands = waiting.length > 0 && !open.length && (this.isOver || this.isStill),
      wrong = stands ? [...failed, ...waiting] : failed;
    this.ask(wrong, later);
    return el(
      "div.story",
      this.headline(roots, waiting, stands, now),
      this.section(
        "Wanted",
        roots.slice(0, MOST).map((goal) => this.goal(goal)),
        roots.length - MOST,
      ),
      open.length && (isLive || waiting.length)
        ? this.section(
            isLive ? "Now" : "At the end",
            open.slice(0, MOST).map((call) => this.call(call, longest, now)),
            open.length - MOST,
          )
        : null,
      this.wrong(wrong),
      this.overcome(overcome(history)),
      this.counts(),
    );
  }

  headline(roots, waiting, stands, now) {
    const { history } = this.host,
      { isOver } = this,
      begin = history.begin ?? now.time,
      last = history.stepTimes.at(-1) ?? begin,
      worst = waiting.length || !roots.length ? "running" : outcomeAt(roots[0]),
      lasted = (end) => durationText(Math.max(0, end - begin));
    let text = OUTCOMES[worst].word[0].toUpperCase() + OUTCOMES[worst].word.slice(1);
    if (stands && !isOver) text = "Nothing has happened for " + durationText(now.time - last);
    else if (stands) text = "It stopped after " + lasted(history.time) + ", before its goals were over";
    else if (worst === "running")
      text = isOver ? "It ran for " + lasted(history.time) : "Running for " + lasted(now.time);
    else text += (worst === "completed" ? " in " : " after ") + lasted(last);
    // an agent that waits for its first goal to be selected may be at rest
    const isBad = isOver || waiting.some((goal) => outcomeAt(goal) === "running"),
      tone = stands ? (isBad ? "failed" : "formulated") : worst;
    const reason =
      roots.map((goal) => reasonOf(goal, history)).find(Boolean) ||
      (stands && this.rootCause({ withSubject: true }));
    return el.div(
      { class: "story-head o-" + tone, title: "began at " + timeOfDay(begin) },
      el.h2(el.i({ "aria-hidden": "true" }, stands ? "!" : OUTCOMES[worst].icon), " ", text),
      reason ? el.p(reason) : null,
    );
  }

  section(title, items, more = 0) {
    if (!items.length) return null;
    return el.section(
      el.h3(title),
      el(
        "ul.tl-list",
        items.map((item) => el.li(item)),
        more > 0 ? el("li.dim", "and " + more + " more") : null,
      ),
    );
  }
  link(item, text) {
    return el.a({ href: this.host.href(pathTo(item)) }, text);
  }
  goal(goal) {
    const outcome = outcomeAt(goal);
    return [
      this.link(goal, goal.id),
      goal.cls && !goal.id.includes(goal.cls) ? el("span.dim", " " + goal.cls) : null,
      " ",
      outcome === "completed" ? el("span.dim", "✓ completed") : outcomeBadge(outcome),
    ];
  }
  call(call, longest, now) {
    const before = lateAfter(call, longest, now.time);
    return [
      el.b(call.skiller),
      " ",
      this.link(call, call.text),
      el("span.dim", " for " + durationText(Math.max(0, now.time - call.begin.time))),
      before ? el("span.late", "late: at most " + durationText(before) + " before") : null,
    ];
  }

  /** The sentences from a goal down to the deepest reason that the server gives; none without an answer. */
  reasons() {
    const texts = [];
    let cause = this.answer?.wrong?.find(({ because }) => because.length);
    for (; cause; [cause] = cause.because) texts.push(cause.text);
    return texts;
  }
  /** The deepest reason; with the sentence above it when only that one names the subject. */
  rootCause({ withSubject = false } = {}) {
    const [above = "", text = ""] = this.reasons().slice(-2);
    return withSubject && /^its? /.test(text) ? `${above}: ${text}` : text || above;
  }
  wrong(goals) {
    if (!goals.length) return null;
    const { app, history } = this.host,
      told = this.answer?.wrong || [],
      way = goals.slice(0, MOST).map((goal) => chain(this.host, goal, history)),
      isKnown = causes(goals[0], history).at(-1).item.kind === "skill";
    if (!isKnown && told.length)
      way[0].append(el.li(el("span.dim", "because "), el.b(linked(app, this.rootCause()))));
    return el(
      "section.story-why",
      el.h3("What went wrong, and why"),
      way,
      told.length
        ? el.details(
            { open: this.tellsAll, on: { toggle: ({ target }) => (this.tellsAll = target.open) } },
            el.summary("All reasons, with the rules that decided"),
            causeList(app, told),
            (this.answer.unknown || []).map((text) => el("p.dim.small", text)),
          )
        : null,
    );
  }
  overcome(goals) {
    const { history } = this.host;
    return this.section(
      "Failed on the way",
      goals
        .slice(-MOST)
        .map((goal) => [this.link(goal, goal.id), " ", reasonOf(goal, history) || errorOf(goal)]),
      goals.length - MOST,
    );
  }

  counts() {
    const { history } = this.host,
      goals = [...history.goals.values()],
      counts = Object.fromEntries(NAMES.map((name) => [name, 0]));
    for (const goal of goals) counts[goalOutcome(goal.changes.at(-1))] += 1;
    return el(
      "p.dim.story-counts",
      goals.length + (goals.length === 1 ? " goal: " : " goals: "),
      NAMES.filter((name) => counts[name]).map((name, at) => [
        at ? ", " : "",
        el.a({ href: "#/goals?goal=&outcome=" + part(name) }, counts[name] + " " + OUTCOMES[name].word),
      ]),
      ". " + history.calls.length + " skill calls. ",
      history.errors.length
        ? el.a(
            { href: "#/log?time=" + history.errors[0].time },
            history.errors.length + (history.errors.length === 1 ? " error" : " errors") + " in the log",
          )
        : "No errors in the log.",
    );
  }
}

/** The way from an item to the first cause, a line each. */
export function chain(host, item, history) {
  const way = causes(item, history),
    link = isOpen(outcomeAt(item)) ? "waits for " : "because ";
  return el(
    "ol.tl-why",
    way.map(({ text, path }, at) =>
      el.li(at ? el("span.dim", link) : null, el.a({ href: host.href(path) }, text)),
    ),
  );
}
