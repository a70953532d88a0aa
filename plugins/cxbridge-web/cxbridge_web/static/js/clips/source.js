// The text of CLIPS constructs: of a daemon by its API, of a recording by its attached files.
import { get, part } from "cx/api.js";

const TOKEN = /;[^\n]*|"(?:\\.|[^"\\])*"|[()]|[^()";]+/gs;

/** The constructs of a file: {construct, name, line, text}. */
function constructsOf(text) {
  const found = [];
  let depth = 0,
    begin = 0,
    line = 1,
    beginLine = 1;
  for (const { 0: token, index } of text.matchAll(TOKEN)) {
    if (token === "(" && !depth++) [begin, beginLine] = [index, line];
    if (token === ")" && depth && !--depth) {
      const whole = text.slice(begin, index + 1),
        head = /^\(\s*(def\w+)\s+(?:[\w-]+::)?([^\s()]+)/.exec(whole);
      if (head) found.push({ construct: head[1], name: head[2], line: beginLine, text: whole });
    }
    line += token.split("\n").length - 1;
  }
  return found;
}

const parsed = new WeakMap(); // recording -> environment -> constructs

function recorded(recording, env) {
  if (!parsed.has(recording)) parsed.set(recording, new Map());
  const known = parsed.get(recording);
  if (!known.has(env))
    known.set(
      env,
      (recording.sources ? recording.sources.of(env) : []).flatMap(({ path, core, text }) =>
        constructsOf(text).map((each) => ({ ...each, file: path, core })),
      ),
    );
  return known.get(env);
}

/** A construct: {construct, name, file, line, core, text}; null: no readable file has it. */
export async function constructText(app, env, construct, name) {
  const found = app.recording
    ? recorded(app.recording, env)
    : await get(
        "cxbridge/constructs?text=true&env=" + part(env) + "&construct=" + construct + "&name=" + part(name),
      );
  return found.findLast((each) => each.construct === construct && each.name === name) || null;
}

/** The deftemplates of the CX core and of the agent: {core, own}, Sets of names. */
export async function templateOwners(app, env) {
  const found = app.recording
    ? recorded(app.recording, env)
    : await get("cxbridge/constructs?env=" + part(env) + "&construct=deftemplate");
  const names = (core) =>
    new Set(
      found
        .filter((each) => each.construct === "deftemplate" && Boolean(each.core) === core)
        .map((each) => each.name),
    );
  return { core: names(true), own: names(false) };
}

/** All rules of a recording's files: {name, file, line, core}. */
export const recordedRules = (recording, env) =>
  recorded(recording, env).filter((each) => each.construct === "defrule");
