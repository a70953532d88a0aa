// Where constructs are written: of a daemon as it answers, of a recording as its attached files have them.
import { get, part } from "cx/api.js";
import { constructsOf } from "cx/clips/source.js";

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

/** One construct: {construct, name, file, line, core, text}; null: it is in no file that can be read. */
export async function constructText(app, env, construct, name) {
  const found = app.recording
    ? recorded(app.recording, env)
    : await get(
        "cxbridge/constructs?text=true&env=" + part(env) + "&construct=" + construct + "&name=" + part(name),
      );
  return found.findLast((each) => each.construct === construct && each.name === name) || null;
}

/** Whose deftemplates are: {core, own}, Sets of names. Facts without a deftemplate are in neither. */
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
