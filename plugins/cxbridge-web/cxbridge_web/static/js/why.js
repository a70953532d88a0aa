// Why a goal came to its outcome or what it waits for, why a rule has not fired, and the story of a run: the
// answers of `cxbridge why` as lists of reasons, with links.
import { escapePart, get } from "cx/api.js";
import { button, el, link, note, refill, secondsText } from "cx/dom.js";
import { linked } from "cx/links.js";
import { MAIN_ENV } from "cx/names.js";

const ruleLink = (name) => link("#/clips/rules/" + escapePart(name), name);
const small = (...children) => el("p.dim.small", ...children);

/**
 * Ask why. A recording is asked about its chosen moment, and about its end for the story of the run.
 * @param kind goal, action, rule, fact, or run, which has no name
 * @param env the environment; a daemon knows its executive's only
 * @returns {Promise<object>} the values of the answer; rejected where nothing explains the run
 */
export async function ask(app, kind, name = "", env = MAIN_ENV) {
  const { recording } = app;
  if (!recording || recording.isPast) {
    const query = kind === "run" ? "" : "?" + kind + "=" + escapePart(name);
    return (await get("cxbridge/why" + query)).data;
  }
  if (!recording.why) throw new Error("Why is not known here: open the recording with 'cxbridge view'");
  return recording.why(kind, name, env);
}

/** Whether something answers why in an environment: a daemon explains its executive's only. */
export const canAsk = (app, env) =>
  app.recording && !app.recording.isPast ? Boolean(app.recording.why) : (env || MAIN_ENV) === MAIN_ENV;

/** Ask why, and show the answer or the error. @param question see ask() @param show(node) */
export async function showAnswer(app, question, show) {
  show(note("…"));
  try {
    const explanation = await ask(app, ...question);
    show("verdict" in explanation ? ruleWhy(app, explanation) : goalWhy(app, explanation));
  } catch (error) {
    show(el("p.error-box", error.message));
  }
}

/**
 * A button that asks why (null if nothing answers), and the box of the answer.
 * @param about attributes of both
 */
export function whyBox(app, kind, name, env, about) {
  const box = el.div(about.box),
    show = (node) => refill(box, el.h3("Why"), node),
    call = () => showAnswer(app, [kind, name, env], show);
  return { button: canAsk(app, env) ? button("Why?", call, about.button) : null, box };
}

const causeItems = (items) => (items.length ? el("ul.causes", items) : null);
/** Causes as nested lists. @param rules names of rules, which become links */
export const causeList = (app, list, rules) =>
  causeItems(
    list.map(({ text, because }) => el.li(linked(app, text, rules), causeList(app, because, rules))),
  );

/** The folded list of a story's transitions, each with the last rule before it; null without transitions. */
function momentList(app, list, rules) {
  if (!list.length) return null;
  const item = ({ seconds, text, rules: firedBefore }) => {
    const rule = firedBefore.at(-1),
      by = rule && el("span.dim.small", "  by ", ruleLink(rule));
    return el.li(el("span.dim.n", secondsText(seconds)), " ", linked(app, text.trim(), rules), by);
  };
  return el.details(el.summary("Step by step (" + list.length + ")"), el("ol.history", list.map(item)));
}
/** The small lines below an answer. */
const foot = ({ where, notes }) => [small("in " + where), (notes || []).map((text) => small(text))];

/**
 * A line with the rule that made the plan, the last that fired before the goal was EXPANDED; null without a
 * rule.
 */
function planRuleLine(list) {
  const { seconds, rules } = list.findLast(({ text }) => text.trim() === "EXPANDED") || { rules: [] };
  return rules.length
    ? small("The plan is of rule ", ruleLink(rules.at(-1)), ", at " + secondsText(seconds))
    : null;
}

/**
 * The answer about a goal, action or fact. @param explanation of GET /cxbridge/why?goal=, ?action= or ?fact=
 */
