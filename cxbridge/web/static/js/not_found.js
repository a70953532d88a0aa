// The view of an address that leads nowhere.
import { el, none } from "./dom.js";

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
