// What a Skiller says of itself, and its calls up to now.
import { get, idPath } from "cx/api.js";
import { button, clockText, durationText, el, note } from "cx/dom.js";
import { skillBadge } from "cx/looks.js";

export const STATUS = "SkillerInterface::";
export const DEBUG = "SkillerDebugInterface::";
const MOST_CALLS = 50;

/** Whether a call is of a Skiller; of several agents its id is AGENT/ID. */
const isOf = (skiller) => (call) => call.skiller === skiller || call.lane === skiller;
const ofInterface = ({ skill_string: text, status, error, exclusive_controller: controller }) => ({
  text: text || "",
  status,
  error,
  controller: controller || "",
});

/** As the API reported it (active, null of a recording), or as its interface was written. */
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
  // the same interface also has the list of skills, and machines that another client asked for
  if (debug?.graph_fsm === "ACTIVE" && debug.graph) value.graph = debug.graph;
  return value;
}

/** Of a Skiller that shows no graphs: what its interface has. */
export async function readStatus(skiller) {
  const { data } = await get("blackboard/interfaces/SkillerInterface/" + idPath(skiller) + "/data");
  return { ...data, "skill-string": data.skill_string, graph: "" };
}

/** The calls of a Skiller, the latest first. */
export const callsOf = (model, skiller) => model.calls.filter(isOf(skiller)).slice(-MOST_CALLS).reverse();

/** @param again called with the skill string of a call that is wanted again; null: nothing can be called */
export function callList(calls, again) {
  const row = ({ begin, end, status, text }) =>
    el.li(
      el("span.dim.n", clockText(begin)),
      skillBadge(status),
      el("code.main-text", text),
      el("span.dim.n", end === null ? "" : durationText(end - begin)),
      again && button("again", () => again(text), { class: "quiet", "aria-label": "again: " + text }),
    );
  return calls.length ? el("ol.calls", calls.map(row)) : note("None yet.");
}
