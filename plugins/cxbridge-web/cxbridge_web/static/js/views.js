// The views: each is one file in views/, which the server lists. A file that exports `tab` is a tab at
// "#/FILE"; one that exports `parts` has addresses within a tab of another file.
import NAMES from "shared/views.js";

/**
 * Load all views.
 * @param failed called with a file's name and the error, of files that cannot be loaded; the rest goes on
 * @returns tabs in their order: {name, title, formerly, module}; parts: a Map of "tab/part" to modules
 */
export async function loadViews(failed) {
  const modules = await Promise.all(
    NAMES.map((name) =>
      import("cx/views/" + name + ".js").catch((error) => {
        failed(name, error);
        return null;
      }),
    ),
  );
  const tabs = [],
    parts = new Map();
  for (const [at, module] of modules.entries()) {
    if (!module) continue;
    const { tab, parts: own = [] } = module;
    if (tab)
      tabs.push({ order: 1000, ...tab, name: NAMES[at], formerly: [tab.formerly || []].flat(), module });
    for (const part of own) parts.set(part, module);
  }
  tabs.sort((a, b) => a.order - b.order || (a.name < b.name ? -1 : 1));
  return { tabs, parts };
}
