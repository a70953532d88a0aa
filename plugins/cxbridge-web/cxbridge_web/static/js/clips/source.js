// The texts of CLIPS constructs: those of a daemon come from its API, those of a recording from its attached
// files.
import { escapePart, get } from "cx/api.js";

// a comment, a string, a parenthesis, or other text
const TOKEN = /;[^\n]*|"(?:\\.|[^"\\])*"|[()]|[^()";]+/gs;

/** The constructs of a file: {construct, name, line, text}. */
function constructsOf(text) {
  const constructs = [];
  let depth = 0,
    begin = 0,
    line = 1,
    beginLine = 1;
  for (const { 0: token, index } of text.matchAll(TOKEN)) {
    if (token === "(" && !depth++) [begin, beginLine] = [index, line];
    if (token === ")" && depth && !--depth) {
      const constructText = text.slice(begin, index + 1),
        // the kind, and the name without its module
        [head, construct, name] = /^\(\s*(def\w+)\s+(?:[\w-]+::)?([^\s()]+)/.exec(constructText) || [];
      if (head) constructs.push({ construct, name, line: beginLine, text: constructText });
    }
    line += token.split("\n").length - 1;
  }
  return constructs;
}

const constructCache = new WeakMap(); // recording -> environment -> constructs

/** The constructs in the attached files of a recording: {construct, name, line, text, file, core}. */
function recordedConstructs(recording, env) {
  if (!constructCache.has(recording)) constructCache.set(recording, new Map());
  const constructsByEnv = constructCache.get(recording);
  if (!constructsByEnv.has(env))
    constructsByEnv.set(
      env,
      (recording.sources ? recording.sources.of(env) : []).flatMap(({ path, core, text }) =>
        constructsOf(text).map((construct) => ({ ...construct, file: path, core })),
      ),
    );
  return constructsByEnv.get(env);
}

/** Find a construct: {construct, name, file, line, core, text}; null: no readable file has it. */
export async function findConstruct(app, env, construct, name) {
  const constructs = app.recording
    ? recordedConstructs(app.recording, env)
    : await get(
        "cxbridge/constructs?text=true&env=" +
          escapePart(env) +
          "&construct=" +
          construct +
          "&name=" +
          escapePart(name),
      );
  // CLIPS keeps the last of several constructs with a name
  return constructs.findLast((each) => each.construct === construct && each.name === name) || null;
}

/** The deftemplates of the CX core and of the agent: {core, own}, Sets of names. */
export async function templateOwners(app, env) {
  const constructs = app.recording
    ? recordedConstructs(app.recording, env)
    : await get("cxbridge/constructs?env=" + escapePart(env) + "&construct=deftemplate");
  const names = (core) =>
    new Set(
      constructs
        .filter((each) => each.construct === "deftemplate" && Boolean(each.core) === core)
        .map((each) => each.name),
    );
  return { core: names(true), own: names(false) };
}

/** All rules of a recording's files: {name, file, line, core, text}. */
export const recordedRules = (recording, env) =>
  recordedConstructs(recording, env).filter((each) => each.construct === "defrule");
