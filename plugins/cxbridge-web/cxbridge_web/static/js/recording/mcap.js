// Reads the events of an mcap file that cxbridge wrote: JSON messages in chunks that are not packed; and the
// CLIPS files that are attached, with the paths that they had. https://mcap.dev/spec

// the first and the last bytes of a file: 0x89 MCAP 0 and a line end
const MAGIC = [0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a];
// the kinds of records
const OP = { SCHEMA: 3, CHANNEL: 4, MESSAGE: 5, CHUNK: 6, ATTACHMENT: 9, METADATA: 12, DATA_END: 15 };
const HEAD = 9; // bytes of a record before its content: the kind and the size
const MESSAGE_HEAD = 22; // bytes of a message before its JSON: channel, sequence, two times
// the kind of event by the name of the schema
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
const CHUNK_HEAD = 28; // bytes of a chunk before the name of its compression: two times, size, checksum
const FOOTER_SIZE = 20; // bytes of the footer's content, which begins with the place of the summary
// the paths of the CX core's files
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

/** Reads numbers and texts at places of a file. All numbers are little-endian. */
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
  /** A number of 16 bits. */
  short(at) {
    return this.view.getUint16(at, true);
  }
  /** A number of 64 bits. */
  long(at) {
    return Number(this.view.getBigUint64(at, true));
  }
  string(from, to) {
    return decoder.decode(this.bytes.subarray(from, to));
  }
  /** A text with its size (32 bits) before it. @returns the text, and the place after it */
  text(at) {
    const end = at + 4 + this.view.getUint32(at, true);
    return [this.string(at + 4, end), end];
  }
  /**
   * The records between two places: {op, begin, end}, where begin and end are those of the content. The end
   * of the last record is beyond `to` if the record was cut off.
   */
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
  files = new Map(); // name of the attachment -> text
  paths = new Map(); // name of the attachment -> path
  startUs = null; // when the run began; null: the file does not say

  /** Take a record of an attachment: two times, its name, its media type, its content. */
  takeAttachment(bytes, begin) {
    const [name, afterName] = bytes.text(begin + 16),
      [, at] = bytes.text(afterName);
    // 8: the size of the content
    if (/^clips\/.*\.clp$/.test(name)) this.files.set(name, bytes.string(at + 8, at + 8 + bytes.long(at)));
  }
  /** Take a record of metadata: its name, and pairs of key and value. */
  takeMetadata(bytes, begin) {
    const [name, from] = bytes.text(begin),
      end = from + 4 + bytes.view.getUint32(from, true),
      values = {};
    for (let at = from + 4; at < end;) {
      const [key, next] = bytes.text(at);
      [values[key], at] = bytes.text(next);
    }
    if (/^\d+$/.test(values.start_us)) this.startUs = Number(values.start_us);
    if (name === "cxbridge.source" && values.attachment) this.paths.set(values.attachment, values.name);
  }

  /** The files of an environment in the order of loading: {path, core: whether of the CX core, text}. */
  of(env) {
    const folder = "clips/" + env + "/",
      files = [...this.files]
        .filter(([name]) => name.startsWith(folder))
        .sort(([a], [b]) => (a < b ? -1 : 1));
    return files.map(([name, text]) => {
      const path = this.paths.get(name) || name.slice(folder.length);
      return { path, core: CORE.test(path), text };
    });
  }
}

/**
 * Read a file, also if it was cut off or has damaged chunks or messages.
 * @param pause(share) awaited now and then, with the share of the file that was read (0 to 1)
 * @returns {events, notes, sources}: notes are texts about unread parts, sources are the attached CLIPS files
 */
export async function readMcap(fileBytes, pause) {
  const file = new Bytes(fileBytes),
    schemas = new Map(),
    kindsByChannel = new Map(),
    events = [],
    messages = [], // the messages of a chunk: {kind, text}, the text as bytes
    sources = new Sources(),
    notes = new Set(),
    unknownSchemas = new Set();

  // the functions that read records, by their kind; they get the place of the content and its end
  const readers = {
    [OP.SCHEMA](bytes, begin) {
      schemas.set(bytes.short(begin), bytes.text(begin + 2)[0]);
    },
    [OP.CHANNEL](bytes, begin) {
      const schema = schemas.get(bytes.short(begin + 2));
      if (!KIND_OF[schema]) unknownSchemas.add(schema || "without schema");
      kindsByChannel.set(bytes.short(begin), KIND_OF[schema]);
    },
    [OP.MESSAGE](bytes, begin, end) {
      const kind = kindsByChannel.get(bytes.short(begin));
      if (kind) messages.push({ kind, text: bytes.bytes.subarray(begin + MESSAGE_HEAD, end) });
    },
    [OP.ATTACHMENT]: (bytes, begin) => sources.takeAttachment(bytes, begin),
    [OP.METADATA]: (bytes, begin) => sources.takeMetadata(bytes, begin),
    [OP.CHUNK]: readChunk,
  };
  /** Parse the messages of a chunk all at once: one by one they take three times as long. */
  function parseMessages() {
    let parsed = [];
    try {
      parsed = JSON.parse(joinTexts(messages.map(({ text }) => text)));
    } catch {
      // at least one message is damaged: all are parsed one by one below
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
  /** Read the records of a chunk, also if it was cut off. A damaged or packed chunk leads to a note. */
  function readChunk(bytes, begin, end) {
    // 4: the size of the compression's name
    if (begin + CHUNK_HEAD + 4 > bytes.length) return; // cut off within its head
    const [compression, next] = bytes.text(begin + CHUNK_HEAD),
      inner = bytes.part(next + 8, end); // 8: the size of the records
    if (compression) {
      const remedy = "': unpack it with 'cxbridge trace convert FILE OUT --to mcap'.";
      notes.add("It is packed by '" + compression + remedy);
      return;
    }
    try {
      for (const { op, begin: from, end: to } of inner.records(0, inner.length))
        if (to <= inner.length) readers[op]?.(inner, from, to); // else the file was cut off
    } catch (error) {
      if (!(error instanceof RangeError)) throw error;
      notes.add("A part of the file is damaged (" + error.message + "); the rest is shown.");
    }
    parseMessages();
  }
  /**
   * Read the channels that a complete file repeats at its end, so that they are known even if a part is
   * damaged.
   */
  function readSummary() {
    const footer = file.length - MAGIC.length - FOOTER_SIZE;
    if (footer < MAGIC.length || !isMcap(fileBytes.subarray(-MAGIC.length))) return;
    // the place of the summary is 0 in a file without summary
    for (const { op, begin, end } of file.records(file.long(footer) || footer, footer))
      if (end <= footer && (op === OP.SCHEMA || op === OP.CHANNEL)) readers[op](file, begin, end);
  }
  readSummary();
  let isEnded = false;
  for (const { op, begin, end } of file.records(MAGIC.length, file.length)) {
    isEnded = op === OP.DATA_END;
    if (isEnded) break;
    // the first records of a chunk that was cut off are whole
    if (end <= file.length || op === OP.CHUNK) readers[op]?.(file, begin, Math.min(end, file.length));
    await pause(end / file.length);
  }
  parseMessages(); // the messages of a file without chunks
  if (!isEnded) notes.add(CUT);
  if (!events.length && unknownSchemas.size)
    notes.add("It has other things: " + [...unknownSchemas].slice(0, 5).join(", ") + ".");
  return { events, notes: [...notes], sources };
}
