// Requests to the daemon's REST API. Equal GET requests at the same time are sent once.
/** A refused request. `status` is the HTTP status; 0: the daemon does not answer. */
export class ApiError extends Error {
  constructor(status, text) {
    super(text || "HTTP " + status);
    this.status = status;
  }
}

const pendingGets = new Map(); // path -> promise of the answer
/** Escape one segment of a path, or a value of a query. */
export const escapePart = encodeURIComponent;
/** The path of the facts of an environment; with a template, only its facts. */
export const factsPath = (env, template = "") =>
  "clips/" + escapePart(env) + "/facts?formatted=true" + (template && "&template=" + escapePart(template));
/** Escape an id of an interface, whose slashes remain separators of the path. */
export const idPath = (id) => id.split("/").map(escapePart).join("/");

/** Send a request to a path below `api/`. Returns JSON values or a text; throws ApiError if it is refused. */
async function request(method, path, body) {
  const options = { method, headers: {} };
  if (body !== undefined) {
    options.body = JSON.stringify(body);
    options.headers["Content-Type"] = "application/json";
  }
  let reply;
  try {
    reply = await fetch("api/" + path, options);
  } catch {
    throw new ApiError(0, "The daemon does not answer");
  }
  const text = await reply.text();
  const isJson = (reply.headers.get("Content-Type") || "").startsWith("application/json");
  const answer = isJson && text ? JSON.parse(text) : text;
  if (!reply.ok) throw new ApiError(reply.status, (isJson ? answer.message || text : text).trim());
  return answer;
}

export function get(path) {
  const pending = pendingGets.get(path);
  if (pending) return pending;
  const answer = request("GET", path).finally(() => pendingGets.delete(path));
  pendingGets.set(path, answer);
  return answer;
}
export const post = (path, body = {}) => request("POST", path, body);
export const remove = (path) => request("DELETE", path);

/**
 * Return a function that starts the asynchronous `call`, at most once in a period. Calls of the function
 * during a run lead to one further run. `failed` gets the errors. `stop` of the function cancels a planned
 * run.
 */
export function throttled(call, periodMs, failed = () => {}) {
  let isRunning = false,
    isWanted = false,
    startedAt = -Infinity,
    timer = null;
  async function run() {
    timer = null;
    isRunning = true;
    isWanted = false;
    startedAt = performance.now();
    try {
      await call();
    } catch (error) {
      failed(error);
    }
    isRunning = false;
    if (isWanted) start();
  }
  function start() {
    isWanted = true;
    if (isRunning || timer !== null) return;
    timer = setTimeout(run, Math.max(0, startedAt + periodMs - performance.now()));
  }
  start.stop = () => {
    clearTimeout(timer);
    timer = null;
    isWanted = false;
  };
  return start;
}
