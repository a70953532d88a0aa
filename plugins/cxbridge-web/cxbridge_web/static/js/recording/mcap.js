// Reads the events of an mcap file that cxbridge wrote: JSON messages in chunks that are not packed; and the
// CLIPS files that are attached, with the paths that they had. https://mcap.dev/spec

const MAGIC = [0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a];
const OP = { SCHEMA: 3, CHANNEL: 4, MESSAGE: 5, CHUNK: 6, ATTACHMENT: 9, METADATA: 12, DATA_END: 15 };
const HEAD = 9; // bytes of a record before its content: the kind and the size
const MESSAGE_HEAD = 22; // bytes of a message before its JSON: channel, sequence, two times
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
const CORE = /(^|\/)cxbridge\/executive\/clips\//;
const decoder = new TextDecoder();
const [OPEN, COMMA, CLOSE] = new TextEncoder().encode("[,]");
const CUT = "The file was cut off; what is there is shown.";

export const isMcap = (bytes) => MAGIC.every((byte, at) => bytes[at] === byte);

/** JSON texts, as bytes, joined to the JSON text of an array. */
function joinTexts(texts) {
  const size = texts.reduce((sum, { length }) => sum + length + 1, 1),
    array = new Uint8Array(Math.max(size, 2)).fill(COMMA);
  let at = 1;
  for (const text of texts) {
    array.set(text, at);
    at += text.length + 1;
  }
  array[0] = OPEN;
  array[array.length - 1] = CLOSE;
  return decoder.decode(array);
}

/** Reads numbers and texts at places of a file. */
class Bytes {
  constructor(bytes) {
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }
  get length() {
    return this.bytes.length;
  }
  part(from, to) {
    return new Bytes(this.bytes.subarray(from, to));
  }
  short(at) {
    return this.view.getUint16(at, true);
  }
  long(at) {
    return Number(this.view.getBigUint64(at, true));
  }
  string(from, to) {
    return decoder.decode(this.bytes.subarray(from, to));
  }
  /** A text behind its size, and where it ends. */
  text(at) {
    const end = at + 4 + this.view.getUint32(at, true);
    return [this.string(at + 4, end), end];
  }
  /** The records from one place to another, as far as they are whole: {op, begin, end}. */
  *records(from, to) {
    for (let at = from; at + HEAD <= to;) {
      const begin = at + HEAD,
        end = begin + this.long(at + 1);
      yield { op: this.bytes[at], begin, end };
      at = end;
    }
  }
}

/** The CLIPS files that are attached to a recording. */
class Sources {
  files = new Map(); // attachment -> text
  paths = new Map(); // attachment -> path
  startUs = null; // when the run began

  attachment(bytes, begin) {
    const [name, afterName] = bytes.text(begin + 16),
      [, at] = bytes.text(afterName);
    if (/^clips\/.*\.clp$/.test(name)) this.files.set(name, bytes.string(at + 8, at + 8 + bytes.long(at)));
  }
  metadata(bytes, begin) {
    const [name, from] = bytes.text(begin),
      end = from + 4 + bytes.view.getUint32(from, true),
      about = {};
    for (let at = from + 4; at < end;) {
      const [key, next] = bytes.text(at);
      [about[key], at] = bytes.text(next);
    }
    if (/^\d+$/.test(about.start_us)) this.startUs = Number(about.start_us);
    if (name === "cxbridge.source" && about.attachment) this.paths.set(about.attachment, about.name);
  }

  /** The files of an environment, in the order in which they were loaded: {path, core, text}. */
  of(env) {
    const folder = "clips/" + env + "/",
      own = [...this.files].filter(([name]) => name.startsWith(folder)).sort(([a], [b]) => (a < b ? -1 : 1));
    return own.map(([name, text]) => {
      const path = this.paths.get(name) || name.slice(folder.length);
      return { path, core: CORE.test(path), text };
    });
  }
}

