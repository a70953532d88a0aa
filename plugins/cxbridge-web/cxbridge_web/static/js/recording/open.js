// Opens recordings: a chosen or dropped file, a recording of the server, or the recording inside the page.
import SITE from "shared/site.js";
import { button, el } from "cx/dom.js";
import { readLines } from "cx/recording/lines.js";
import { isMcap, readMcap } from "cx/recording/mcap.js";
import { Recording } from "cx/recording/run.js";
import { failureOf } from "cx/story/causes.js";
import { timesOf } from "cx/timeline/spans.js";

const MOST_BYTES = 512 << 20, // the page holds the whole file in memory
  SLICE_MS = 30, // work without a pause
  CHECKED_EVENTS = 500; // events between two checks of the time
const FORMATS =
  "The page opens mcap files (cxbridge run --trace) and lines of 'cxbridge trace cat --json'; 'cxbridge view' opens every format.";

class Cancelled extends Error {}

/**
 * Do work with a progress bar and a button that cancels the work. The page stays responsive.
 * @param work(pause) awaits pause(share) now and then, with the finished share of the work (0 to 1)
 * @param failed(error) gets the error of the work, or Cancelled
 */
async function withProgress(name, work, failed) {
  const bar = el.progress({ max: 1, "aria-label": "reading " + name });
  let isCancelled = false,
    pausedAt = performance.now();
  const cancel = button("Cancel", () => {
    isCancelled = true;
  });
  const box = el("div#opening", { role: "status" }, el("span.main-text", "Reading " + name), bar, cancel);
  async function pause(share) {
    if (performance.now() - pausedAt < SLICE_MS) return;
    if (!box.isConnected) document.body.append(box);
    bar.value = share;
    await new Promise((done) => {
      setTimeout(done, 0);
    });
    if (isCancelled) throw new Cancelled();
    pausedAt = performance.now();
  }
  try {
    await work(pause);
  } catch (error) {
    failed(error);
  } finally {
    box.remove();
  }
}

/**
 * Open the bytes of a recording.
 * @param extras optional members from a server of recordings or a report: why(recording, kind, name, env)
 * answers why; links: the actions of skill calls, see History.linkGuessed(); readLinks() returns a promise of
 * the links
 */
async function openBytes(app, name, bytes, pause, extras) {
  const text = () => new TextDecoder().decode(bytes),
    { events, notes, sources } = await (isMcap(bytes) ? readMcap(bytes, pause) : readLines(text(), pause));
  if (!events.length) {
    app.toast(name + " is not a recording, or has no events. " + [...notes, FORMATS].join(" "), true);
    return;
  }
  const recording = new Recording(name, events, notes, sources),
    { history } = recording;
  await playAll(recording, pause);
  recording.why = extras.why && ((...question) => extras.why(recording, ...question));
  const isUnlinked =
    history.calls.length > 0 && [...history.actions.values()].every(({ calls }) => !calls.length);
  if (extras.links && isUnlinked) history.linkGuessed(extras.links);
  // a report opens at its failure, unless its address names a view and so is longer than "#/"
  if (SITE.inside && location.hash.length < 3) app.select({ time: failureTime(history) });
  app.look(recording);
  for (const note of notes) app.toast(note, true);
  if (!extras.readLinks || !isUnlinked) return;
  // later, because the server reads the whole recording for the links
  app.attempt(async () => {
    history.linkGuessed(await extras.readLinks());
    recording.model.touch("goals");
  });
}

/** The time of the failure in microseconds, at which a report opens; null without a failure. */
function failureTime(history) {
  const failure = failureOf(history);
  return (failure && timesOf(failure, history).end?.time) ?? null;
}

/** Play all events of a recording. The page stays responsive. */
async function playAll(recording, pause) {
  const { length } = recording.events;
  for (let at = 0; at < length;) {
    at = Math.min(at + CHECKED_EVENTS, length);
    recording.goTo(at);
    await pause(at / length);
  }
}

/** Open the past of a live run. */
export function openPast(app, recording) {
  const work = async (pause) => {
    await playAll(recording, pause);
    app.look(recording);
  };
  return withProgress(recording.name, work, (error) => {
    if (!(error instanceof Cancelled)) throw error;
    app.select({ time: null });
  });
}

