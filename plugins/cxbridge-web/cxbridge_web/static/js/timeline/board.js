// Reads the messages between the masters and the executors of a skill board as begin, progress and end of
// calls, as cxbridge/history/exchange.py does.
const BOARD = "SkillBoardInterface::",
  EXECUTOR = "SkillExecutorInterface::";

const MOST_EARLY_TICKETS = 1000; // unknown requests whose replies are kept

/** The lane of an executor's calls in the history. With several agents, each has a separate blackboard. */
export const laneOf = (agent, executor) => "board " + agent + "/" + executor;
/** The executor of a lane, with its agent; the id of a Skiller. */
export const nameOfLane = (lane) => lane.replace(/^board \/?/, "");

/**
 * The agent and the id of an interface. With several agents, its name ends with AGENT/ID; otherwise the agent
 * is "".
 */
export function agentAndId(uid) {
  const [, agent = "", id] = /::(?:(.*)\/)?([^/]*)$/s.exec(uid);
  return [agent, id];
}

/**
 * The ticket, which identifies a request: board, its epoch, number of its master. Null for another message.
 */
function ticketOf({ uid, values }) {
  const [agent] = agentAndId(uid),
    ownBoard = (agent ? agent + "/" : "") + (values.board || ""), // an executor's message names its board
    board = uid.startsWith(BOARD) ? uid.slice(BOARD.length) : uid.startsWith(EXECUTOR) ? ownBoard : null;
  return board === null ? null : [board, values.epoch, values.master].join("\n");
}

/**
 * The parameters of a request as words; positional parameters, whose names are numbers, without their names.
 */
function parameterWords(parameters) {
  let values = null;
  try {
    values = JSON.parse(parameters);
  } catch {
    // a request without parameters
  }
  const pairs = values && typeof values === "object" && !Array.isArray(values) ? Object.entries(values) : [];
  return pairs
    .filter(([name]) => name !== "mapped_action") // the skill string, not a parameter of the skill
    .map(([name, value]) => (/^\d+$/.test(name) ? String(value) : name + "=" + value));
}

/** Follows the requests of skill boards and their replies. */
export class BoardMessages {
  constructor() {
    this.requests = new Map(); // ticket -> the request in words
    this.earlyReplies = new Map(); // ticket -> replies that came before their request, from another process
  }

  /**
   * The changes in a message: a list of {type, agent, executor, request, text, progress, status,
   * hasSucceeded}. Type: CONFIRM, FEEDBACK, FINISH or another message's name; only FEEDBACK and FINISH have a
   * status, and only FINISH has `hasSucceeded`.
   */
  read(event) {
    const ticket = event.outcome === "refused" ? null : ticketOf(event);
    if (ticket === null) return [];
    if (event.message === "RequestMessage") {
      if (this.requests.has(ticket)) return []; // the same request, to another executor
      const { skill, parameters, agent, name, master } = event.values,
        earlyReplies = this.earlyReplies.get(ticket) || [],
        text = [skill, ...parameterWords(parameters)].join(" ") + " of " + (agent || "no agent");
      this.requests.set(ticket, { text, request: name || String(master) });
      this.earlyReplies.delete(ticket);
      return earlyReplies.flatMap((reply) => this.changesOf(ticket, reply));
    }
    if (this.requests.has(ticket)) return this.changesOf(ticket, event);
    this.earlyReplies.set(ticket, [...(this.earlyReplies.get(ticket) || []), event]);
    if (this.earlyReplies.size > MOST_EARLY_TICKETS)
      this.earlyReplies.delete(this.earlyReplies.keys().next().value); // the oldest
    return [];
  }

  /** The change in a reply to a known request, in a list. */
  changesOf(ticket, { uid, message, values }) {
    const [agent, id] = agentAndId(uid),
      executor = values.executor || (uid.startsWith(EXECUTOR) ? id : ""),
      type = message.replace(/Message$/, "").toUpperCase(),
      outcome = values.outcome,
      change = { type, agent, executor, ...this.requests.get(ticket), progress: values.progress || 0 };
    if (type === "FEEDBACK") return [{ ...change, status: values.text || "" }];
    if (type !== "FINISH") return [change];
    if (outcome !== "REFUSED") this.requests.delete(ticket); // else the master asks another executor
    const hasSucceeded = outcome === "SUCCEEDED";
    return [{ ...change, hasSucceeded, status: hasSucceeded ? values.text || "" : values.error || outcome }];
  }
}
