// What is said of the bar or the mark below the pointer.
import { el } from "cx/dom.js";

export class Tip {
  /** @param canvas beside which it stands, in the same box */
  constructor(canvas) {
    this.canvas = canvas;
    this.box = el("div.tl-tip", { role: "status", hidden: true });
  }

  /** @param x, y pixels within the canvas */
  show([first, ...rest], x, y) {
    const { box, canvas } = this;
    box.replaceChildren(el.b(first), ...rest.map((line) => el.span(line)));
    box.hidden = false;
    const most = Math.max(0, canvas.clientWidth - box.offsetWidth),
      below = y + 18,
      isLow = below + box.offsetHeight > canvas.clientHeight;
    box.style.left = canvas.offsetLeft + Math.min(Math.max(x + 14, 0), most) + "px";
    box.style.top = Math.max(0, isLow ? y - box.offsetHeight - 10 : below) + "px";
  }
  hide() {
    this.box.hidden = true;
  }
}
