// Light, dark, or as the system has it; remembered. Style sheets ask for `prefers-color-scheme` only: what
// they get as an answer is changed here, in the sheets that the page has loaded.
import { el } from "cx/dom.js";

const KEY = "cxbridge-theme",
  THEMES = ["system", "light", "dark"],
  ICONS = { system: "◐", light: "☀", dark: "☾" };
const ASKED = /\(prefers-color-scheme:\s*(light|dark)\)/g;
const ALWAYS = "(min-width: 0px)",
  NEVER = "(max-width: 0px)";
const originals = new WeakMap();

function remembered() {
  try {
    const theme = localStorage.getItem(KEY);
    return THEMES.includes(theme) ? theme : "system";
  } catch {
    return "system"; // a browser that keeps nothing
  }
}

function* mediaRules(rules) {
  for (const rule of rules) {
    if (rule instanceof CSSMediaRule) yield rule;
    if (rule.cssRules) yield* mediaRules(rule.cssRules);
  }
}

/** Show the page in a theme. */
export function applyTheme(theme = remembered()) {
  for (const sheet of document.styleSheets) {
    for (const rule of mediaRules(sheet.cssRules)) {
      if (!originals.has(rule)) originals.set(rule, rule.media.mediaText);
      const original = originals.get(rule);
      if (!original.includes("prefers-color-scheme")) continue;
      rule.media.mediaText =
        theme === "system"
          ? original
          : original.replace(ASKED, (_, wanted) => (wanted === theme ? ALWAYS : NEVER));
    }
  }
  document.documentElement.style.colorScheme = theme === "system" ? "" : theme;
}

/** The switch: from one theme to the next. The app gets an event `theme`, for what draws with colours itself. */
export function themeSwitch(app) {
  let theme = remembered();
  const icon = el("span", { "aria-hidden": "true" }),
    name = el("span", { class: "hear-only" });
  const switching = el("button", { type: "button", id: "theme", class: "quiet" }, icon, name);
  function show() {
    icon.textContent = ICONS[theme];
    name.textContent = "Theme: " + theme;
    switching.title = "Theme: " + theme + (theme === "system" ? "" : ", whatever the system has");
  }
  switching.addEventListener("click", () => {
    theme = THEMES[(THEMES.indexOf(theme) + 1) % THEMES.length];
    try {
      localStorage.setItem(KEY, theme);
    } catch {
      // it holds until the page is loaded again
    }
    applyTheme(theme);
    show();
    app.dispatchEvent(new Event("theme"));
  });
  show();
  return switching;
}
