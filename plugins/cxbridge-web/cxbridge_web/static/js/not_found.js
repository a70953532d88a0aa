// The views of an address that leads nowhere, and of a run that cannot be opened.
import { el, none } from "cx/dom.js";

export function openNotFound(main, address, tabs) {
  const box = none("Nothing is at " + address, "The views are:");
  box.id = "not-found";
  box.prepend(el("h2", {}, "Not found"));
  box.append(
    el(
      "ul",
      { class: "link-row" },
      tabs.map((tab) => el("li", {}, el("a", { href: "#/" + tab.name }, tab.title))),
    ),
  );
  main.append(el("div", { class: "panel" }, box));
  return { go() {}, close() {} };
}

/** @param runs those that the server has: {path, name} */
export function openNoRun(main, runs) {
  const box = none("No recorded run is open", "This server has:");
  box.id = "no-run";
  box.prepend(el("h2", {}, "No run"));
  box.append(
    el(
      "ul",
      { class: "link-row" },
      runs.map(({ path, name }) => el("li", {}, el("a", { href: runAddress(path) }, name))),
    ),
  );
  main.replaceChildren(el("div", { class: "panel" }, box));
}

/** The address of the page with a run. */
export const runAddress = (path) => "?run=" + encodeURIComponent(path).replaceAll("%2F", "/");
