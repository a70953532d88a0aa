// Requests to the daemon. Equal requests at the same time are sent once.
export class ApiError extends Error {
  constructor(status, text) {
    super(text || "HTTP " + status);
    this.status = status;
  }
}

const underWay = new Map();
export const part = encodeURIComponent;
/** The path of the facts of an environment, of one deftemplate if it is named. */
export const factsPath = (env, template = "") =>
  "clips/" + part(env) + "/facts?formatted=true" + (template && "&template=" + part(template));
export const idPath = (id) => id.split("/").map(part).join("/");

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
  const value = isJson && text ? JSON.parse(text) : text;
  if (!reply.ok) throw new ApiError(reply.status, (isJson ? value.message || text : text).trim());
  return value;
}

export function get(path) {
  const known = underWay.get(path);
  if (known) return known;
  const answer = request("GET", path).finally(() => underWay.delete(path));
  underWay.set(path, answer);
  return answer;
}
export const post = (path, body = {}) => request("POST", path, body);
export const remove = (path) => request("DELETE", path);

/**
 * Limit a call to one run in `ms`. A call during a run makes one more run. Errors go to `failed`.
 */
export function throttled(call, ms, failed = () => {}) {
  let running = false,
    wanted = false,
    last = -Infinity,
    timer = null;
  async function run() {
    timer = null;
    running = true;
    wanted = false;
    last = performance.now();
    try {
      await call();
    } catch (error) {
      failed(error);
    }
    running = false;
    if (wanted) start();
  }
  function start() {
    wanted = true;
    if (running || timer !== null) return;
    timer = setTimeout(run, Math.max(0, last + ms - performance.now()));
  }
  start.stop = () => {
    clearTimeout(timer);
    timer = null;
    wanted = false;
  };
  return start;
}
