// The CLIPS files that are attached to a recording, with the paths that they had.
const decoder = new TextDecoder();
const CORE = /(^|\/)cxbridge\/executive\/clips\//;

function textAt(bytes, view, at) {
  const size = view.getUint32(at, true);
  return [decoder.decode(bytes.subarray(at + 4, at + 4 + size)), at + 4 + size];
}

export class Sources {
  constructor() {
    this.files = new Map(); // attachment -> text
    this.paths = new Map(); // attachment -> path
    this.startUs = null; // when the run began
  }

  attachment(bytes, view, begin) {
    const [name, afterName] = textAt(bytes, view, begin + 16);
    if (!/^clips\/.*\.clp$/.test(name)) return;
    const [, at] = textAt(bytes, view, afterName),
      size = Number(view.getBigUint64(at, true));
    this.files.set(name, decoder.decode(bytes.subarray(at + 8, at + 8 + size)));
  }

  metadata(bytes, view, begin) {
    const [name, afterName] = textAt(bytes, view, begin);
    const end = afterName + 4 + view.getUint32(afterName, true),
      about = {};
    for (let at = afterName + 4; at < end;) {
      const [key, next] = textAt(bytes, view, at),
        [value, after] = textAt(bytes, view, next);
      about[key] = value;
      at = after;
    }
    if (/^\d+$/.test(about.start_us)) this.startUs = Number(about.start_us);
    if (name === "cxbridge.source" && about.attachment) this.paths.set(about.attachment, about.name);
  }

  /** The files of an environment, in the order in which they were loaded: {path, core, text}. */
  of(env) {
    const folder = "clips/" + env + "/";
    return [...this.files]
      .filter(([name]) => name.startsWith(folder))
      .sort(([a], [b]) => (a < b ? -1 : 1))
      .map(([name, text]) => {
        const path = this.paths.get(name) || name.slice(folder.length);
        return { path, core: CORE.test(path), text };
      });
  }
}
