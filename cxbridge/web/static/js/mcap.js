// Reads the events of an mcap file that cxbridge wrote: JSON messages, chunks without compression. https://mcap.dev/spec
const MAGIC = [0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a];
const OP = { SCHEMA: 3, CHANNEL: 4, MESSAGE: 5, CHUNK: 6, DATA_END: 15 };
export const KIND_OF = {
  "cxbridge.LogLine": "log", "cxbridge.RuleFired": "rule", "cxbridge.FactChange": "fact", "cxbridge.GoalTransition": "goal",
  "cxbridge.PlanActionTransition": "plan-action", "cxbridge.SkillStatus": "skill", "cxbridge.InterfaceWrite": "interface",
  "cxbridge.InterfaceMessage": "message", "cxbridge.PlannerCall": "planner",
};
const decoder = new TextDecoder();

export const isMcap = (bytes) => MAGIC.every((byte, at) => bytes[at] === byte);

/** @returns {events, notes}: what could be read, and what not. */
export function readMcap(bytes) {
  const schemas = new Map(), kinds = new Map(), events = [], notes = new Set();

  function records(from, to) {
    const view = new DataView(bytes.buffer, bytes.byteOffset);
    let at = from;
    while (at + 9 <= to) {
      const op = bytes[at], size = Number(view.getBigUint64(at + 1, true)), begin = at + 9, end = begin + size;
      if (end > to) { notes.add("The file was cut off; what is there is shown."); return; }
      if (op === OP.DATA_END) return;
      take(op, view, begin, end);
      at = end;
    }
  }
  function text(view, at) {
    const size = view.getUint32(at, true);
    return [decoder.decode(bytes.subarray(at + 4, at + 4 + size)), at + 4 + size];
  }
  function take(op, view, begin, end) {
    if (op === OP.SCHEMA) schemas.set(view.getUint16(begin, true), text(view, begin + 2)[0]);
    else if (op === OP.CHANNEL) kinds.set(view.getUint16(begin, true), KIND_OF[schemas.get(view.getUint16(begin + 2, true))]);
    else if (op === OP.MESSAGE) {
      const kind = kinds.get(view.getUint16(begin, true));
      if (!kind) return;
      try {
        const event = JSON.parse(decoder.decode(bytes.subarray(begin + 22, end)));
        event.kind = kind;
        events.push(event);
      } catch { notes.add("Some events could not be read."); }
    } else if (op === OP.CHUNK) {
      const [packed, next] = text(view, begin + 28);
      if (packed) { notes.add("The recording is compressed (" + packed + "): unpack it with 'cxbridge trace convert', or 'cxbridge trace cat --json'."); return; }
      records(next + 8, end);
    }
  }
  records(MAGIC.length, bytes.length);
  return { events, notes: [...notes] };
}
