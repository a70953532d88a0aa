// The daemon's stream of events: goes on after the last event it had, and says when it is lost.
const RETRY_MS = [500, 1000, 2000, 5000];
const SLICE_MS = 15; // of work at a time, so that the page draws and answers meanwhile

export class Stream {
  /**
   * @param handlers.event, handlers.state ("connecting" | "open" | "lost"), handlers.hello, handlers.restarted,
   * handlers.dropped, handlers.caughtUp (so much had come that it took more than a moment)
   */
  constructor(handlers) {
    this.handlers = handlers;
    this.kinds = "";
    this.last = "0";
    this.epoch = null;
    this.source = null;
    this.tries = 0;
    this.timer = null;
    this.isWaiting = true; // for the hello, with which everything is read
    this.queue = []; // lines that have come, each an event
    this.working = null; // the timer of what is left to do;
  }

  /** Follow these kinds from now on; without changes nothing happens. */
  follow(kinds) {
    const wanted = [...new Set(kinds)].sort().join(",");
    if (wanted === this.kinds && this.source) return;
    this.kinds = wanted;
    this.open();
  }

  open() {
    this.close();
    const source = new EventSource(
      "api/cxbridge/events?together=true&kinds=" + this.kinds + "&since=" + encodeURIComponent(this.last),
    );
    this.source = source;
    this.isWaiting = true;
    source.addEventListener("hello", (event) => {
      const hello = JSON.parse(event.data),
        [epoch] = String(hello.last || "").split("-");
      const restarted = this.epoch !== null && epoch !== this.epoch; // what was known is of another daemon
      this.epoch = epoch;
      this.tries = 0;
      this.isWaiting = false;
      if (restarted) {
        this.queue = [];
        this.handlers.restarted();
      }
      this.handlers.state("open");
      this.handlers.hello(hello);
    });
    source.addEventListener("dropped", (event) => {
      this.note(event);
      this.handlers.dropped(JSON.parse(event.data));
    });
    source.addEventListener("message", (event) => {
      this.note(event);
      this.queue.push(...event.data.split("\n"));
      if (!this.working) this.work();
    });
    source.addEventListener("error", () => {
      if (this.source !== source) return;
      // We try again ourselves: a browser gives up after some errors, and asks for no other `since`
      this.close();
      this.handlers.state("lost");
      const wait = RETRY_MS[Math.min(this.tries++, RETRY_MS.length - 1)];
      this.timer = setTimeout(() => this.open(), wait);
    });
  }

  /** Take the events that have come, some at a time; all at once while nobody looks: timers rest then. */
  work() {
    const begin = performance.now(),
      { queue } = this;
    let at = 0;
    try {
      while (at < queue.length && (at % 20 || document.hidden || performance.now() - begin < SLICE_MS))
        this.handlers.event(JSON.parse(queue[at++]));
    } finally {
      queue.splice(0, at);
      const isBehind = this.queue.length > 0;
      if (!isBehind && this.working) this.handlers.caughtUp();
      this.working = isBehind ? setTimeout(() => this.work(), 0) : null;
    }
  }

  note(event) {
    if (event.lastEventId) this.last = event.lastEventId;
  }

  close() {
    clearTimeout(this.timer);
    if (this.source) this.source.close();
    this.source = null;
  }
}
