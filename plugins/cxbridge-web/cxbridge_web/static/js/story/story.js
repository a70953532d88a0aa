// The story of a run, beside the timeline while no goal is chosen: outcome, wanted goals, present skills,
// failures and their reasons.
import { escapePart } from "cx/api.js";
import { capital, dim, durationText, el, link, listSection, none, plural, timeOfDay } from "cx/dom.js";
import { linked } from "cx/links.js";
import { goalOutcome, isOpen, OUTCOME_NAMES, outcomeBadge, OUTCOMES } from "cx/outcome.js";
import { causes, errorOf, forestOf, lateCalls, overcomeFailures, reasonOf } from "cx/story/causes.js";
import { pathTo } from "cx/timeline/host.js";
import { outcomeAt } from "cx/timeline/spans.js";
import { ask, causeList } from "cx/why.js";

const MOST_ENTRIES = 6, // of a list
  ASK_MS = 3000, // the shortest time between two questions to the server
  STILL_US = 5e6; // a run without transitions for this time stands still
// the order of the root goals by outcome
const RANK = { failed: 0, running: 1, formulated: 2, rejected: 3, completed: 4, retracted: 5 };

export class Story {
  constructor(host) {
    this.host = host;
    this.answers = []; // the server's answers to why, {env, headline, wrong, unknown} of each agent
    this.question = ""; // identifies the last question to the server
    this.askedAt = -Infinity;
    this.showsAllReasons = false; // the user has opened their list
  }

  /** Whether the run is over; a recording always is. */
  get isOver() {
    const { app, isLive } = this.host;
    return !isLive || Boolean(app.status?.result);
  }
  /** Whether a run has had no transition for STILL_US. */
  get isStill() {
    const { history } = this.host;
    return history.steps > 0 && this.host.now().time - history.stepTimes.at(-1) > STILL_US;
  }

  /** Identifies the content of the story, which is drawn again when this value changes. */
  sign() {
    const { history, isLive } = this.host;
    return [history.revision, this.answers, isLive ? Math.floor(this.host.now().time / 1e6) : 0];
  }

  /**
   * Ask the server why after further failures or a standstill, at most once in ASK_MS.
   * @param onAnswer called when the server has answered
   */
  async ask(wrongGoals, onAnswer) {
    const { app } = this.host,
      question = JSON.stringify([wrongGoals.map(({ key }) => key), this.isStill]);
    if (!wrongGoals.length || question === this.question || performance.now() - this.askedAt < ASK_MS) return;
    this.question = question;
    this.askedAt = performance.now();
    const answerOf = async (env) => ({ env, ...(await ask(app, "run", "", env)) }),
      envs = new Set(wrongGoals.map(({ env }) => env)),
      answers = await Promise.allSettled([...envs].map(answerOf));
    // without a server, the causes in the events remain
    this.answers = answers.flatMap(({ value }) => value ?? []);
    if (this.answers.length) onAnswer();
  }

  /** Return the node of the story. @param onAnswer see ask() */
  draw(onAnswer) {
    const { history, isLive } = this.host,
      now = this.host.now(),
      roots = [...forestOf(history).roots].sort((a, b) => RANK[outcomeAt(a)] - RANK[outcomeAt(b)]);
    if (!roots.length && !history.calls.length)
      return none(
        "Nothing has happened yet",
        isLive ? "The story begins with the first goal." : "There is no goal in this recording.",
      );
    const open = history.calls.filter(({ end }) => !end);
    const late = lateCalls(history, now.time),
      failed = roots.filter((goal) => outcomeAt(goal) === "failed"),
      waiting = roots.filter((goal) => isOpen(outcomeAt(goal))),
      isStanding = waiting.length > 0 && !open.length && (this.isOver || this.isStill);
    this.isStanding = isStanding;
    const wrongGoals = isStanding ? [...failed, ...waiting] : failed;
    this.ask(wrongGoals, onAnswer);
    return el(
      "div.story",
      this.headline(roots, waiting, isStanding, now),
      this.section("Wanted", roots, (goal) => this.goalEntry(goal)),
      (isLive || waiting.length > 0) &&
        this.section(isLive ? "Now" : "At the end", open, (call) => this.callEntry(call, late, now)),
      this.reasonSection(wrongGoals),
      this.section("Failed on the way", overcomeFailures(history), (goal) => this.failureEntry(goal), true),
      this.countLine(),
    );
  }