/**
 * @param pause(part) awaited now and then, with the part of the file that was read (0 to 1)
 * @returns {events, notes, sources}: notes name unread parts, sources are the attached CLIPS files
 */
export async function readMcap(whole, pause) {
  const file = new Bytes(whole),
    schemas = new Map(),
    kinds = new Map(),
    events = [],
    messages = [], // the messages of a chunk: {kind, text}, the text as bytes
    sources = new Sources(),
    notes = new Set(),
    others = new Set();

  const take = {
    [OP.SCHEMA](bytes, begin) {
      schemas.set(bytes.short(begin), bytes.text(begin + 2)[0]);
    },
    [OP.CHANNEL](bytes, begin) {
      const schema = schemas.get(bytes.short(begin + 2));
      if (!KIND_OF[schema]) others.add(schema || "without schema");
      kinds.set(bytes.short(begin), KIND_OF[schema]);
    },
    [OP.MESSAGE](bytes, begin, end) {
      const kind = kinds.get(bytes.short(begin));
      if (kind) messages.push({ kind, text: bytes.bytes.subarray(begin + MESSAGE_HEAD, end) });
    },
    [OP.ATTACHMENT]: (bytes, begin) => sources.attachment(bytes, begin),
    [OP.METADATA]: (bytes, begin) => sources.metadata(bytes, begin),
    [OP.CHUNK]: chunk,
  };
  /** Parse the messages of a chunk all at once: one by one they take three times as long. */
  function parseMessages() {
    let parsed = [];
    try {
      parsed = JSON.parse(joinTexts(messages.map(({ text }) => text)));
    } catch {
      // at least one of them is damaged
    }
    if (parsed.length !== messages.length) parsed = messages.map(parseMessage);
    for (const [at, { kind }] of messages.entries()) {
      const event = parsed[at];
      if (typeof event?.time_us !== "number") continue;
      event.kind = kind;
      events.push(event);
    }
    messages.length = 0;
  }
  /** The event of a message; null if the message is damaged. */
  function parseMessage({ text }) {
    try {
      return JSON.parse(decoder.decode(text));
    } catch {
      notes.add("Some events could not be read.");
      return null;
    }
  }
  function chunk(bytes, begin, end) {
    if (begin + 32 > bytes.length) return;
    const [packed, next] = bytes.text(begin + 28),
      inner = bytes.part(next + 8, end);
    if (packed) {
      const remedy = "': unpack it with 'cxbridge trace convert FILE OUT --to mcap'.";
      notes.add("It is packed by '" + packed + remedy);
      return;
    }
    try {
      for (const { op, begin: from, end: to } of inner.records(0, inner.length))
        if (to <= inner.length) take[op]?.(inner, from, to); // else the file was cut off
    } catch (error) {
      if (!(error instanceof RangeError)) throw error;
      notes.add("A part of the file is damaged (" + error.message + "); the rest is shown.");
    }
    parseMessages();
  }
  /** A whole file tells its channels once more at its end: they are known even if a part is damaged. */
  function summary() {
    const footer = file.length - MAGIC.length - 20;
    if (footer < MAGIC.length || !isMcap(whole.subarray(-MAGIC.length))) return;
    for (const { op, begin, end } of file.records(file.long(footer) || footer, footer))
      if (end <= footer && (op === OP.SCHEMA || op === OP.CHANNEL)) take[op](file, begin, end);
  }
  summary();
  let isEnded = false;
  for (const { op, begin, end } of file.records(MAGIC.length, file.length)) {
    isEnded = op === OP.DATA_END;
    if (isEnded) break;
    // of a chunk that was cut off the first records are whole
    if (end <= file.length || op === OP.CHUNK) take[op]?.(file, begin, Math.min(end, file.length));
    await pause(end / file.length);
  }
  parseMessages(); // of a file without chunks
  if (!isEnded) notes.add(CUT);
  if (!events.length && others.size)
    notes.add("It has other things: " + [...others].slice(0, 5).join(", ") + ".");
  return { events, notes: [...notes], sources };
}