/** Open a recording; an error is shown. @param load() a promise of its bytes @param extras see openBytes() */
const open = (app, name, load, extras = {}) =>
  withProgress(
    name,
    async (pause) => openBytes(app, name, await load(), pause, extras),
    (error) => {
      if (!(error instanceof Cancelled)) app.toast(name + " could not be read: " + error.message, true);
    },
  );

function openFile(app, file) {
  if (!file) return null;
  if (file.size > MOST_BYTES)
    return app.toast(file.name + " is too big for the page: look at it with cxbridge monitor", true);
  return open(app, file.name, async () => new Uint8Array(await file.arrayBuffer()));
}

/** A promise of the bytes of the recording or document inside the page. */
export async function bytesInside() {
  const packed = atob(document.getElementById("recording").textContent),
    bytes = Uint8Array.from(packed, (character) => character.charCodeAt(0)),
    unpacked = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(unpacked).arrayBuffer());
}

/** Ask a server of recordings why, at the chosen moment; for the story of the run, at the end. */
async function askServer(url, { time, begin, end, environments }, kind, name, env) {
  const query = new URLSearchParams({ kind, name });
  if (environments.includes(env)) query.set("env", env);
  if (kind !== "run" && time < end) query.set("at", (time - begin) / 1e6);
  const reply = await fetch(url + "?why&" + query),
    answer = await reply.json();
  if (!reply.ok) throw new Error(answer.message);
  return answer.data;
}
/**
 * Answer why from the answers in a report. With several agents, a question begins with the agent's
 * environment.
 */
const answerFrom = (answers) => async (recording, kind, name, env) => {
  const question = (kind + " " + name).trim(),
    answer = answers[env + " " + question] ?? answers[question];
  if (answer) return answer;
  throw new Error("The report does not have this answer: open the recording with 'cxbridge view'");
};
/** Load the bytes of a recording from this server. */
async function loadFromServer(url) {
  if (url.origin !== location.origin) throw new Error("it is on another server; open it as a file");
  const reply = await fetch(url),
    reason = reply.status === 404 ? "this server has no " + url.pathname : "HTTP " + reply.status;
  if (!reply.ok) throw new Error(reason);
  return new Uint8Array(await reply.arrayBuffer());
}

/**
 * Open the recording inside the page, or the file of this server in the address (`?run=PATH`). Without a file
 * in the address, a server of recordings opens its first recording.
 */
export async function openLinked(app) {
  if (SITE.inside) {
    const { name, links, notes, answers } = SITE.inside;
    await open(app, name, bytesInside, { links, why: answers && answerFrom(answers) });
    for (const note of notes) app.toast(note, true);
    return;
  }
  const [firstRun] = SITE.runs || [],
    path = new URLSearchParams(location.search).get("run") || firstRun?.path;
  if (!path) return;
  const url = new URL(path, location.href);
  // a server of recordings knows the actions of skill calls that the recording lacks, and answers why
  const extras = firstRun && {
    readLinks: async () => (await fetch(url + "?links")).json(),
    why: (...question) => askServer(url, ...question),
  };
  await open(app, path.split("/").pop() || path, () => loadFromServer(url), extras);
}

/** Let the user choose a file, and open it. */
export function chooseFile(app) {
  const change = () => {
    openFile(app, input.files[0]);
    input.remove();
  };
  // a new input each time, so that the same file can be chosen again
  const on = { change, cancel: () => input.remove() },
    input = el.input({ type: "file", hidden: true, accept: ".mcap,.json,.jsonl,.ndjson", on });
  document.body.append(input);
  input.click();
}

/** Open the first of the files that are dropped onto the page. */
export function dropZone(app) {
  const zone = document.getElementById("drop");
  let depth = 0; // entered elements: the pointer enters an inner element before it leaves the outer one
  const changeDepth = (by) => {
    depth = Math.max(0, depth + by);
    zone.hidden = depth === 0;
  };
  const on = {
    dragenter: () => changeDepth(1),
    dragover: (event) => event.preventDefault(),
    drop(event) {
      event.preventDefault();
      changeDepth(-Infinity);
      openFile(app, event.dataTransfer.files[0]);
    },
  };
  // a check of the types is not needed, because the depth never falls below 0
  document.addEventListener("dragleave", () => changeDepth(-1));
  for (const [type, call] of Object.entries(on))
    document.addEventListener(type, (event) => {
      if (event.dataTransfer?.types.includes("Files")) call(event);
    });
}
