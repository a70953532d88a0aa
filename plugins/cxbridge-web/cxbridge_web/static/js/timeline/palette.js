// Colours of outcomes for a canvas: those of css/outcomes.css.
import { NAMES, OUTCOMES } from "cx/outcome.js";

/**
 * The colours of a page now, light or dark.
 * @param root an element in whose colours the canvas is drawn
 */
export function palette(root) {
  const probe = cx.el("span", { hidden: true });
  root.append(probe);
  const color = (value) => {
    probe.style.color = value;
    return getComputedStyle(probe).color;
  };
  const outcomes = {};
  for (const name of NAMES)
    outcomes[name] = {
      fill: color(`var(--outcome-${name})`),
      edge: color(`var(--outcome-${name}-edge)`),
      ink: color(`var(--outcome-${name}-ink)`),
      icon: OUTCOMES[name].icon,
    };
  const found = {
    outcomes,
    back: color("var(--card, var(--back))"),
    panel: color("var(--panel)"),
    line: color("var(--line)"),
    text: color("var(--text)"),
    dim: color("var(--dim)"),
    focus: color("var(--focus)"),
    loud: color("var(--outcome-failed-edge)"),
  };
  probe.remove();
  return found;
}
