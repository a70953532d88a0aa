// Why a goal came to its outcome or what it waits for, why a rule has not fired, and the story of a run: the answers
// of `cxbridge why` as lists of reasons, with links.
import { get, part } from "cx/api.js";
import { highlighted } from "cx/clips/source.js";
import { button, el } from "cx/dom.js";
import { linked } from "cx/links.js";
import { MAIN_ENV } from "cx/names.js";

const clock = (seconds) => seconds.toFixed(3) + " s";
const ruleLink = (name) => el.a({ href: "#/clips/rules/" + part(name) }, name);

/**
 * Ask why. A recording is asked about its chosen moment, and about its end for the story of the run.
 * @param kind goal, action, rule, fact, or run, which has no name
 * @param env the environment; a daemon knows its executive's only
 * @returns {Promise<object>} the values of the answer; rejected where nothing explains the run
 */
export async function ask(app, kind, name = "", env = MAIN_ENV) {
  const { recording } = app;
  if (!recording || recording.isPast) {
    const query = kind === "run" ? "" : "?" + kind + "=" + part(name);
    return (await get("cxbridge/why" + query)).data;
  }
  if (!recording.why) throw new Error("Why is not known here: open the recording with 'cxbridge view'");
  return recording.why(kind, name, env);
}

/** Reasons of reasons. @param list of {text, because} */
export function causeList(app, list, rules) {
  if (!list.length) return null;
  return el(
    "ul.causes",
    list.map((cause) => el.li(linked(app, cause.text, rules), causeList(app, cause.because, rules))),
  );
}

function moments(app, list, rules) {
  if (!list.length) return null;
  return el.details(
    el.summary("Step by step (" + list.length + ")"),
    el(
      "ol.history",
      list.map((moment) =>
        el.li(
          el("span.dim.n", clock(moment.seconds)),
          " ",
          linked(app, moment.text.trim(), rules),
          moment.rules.length ? el("span.dim.small", "  by ", ruleLink(moment.rules.at(-1))) : null,
        ),
      ),
    ),
  );
}

const notes = (list) => (list || []).map((note) => el("p.dim.small", note));

/** Whether something answers why in an environment: a daemon explains its executive's only. */
export const canAsk = (app, env) =>
  app.recording && !app.recording.isPast ? Boolean(app.recording.why) : (env || MAIN_ENV) === MAIN_ENV;

/**
 * A button that asks why, and the place of the answer.
 * @param about attributes of both: {button, box}
 */
export function whyBox(app, kind, name, env, about) {
  const box = el.div(about.box);
  async function answer() {
    box.replaceChildren(el("p.dim", "…"));
    try {
      box.replaceChildren(el.h3("Why"), answerOf(app, await ask(app, kind, name, env)));
    } catch (error) {
      box.replaceChildren(el("p.error-box", error.message));
    }
  }
  return { button: canAsk(app, env) ? button("Why?", answer, about.button) : null, box };
}

/** An answer to why of any kind. */
const answerOf = (app, data) => ("verdict" in data ? ruleWhy(app, data) : goalWhy(app, data));

/** @param data of GET /cxbridge/why?goal=, ?action= or ?fact= */
export function goalWhy(app, data) {
  const stories = data.goals || data.actions || [data],
    rules = new Set([
      ...(data.rules || []),
      ...stories.flatMap((story) => story.moments.flatMap((moment) => moment.rules)),
    ]);
  return el(
    "div.why",
    stories.map((story) =>
      el.section(
        el("p.cause", linked(app, story.cause.text, rules)),
        causeList(app, story.cause.because, rules),
        moments(app, story.moments, rules),
      ),
    ),
    el("p.dim.small", "in " + data.where),
    notes(data.notes),
  );
}

const ICONS = { yes: ["completed", "✓"], no: ["failed", "✗"], unknown: ["formulated", "–"] };
function mark(state) {
  const [outcome, icon] = ICONS[state];
  return el.i(
    { class: "dot outcome o-" + outcome, "aria-label": state === "unknown" ? "not reached" : state },
    icon,
  );
}
const matches = (found) => (found ? found.number + (found.more ? " or more" : "") : "");

function elements(data) {
  return el(
    "ol.elements",
    data.elements.map((each) => {
      const state = !each.joined ? "unknown" : each.joined.number ? "yes" : "no";
      return el.li(
        { class: data.failing === each.number ? "failing" : "" },
        mark(data.failing === each.number ? "no" : state),
        el("code.source", highlighted(each.text)),
        el(
          "span.dim.small.n",
          each.alone ? matches(each.alone) + " alone" : "",
          each.joined ? ", " + matches(each.joined) + " with those before" : "",
        ),
      );
    }),
  );
}

function failure(app, found) {
  if (!found) return null;
  return el.div(
    el.p(linked(app, found.reason)),
    el(
      "ul.causes",
      found.near.map((near) =>
        el.li(
          linked(app, near.fact),
          el(
            "ul.causes",
            near.deviations.map((each) =>
              el.li(
                "slot ",
                el.b(each.slot),
                " has ",
                el.code(each.value),
                ", wanted ",
                el.code(each.wanted),
              ),
            ),
          ),
        ),
      ),
      found.inner.map((inner) => el.li(failure(app, inner))),
    ),
  );
}

/** @param data of GET /cxbridge/why?rule= */
function ruleWhy(app, data) {
  return el(
    "div.why",
    el("p.cause", linked(app, data.verdict)),
    data.elements ? elements(data) : null,
    failure(app, data.failure),
    data.bases && data.bases.length
      ? el.p("It matches: ", linked(app, data.bases.map((basis) => [basis].flat().join(", ")).join("; ")))
      : null,
    data.last_fired
      ? el(
          "p.dim",
          "Fired " + data.fired + "×, last at " + clock(data.last_fired.seconds) + ": ",
          linked(app, [data.last_fired.facts].flat().join(" ")),
        )
      : null,
    (data.errors || []).map((error) => el("p.error-box", [error].flat().join(" "))),
    el("p.dim.small", "in " + data.where),
    notes(data.notes),
  );
}