  /** @param waiting the open root goals @param isStanding whether nothing happens although goals are open */
  headline(roots, waiting, isStanding, now) {
    const { history, app } = this.host,
      { isOver } = this,
      worst = waiting.length || !roots.length ? "running" : outcomeAt(roots[0]),
      // a daemon may run for hours before its first goal
      zero = isOver || worst === "running" ? app.zero : null,
      begin = zero ?? history.begin ?? now.time,
      last = history.stepTimes.at(-1) ?? begin,
      lasted = (end) => durationText(Math.max(0, end - begin));
    let text = capital(OUTCOMES[worst].word);
    if (isStanding && !isOver) text = "Nothing has happened for " + durationText(now.time - last);
    else if (isStanding) text = "It stopped after " + lasted(history.time) + ", before its goals were over";
    else if (worst === "running")
      text = isOver ? "It ran for " + lasted(history.time) : "Running for " + lasted(now.time);
    else text += (worst === "completed" ? " in " : " after ") + lasted(last);
    // an agent whose goals are not selected may be at rest
    const isBad = isOver || waiting.some((goal) => outcomeAt(goal) === "running"),
      tone = isStanding ? (isBad ? "failed" : "formulated") : worst,
      reason =
        roots.map((goal) => reasonOf(goal, history)).find(Boolean) ||
        (isStanding && this.answers[0]?.headline);
    return el(
      "div",
      { class: "story-head o-" + tone, title: "began at " + timeOfDay(begin) },
      el.h2(el.i({ "aria-hidden": "true" }, isStanding ? "!" : OUTCOMES[worst].icon), " ", text),
      reason ? el.p(linked(app, reason)) : null,
    );
  }

  section(title, items, entry, isLatest = false) {
    return listSection(title, items, entry, { most: MOST_ENTRIES, isLatest });
  }
  link(item, text) {
    return link(this.host.href(pathTo(item)), text);
  }
  goalEntry(goal) {
    const outcome = outcomeAt(goal);
    return [
      this.link(goal, goal.id),
      goal.cls && !goal.id.includes(goal.cls) ? dim(" " + goal.cls) : null,
      " ",
      outcome === "completed"
        ? dim("✓ completed")
        : outcomeBadge(...(outcome === "running" && this.isStanding ? ["formulated", "waiting"] : [outcome])),
    ];
  }
  failureEntry(goal) {
    return [this.link(goal, goal.id), " ", reasonOf(goal, this.host.history) || errorOf(goal)];
  }
  /** @param late the late calls, see lateCalls() */
  callEntry(call, late, now) {
    const longestUs = late.get(call);
    return [
      el.b(call.skiller),
      " ",
      this.link(call, call.text),
      dim(" for " + durationText(Math.max(0, now.time - call.begin.time))),
      longestUs ? el("span.late", "late: at most " + durationText(longestUs) + " before") : null,
    ];
  }

  /** The deepest reason in an answer of the server, in words. */
  rootCause({ wrong }) {
    let cause = wrong.find(({ because }) => because.length);
    while (cause?.because.length) [cause] = cause.because;
    return cause ? cause.text : wrong[0].text;
  }
  /** The section with the causes of each goal, and the server's answers; null without goals. */
  reasonSection(goals) {
    if (!goals.length) return null;
    const { app, history } = this.host,
      answers = this.answers.filter(({ wrong }) => wrong.length),
      envs = goals.map(({ env }) => env),
      hasManyAgents = new Set(envs).size > 1;
    const chains = goals.slice(0, MOST_ENTRIES).map((goal, at) => {
      const list = chain(this.host, goal, history, hasManyAgents),
        // the server's answer is about an agent: it stands at the agent's first goal
        answer = envs.indexOf(goal.env) === at && answers.find(({ env }) => env === goal.env),
        isKnown = causes(goal, history).at(-1).item.kind === "skill";
      if (answer && !isKnown) list.append(el.li(dim("because "), el.b(linked(app, this.rootCause(answer)))));
      return list;
    });
    const reasons = ({ env, wrong, unknown }) => [
      hasManyAgents && el.h4(env),
      causeList(app, wrong),
      (unknown || []).map((text) => el("p.dim.small", text)),
    ];
    const rememberOpen = ({ target }) => {
      this.showsAllReasons = target.open;
    };
    return el(
      "section.story-why",
      el.h3("What went wrong, and why"),
      chains,
      answers.length > 0 &&
        el.details(
          { open: this.showsAllReasons, on: { toggle: rememberOpen } },
          el.summary("All reasons, with the rules that decided"),
          answers.map(reasons),
        ),
    );
  }

  countLine() {
    const { goals, calls, errors } = this.host.history,
      outcomes = [...goals.values()].map((goal) => goalOutcome(goal.changes.at(-1))),
      counts = OUTCOME_NAMES.map((name) => [name, outcomes.filter((each) => each === name).length]);
    return el(
      "p.dim.story-counts",
      plural(goals.size, "goal") + ": ",
      counts
        .filter(([, count]) => count)
        .map(([name, count], at) => [
          at ? ", " : "",
          link("#/goals?goal=&outcome=" + escapePart(name), count + " " + OUTCOMES[name].word),
        ]),
      ". " + plural(calls.length, "skill call") + ". ",
      errors.length
        ? link("#/log?time=" + errors[0].time, plural(errors.length, "error") + " in the log")
        : "No errors in the log.",
    );
  }
}

/** The causes of an item as a list. @param namesAgent whether the first line names the agent */
export function chain(host, item, history, namesAgent = false) {
  const word = isOpen(outcomeAt(item)) ? "waits for " : "because ";
  return el(
    "ol.tl-why",
    causes(item, history).map(({ text, path }, at) =>
      el.li(at ? dim(word) : namesAgent && dim(item.env + ": "), link(host.href(path), text)),
    ),
  );
}
