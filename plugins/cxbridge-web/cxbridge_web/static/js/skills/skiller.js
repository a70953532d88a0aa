// A Skiller: its state, its calls, its skills, and the executors of its skill board.
import { get, idPath } from "cx/api.js";
import { clockText, durationText, el, note } from "cx/dom.js";
import { skillOf } from "cx/names.js";
import { skillBadge } from "cx/outcome.js";

export const STATUS = "SkillerInterface::";
export const DEBUG = "SkillerDebugInterface::";
const MOST_CALLS = 50;

/** Whether a call is of a Skiller; with several agents the Skiller's id is AGENT/ID. */
const isOf = (skiller) => (call) => call.skiller === skiller || call.lane === skiller;
const ofInterface = ({ skill_string: text, status, error, exclusive_controller: controller }) => ({
  text: text || "",
  status,
  error,
  controller: controller || "",
});

/** @param active the answer of the API; null: the state is that of the events */
export function skillerState(model, skiller, active) {
  const call = model.calls.findLast(isOf(skiller)),
    status = model.interfaces.get(STATUS + skiller),
    debug = model.interfaces.get(DEBUG + skiller)?.values;
  const value = {
    ...{ text: "", status: "INACTIVE", error: "", controller: "" },
    ...(active && ofInterface({ ...active, skill_string: active["skill-string"] })),
    ...(call && { text: call.text, status: call.status }),
    ...(status && ofInterface(status.values)),
    graph: active?.graph ?? "",
  };
  // the interface also holds the list of skills, and graphs that other clients asked for
  if (debug?.graph_fsm === "ACTIVE" && debug.graph) value.graph = debug.graph;
  return value;
}

/** The state of a Skiller without SkillerDebugInterface. */
export async function readStatus(skiller) {
  const { data } = await get("blackboard/interfaces/SkillerInterface/" + idPath(skiller) + "/data");
  return { ...data, "skill-string": data.skill_string, graph: "" };
}

/** The latest calls of a Skiller, or of one of its skills, the last call first. */
export const callsOf = (model, skiller, skill = "") =>
  model.calls
    .filter((call) => isOf(skiller)(call) && (!skill || skillOf(call.text) === skill))
    .slice(-MOST_CALLS)
    .reverse();

export function callList(calls) {
  const row = ({ begin, end, status, text }) =>
    el.li(
      el("span.dim.n", clockText(begin)),
      skillBadge(status),
      el("code.main-text", text),
      el("span.dim.n", end === null ? "" : durationText(end - begin)),
    );
  return calls.length ? el("ol.calls", calls.map(row)) : note("None yet.");
}

/**
 * @param names skills of the Skiller
 * @param executors executors of its skill board: {id, skills}
 * @param calls calls, the last call first
 * @returns {name, who, status}: the executors of the skill, and the status of its last call
 */
export function knownSkills(names, executors, calls) {
  const who = new Map(names.map((name) => [name, []])),
    last = new Map(calls.toReversed().map(({ text, status }) => [skillOf(text), status]));
  for (const { id, skills } of executors)
    for (const skill of skills) who.set(skill, [...(who.get(skill) || []), id]);
  return [...new Set([...who.keys(), ...last.keys()])]
    .sort()
    .map((name) => ({ name, who: (who.get(name) || []).join(", "), status: last.get(name) }));
}

export const EXECUTOR = "SkillExecutorInterface";

/** The executors in the events and in an answer of the API: {id, agent, skills}. */
export function executorsOf(model, read) {
  const values = new Map(read.map(({ id, data }) => [id, data]));
  for (const [uid, each] of model.interfaces) {
    const [type, id] = uid.split("::");
    if (type === EXECUTOR) values.set(id, each.values);
  }
  return [...values].map(([id, { agent = "", skills = "" }]) => ({
    id,
    agent,
    skills: String(skills).split(" ").filter(Boolean),
  }));
}