function goalWhy(app, explanation) {
  const stories = explanation.goals || explanation.actions || [explanation],
    fired = stories.flatMap((story) => story.moments.flatMap((moment) => moment.rules)),
    rules = new Set([...(explanation.rules || []), ...fired]);
  const section = ({ cause, moments: list }) =>
    el.section(
      el("p.cause", linked(app, cause.text, rules)),
      causeList(app, cause.because, rules),
      planRuleLine(list),
      momentList(app, list, rules),
    );
  return el("div.why", stories.map(section), foot(explanation));
}

// outcome (for the colour), icon and word of a condition
const ICONS = {
  yes: ["completed", "✓", "yes"],
  no: ["failed", "✗", "no"],
  now: ["formulated", "✗", "not now"],
  unknown: ["formulated", "–", "not reached"],
};
/** A number of matches; `more`: the number is only a lower bound. */
const matches = ({ number, more }) => number + (more ? " or more" : "");

/**
 * The conditions of a rule, with the numbers of their matches alone and joined with the conditions before.
 */
function conditionList({ elements: list, failing, fired }) {
  const item = ({ number, text, alone, joined }) => {
    const isFailing = failing === number,
      isNo = isFailing || joined?.number === 0,
      // a rule that has fired is no failure
      [outcome, icon, word] = ICONS[isNo ? (fired ? "now" : "no") : joined ? "yes" : "unknown"];
    return el.li(
      { class: isFailing ? (fired ? "failing fired" : "failing") : "" },
      el.i({ class: "dot outcome o-" + outcome, "aria-label": word }, icon),
      el("code.source", text),
      el(
        "span.dim.small.n",
        [
          "condition " + number,
          alone && matches(alone) + (alone.number === 1 ? " fact alone" : " facts alone"),
          joined &&
            matches(joined) + (joined.number === 1 ? " match" : " matches") + " with the conditions before",
        ]
          .filter(Boolean)
          .join(", "),
      ),
    );
  };
  return el("ol.elements", list.map(item));
}

/** A node that names the rule that asserted a fact, as soon as the server has answered. */
function assertingRule(app, text) {
  const place = el("span.dim.small"),
    [name] = /^f-\d+/.exec(text) || [];
  const showRule = ({ rules = [] }) => rules.length && refill(place, " asserted by ", ruleLink(rules[0]));
  // a recording without firings does not know the rule
  if (name) ask(app, "fact", name, app.env).then(showRule, () => {});
  return place;
}

/**
 * The reason why a condition has no match.
 * @param explained near: facts that nearly match; facts: facts that match a `not` or violate a `forall`;
 * inner: the failures of parts
 */
function failure(app, { reason, near, facts = [], inner }) {
  const deviation = ({ slot, value, wanted }) =>
    el.li("slot ", el.b(slot), " has ", el.code(value), ", wanted ", el.code(wanted));
  const items = near.map(({ fact, deviations }) =>
    el.li(linked(app, fact), assertingRule(app, fact), causeItems(deviations.map(deviation))),
  );
  const matching = facts.map((fact) => el.li(linked(app, fact), assertingRule(app, fact)));
  return el.div(
    el.p(linked(app, reason)),
    causeItems([...items, ...matching, ...inner.map((each) => el.li(failure(app, each)))]),
  );
}

/** The answer about a rule. @param explanation of GET /cxbridge/why?rule= */
function ruleWhy(app, explanation) {
  const { verdict, bases, fired, last_fired: last, errors } = explanation,
    // a text, or a list of texts
    joinTexts = (list, by) => [list].flat().join(by);
  return el(
    "div.why",
    el("p.cause", linked(app, verdict)),
    explanation.elements ? conditionList(explanation) : null,
    explanation.failure ? failure(app, explanation.failure) : null,
    bases?.length > 0 &&
      el.p("It matches: ", linked(app, bases.map((basis) => joinTexts(basis, ", ")).join("; "))),
    last &&
      note(
        "Fired " + fired + "×, last at " + secondsText(last.seconds) + ": ",
        linked(app, joinTexts(last.facts, " ")),
      ),
    (errors || []).map((error) => el("p.error-box", joinTexts(error, " "))),
    foot(explanation),
  );
}
