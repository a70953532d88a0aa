// Reads the events of an mcap file that cxbridge wrote: JSON messages in chunks that are not packed.
// https://mcap.dev/spec
import { Sources } from "cx/recording/sources.js";

const MAGIC = [0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a];
const OP = { SCHEMA: 3, CHANNEL: 4, MESSAGE: 5, CHUNK: 6, ATTACHMENT: 9, METADATA: 12, DATA_END: 15 };
export const KIND_OF = {
  "cxbridge.LogLine": "log",
  "cxbridge.RuleFired": "rule",
  "cxbridge.FactChange": "fact",
  "cxbridge.GoalTransition": "goal",
  "cxbridge.PlanActionTransition": "plan-action",
  "cxbridge.SkillStatus": "skill",
  "cxbridge.InterfaceWrite": "interface",
  "cxbridge.InterfaceMessage": "message",
  "cxbridge.PlannerCall": "planner",
  "cxbridge.NavGraphRead": "navgraph",
  "cxbridge.LoopTime": "loop",
};
const decoder = new TextDecoder();
const CUT = "The file was cut off; what is there is shown.";

export const isMcap = (bytes) => MAGIC.every((byte, at) => bytes[at] === byte);

/**
 * @param pause(part) awaited now and then, with the part of the file that was read (0 to 1)
 * @returns {events, notes, sources}: what could be read, what not, and the attached CLIPS files
 */
export async function readMcap(whole, pause) {
  const schemas = new Map(),
    kinds = new Map(),
    events = [],
    sources = new Sources(),
    notes = new Set(),
    others = new Set();

  async function records(bytes, from, to, isWhole) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    let at = from;
    while (at + 9 <= to) {
      const op = bytes[at],
        size = Number(view.getBigUint64(at + 1, true)),
        begin = at + 9,
        end = begin + size;
      if (op === OP.DATA_END) return;
      if (op === OP.CHUNK) await chunk(bytes, view, begin, end, to);
      if (end > to) break;
      if (op !== OP.CHUNK) take(op, bytes, view, begin, end);
      at = end;
      if (isWhole) await pause(at / to);
    }
    notes.add(CUT); // a whole file has a DATA_END, a whole chunk is seen to below
  }
  function text(bytes, view, at) {
    const size = view.getUint32(at, true);
    return [decoder.decode(bytes.subarray(at + 4, at + 4 + size)), at + 4 + size];
  }
  function take(op, bytes, view, begin, end) {
    if (op === OP.SCHEMA) schemas.set(view.getUint16(begin, true), text(bytes, view, begin + 2)[0]);
    else if (op === OP.ATTACHMENT) sources.attachment(bytes, view, begin);
    else if (op === OP.METADATA) sources.metadata(bytes, view, begin);
    else if (op === OP.CHANNEL) {
      const schema = schemas.get(view.getUint16(begin + 2, true));
      if (!KIND_OF[schema]) others.add(schema || "without schema");
      kinds.set(view.getUint16(begin, true), KIND_OF[schema]);
    } else if (op === OP.MESSAGE) {
      const kind = kinds.get(view.getUint16(begin, true));
      if (!kind) return;
      try {
        const event = JSON.parse(decoder.decode(bytes.subarray(begin + 22, end)));
        event.kind = kind;
        if (typeof event.time_us === "number") events.push(event);
      } catch {
        notes.add("Some events could not be read.");
      }
    }
  }
  async function chunk(bytes, view, begin, end, to) {
    if (begin + 32 > to) return;
    const [packed, next] = text(bytes, view, begin + 28);
    if (packed) {
      notes.add(
        "It is packed by '" + packed + "': unpack it with 'cxbridge trace convert FILE OUT --to mcap'.",
      );
      return;
    }
    const inner = bytes.subarray(next + 8, Math.min(end, to)),
      innerView = new DataView(inner.buffer, inner.byteOffset, inner.byteLength);
    let at = 0;
    try {
      while (at + 9 <= inner.length) {
        const stop = at + 9 + Number(innerView.getBigUint64(at + 1, true));
        if (stop > inner.length) break; // its file was cut off
        take(inner[at], inner, innerView, at + 9, stop);
        at = stop;
      }
    } catch (error) {
      if (!(error instanceof RangeError)) throw error;
      notes.add("A part of the file is damaged (" + error.message + "); the rest is shown.");
    }
  }
  /** A whole file tells its channels once more at its end: they are known even if a part is damaged. */
  function summary() {
    const view = new DataView(whole.buffer, whole.byteOffset, whole.byteLength),
      footer = whole.length - MAGIC.length - 20;
    if (footer < MAGIC.length || !isMcap(whole.subarray(-MAGIC.length))) return;
    for (let at = Number(view.getBigUint64(footer, true)); at && at + 9 < footer;) {
      const begin = at + 9,
        end = begin + Number(view.getBigUint64(at + 1, true));
      if (end > footer) return;
      if (whole[at] === OP.SCHEMA || whole[at] === OP.CHANNEL) take(whole[at], whole, view, begin, end);
      at = end;
    }
  }
  summary();
  await records(whole, MAGIC.length, whole.length, true);
  if (!events.length && others.size)
    notes.add("It has other things: " + [...others].slice(0, 5).join(", ") + ".");
  return { events, notes: [...notes], sources };
}
