// Keys of goals: an environment other than the executive's own is part of the name.
export const MAIN_ENV = "executive";
export const goalKey = (env, id) => (!env || env === MAIN_ENV ? id : env + ":" + id);
export const bare = (symbol) => (symbol === "nil" ? "" : symbol);
