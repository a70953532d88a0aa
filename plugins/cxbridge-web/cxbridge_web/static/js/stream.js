// The daemon's stream of events. After a lost connection, the stream continues after the last event.
const RETRY_MS = [500, 1000, 2000, 5000]; // the waits before successive attempts to connect
const CHECKED_EVENTS = 20; // events between two checks of the time
const SLICE_MS = 15; // the work between two frames, so that the page stays responsive

export class Stream {
  kinds = "";
  last = "0"; // the id of the last received event; "0": all events that the daemon still has
  epoch = null; // identifies the daemon's process
  source = null; // the EventSource
  failedAttempts = 0; // to connect, since the last connection
  isWaiting = true; // for the event hello, after which all lists are read
  queue = []; // received lines, each an event
  workTimer = null; // the timer for the rest of the queue
  retryTimer = null; // the timer for the next attempt to connect

  /**
   * @param handlers.event(event) gets each event; handlers.state(state) the state "open" or "lost";
   * handlers.hello(hello) the begin of each connection; handlers.restarted() is called before hello if the
   * daemon is another process; handlers.dropped({count}) gets the number of events that the daemon left out;
   * handlers.caughtUp() is called at the end of a queue that took several slices
   */
  constructor(handlers) {
    this.handlers = handlers;
  }

  /** Follow these kinds of events. */
  follow(kinds) {
    const wanted = [...new Set(kinds)].sort().join(",");
    if (wanted === this.kinds && this.source) return;
    this.kinds = wanted;
    this.open();
  }

  open() {
    this.close();
    // together: a message has several events, one a line
    const query = "together=true&kinds=" + this.kinds + "&since=" + encodeURIComponent(this.last),
      source = new EventSource("api/cxbridge/events?" + query);
    this.source = source;
    this.isWaiting = true;
    const on = {
      hello: ({ data }) => this.hello(JSON.parse(data)),
      dropped: ({ data, lastEventId }) => {
        this.last = lastEventId || this.last;
        this.handlers.dropped(JSON.parse(data));
      },
      message: ({ data, lastEventId }) => {
        this.last = lastEventId || this.last;
        this.queue.push(...data.split("\n"));
        if (!this.workTimer) this.work();
      },
      error: () => this.source === source && this.lost(),
    };
    for (const [type, listener] of Object.entries(on)) source.addEventListener(type, listener);
  }
  /** @param hello {last: "EPOCH-COUNTS"}, the first event of a connection */
  hello(hello) {
    const [epoch] = String(hello.last || "").split("-"),
      isRestarted = this.epoch !== null && epoch !== this.epoch; // the model has the state of another process
    this.epoch = epoch;
    this.failedAttempts = 0;
    this.isWaiting = false;
    if (isRestarted) {
      this.queue = [];
      this.handlers.restarted();
    }
    this.handlers.state("open");
    this.handlers.hello(hello);
  }
  /** Connect again. The browser's own attempts would end after some errors, and repeat the old `since`. */
  lost() {
    this.close();
    this.handlers.state("lost");
    const wait = RETRY_MS[Math.min(this.failedAttempts++, RETRY_MS.length - 1)];
    this.retryTimer = setTimeout(() => this.open(), wait);
  }

  /** Apply the queued events in slices; all at once while the page is hidden, because its timers rest. */
  work() {
    const beganAt = performance.now(),
      { queue } = this;
    let at = 0;
    try {
      while (
        at < queue.length &&
        (at % CHECKED_EVENTS || document.hidden || performance.now() - beganAt < SLICE_MS)
      )
        this.handlers.event(JSON.parse(queue[at++]));
    } finally {
      // an event that cannot be applied is left out, too: it must not stop the stream
      queue.splice(0, at);
      const isBehind = this.queue.length > 0;
      if (!isBehind && this.workTimer) this.handlers.caughtUp();
      this.workTimer = isBehind ? setTimeout(() => this.work(), 0) : null;
    }
  }

  close() {
    clearTimeout(this.retryTimer);
    if (this.source) this.source.close();
    this.source = null;
  }
}
