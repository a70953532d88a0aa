// The views for an unknown address, and for a server of recordings while no recording is open.
import { el, link, none } from "cx/dom.js";

/** @param texts a sentence, and the heading of the links @param links pairs of address and text */
function openLinkPanel(main, id, title, texts, links) {
  const box = none(...texts);
  box.id = id;
  box.prepend(el.h2(title));
  const items = links.map(([href, text]) => el.li(link(href, text)));
  box.append(el("ul.link-row", items));
  main.replaceChildren(el("div.panel", box));
  return { go() {}, close() {} };
}

export const openNotFound = (main, address, tabs) =>
  openLinkPanel(
    main,
    "not-found",
    "Not found",
    ["There is no view at " + address, "The views are:"],
    tabs.map(({ name, title }) => ["#/" + name, title]),
  );

/** @param runs the runs of the server: {path, name} */
export const openNoRun = (main, runs) =>
  openLinkPanel(
    main,
    "no-run",
    "No run",
    ["No recorded run is open", "This server has:"],
    runs.map(({ path, name }) => [runAddress(path), name]),
  );

/** The address of the page with a recording of the server; the slashes of the path stay readable. */
export const runAddress = (path) => "?run=" + encodeURIComponent(path).replaceAll("%2F", "/");
