// The daemon's stream of events: goes on after the last event it had, and says when it is lost.
const RETRY_MS = [500, 1000, 2000, 5000];

export class Stream {
  /**
   * @param told.event, told.state ("connecting" | "open" | "lost"), told.hello, told.restarted,
   * told.dropped
   */
  constructor(told) {
    this.told = told;
    this.kinds = "";
    this.last = "0";
    this.epoch = null;
    this.source = null;
    this.tries = 0;
    this.timer = null;
    this.isWaiting = true; // for the hello, with which everything is read
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
      "api/cxbridge/events?kinds=" + this.kinds + "&since=" + encodeURIComponent(this.last),
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
      if (restarted) this.told.restarted();
      this.told.state("open");
      this.told.hello(hello);
    });
    source.addEventListener("dropped", (event) => {
      this.note(event);
      this.told.dropped(JSON.parse(event.data));
    });
    source.addEventListener("message", (event) => {
      this.note(event);
      this.told.event(JSON.parse(event.data));
    });
    source.addEventListener("error", () => {
      if (this.source !== source) return;
      // We try again ourselves: a browser gives up after some errors, and asks for no other `since`
      this.close();
      this.told.state("lost");
      const wait = RETRY_MS[Math.min(this.tries++, RETRY_MS.length - 1)];
      this.timer = setTimeout(() => this.open(), wait);
    });
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
