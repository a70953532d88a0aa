// Which robot, or which agent, a line of the log is about, as far as the name of its component says so.
import { MAIN_ENV } from "cx/names.js";

// the components of an agent's environment: CLIPS (ENV), BBCLIPS|ENV, Planner|ENV; the others of the agent: ENV/NAME
const OF_AGENT = /^(?:\w+ \((.+)\)|\w+\|(.+)|(.+)\/[^/]+)$/;
const agentOf = (component) => OF_AGENT.exec(component)?.slice(1).find(Boolean) || "";

const callsOf = ({ kind, calls, actions, ...item }) =>
  kind === "skill" ? [item] : (calls ?? actions.flatMap((action) => action.calls));

/** Whether a line may be about a goal, an action or a skill call: lines of other agents and other robots are not. */
export function isOfRobot(item, history) {
  const own = callsOf(item),
    robots = new Set(own.map(({ skiller }) => skiller)),
    envs = new Set([...history.goals.values()].map(({ env }) => env)),
    env = item.action?.env || item.env || MAIN_ENV,
    others = [...new Set(history.calls.map(({ skiller }) => skiller))].filter((name) => !robots.has(name));
  return ({ component }) => {
    const agent = agentOf(component);
    if (envs.has(agent) && envs.size > 1) return agent === env;
    return !own.length || !others.some((name) => component.split(/\W+/).includes(name));
  };
}
