// The theme: light, dark, or the theme of the system. Style sheets know only the system's theme, by the media
// query `prefers-color-scheme`; a chosen theme replaces the query in the loaded sheets.
import { button, el, remember, remembered } from "cx/dom.js";

const KEY = "cxbridge-theme",
  ICONS = { system: "◐", light: "☀", dark: "☾" },
  THEMES = Object.keys(ICONS);
const QUERIED_SCHEME = /\(prefers-color-scheme:\s*(light|dark)\)/g;
// media queries that are true and false on every page
const ALWAYS = "(min-width: 0px)",
  NEVER = "(max-width: 0px)";
const originals = new WeakMap(); // media rule -> its original query
/** The theme that the user chose last; "system" without a choice. */
const rememberedTheme = () => THEMES.find((theme) => theme === remembered(KEY)) || "system";

/** Yield the media rules among rules of a style sheet, also those within other rules. */
function* mediaRules(rules) {
  for (const rule of rules) {
    if (rule instanceof CSSMediaRule) yield rule;
    if (rule.cssRules) yield* mediaRules(rule.cssRules);
  }
}

/** Show the page in a theme. */
export function applyTheme(theme = rememberedTheme()) {
  const answer = (_, wanted) => (wanted === theme ? ALWAYS : NEVER);
  for (const sheet of document.styleSheets)
    for (const rule of mediaRules(sheet.cssRules)) {
      if (!originals.has(rule)) originals.set(rule, rule.media.mediaText);
      const original = originals.get(rule);
      if (!original.includes("prefers-color-scheme")) continue;
      rule.media.mediaText = theme === "system" ? original : original.replace(QUERIED_SCHEME, answer);
    }
  document.documentElement.style.colorScheme = theme === "system" ? "" : theme;
}

/**
 * A button that goes to the next theme. The app gets an event `theme`, after which drawings use its colours.
 */
export function themeSwitch(app) {
  let theme = rememberedTheme();
  const icon = el.span({ "aria-hidden": "true" }),
    name = el("span.hear-only");
  function next() {
    theme = THEMES[(THEMES.indexOf(theme) + 1) % THEMES.length];
    remember(KEY, theme);
    applyTheme(theme);
    show();
    app.dispatchEvent(new Event("theme"));
  }
  const switching = button([icon, name], next, { id: "theme", class: "quiet" });
  function show() {
    icon.textContent = ICONS[theme];
    name.textContent = "Theme: " + theme;
    switching.title = "Theme: " + theme + (theme === "system" ? "" : ", independent of the system");
  }
  show();
  return switching;
}
