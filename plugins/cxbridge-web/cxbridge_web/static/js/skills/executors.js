// The executors of the skill board (docs/skill-board.md): who they are, what they can do, what they do now.
import { part } from "cx/api.js";
import { badge, el, wideTable } from "cx/dom.js";

export const EXECUTOR = "SkillExecutorInterface";
const STATES = { IDLE: ["new", "○"], RESERVED: ["chosen", "◔"], BUSY: ["active", "▶"] };

/** The executors in the model's interfaces and in what the API said: [{id, agent, skills, state, skill}]. */
export function executorsOf(model, read) {
  const values = new Map(read.map((each) => [each.id, each.data]));
  for (const [uid, each] of model.interfaces)
    if (uid.startsWith(EXECUTOR + "::")) {
      const id = uid.slice(EXECUTOR.length + 2);
      values.set(id, { ...values.get(id), ...each.values });
    }
  return [...values]
    .map(([id, data]) => ({
      id,
      agent: data.agent || "",
      skills: String(data.skills || "")
        .split(" ")
        .filter(Boolean),
      state: String(data.state || "IDLE"),
      skill: data.skill || "",
    }))
    .sort((a, b) => (a.agent + a.id < b.agent + b.id ? -1 : 1));
}

export function executorTable(executors) {
  return el(
    "div#executors",
    el.h3("Executors"),
    wideTable(
      {},
      ["robot", "executor", "skills", "state"],
      executors.map((each) =>
        el.tr(
          el.td(each.agent),
          el.td(el.a({ href: "#/blackboard/" + part(EXECUTOR + "::" + each.id) }, each.id)),
          el.td(
            each.skills.map((skill, at) => [
              at ? ", " : "",
              el.a({ href: "#/skills/" + part(skill) }, skill),
            ]),
          ),
          el.td(
            badge(...(STATES[each.state] || ["other", "?"]), each.state),
            each.skill ? [" ", el.code(each.skill)] : "",
          ),
        ),
      ),
    ),
  );
}
