// The views for an unknown address, and for a server whose runs cannot be opened.
import { el, link, none } from "cx/dom.js";

/** @param links pairs of address and text */
function openNothing(main, id, title, words, links) {
  const box = none(...words);
  box.id = id;
  box.prepend(el.h2(title));
  const items = links.map(([href, text]) => el.li(link(href, text)));
  box.append(el("ul.link-row", items));
  main.replaceChildren(el("div.panel", box));
  return { go() {}, close() {} };
}

export const openNotFound = (main, address, tabs) =>
  openNothing(
    main,
    "not-found",
    "Not found",
    ["There is no view at " + address, "The views are:"],
    tabs.map(({ name, title }) => ["#/" + name, title]),
  );

/** @param runs the runs of the server: {path, name} */
export const openNoRun = (main, runs) =>
  openNothing(
    main,
    "no-run",
    "No run",
    ["No recorded run is open", "This server has:"],
    runs.map(({ path, name }) => [runAddress(path), name]),
  );

export const runAddress = (path) => "?run=" + encodeURIComponent(path).replaceAll("%2F", "/");
