// Data that views gather of a run: one store a page and kind. Live events come to the store whichever view is
// open; the data of a recording are made of its events on demand.
const stores = new WeakMap(); // class -> the store of the page

export class Store {
  listeners = new Set();
  recorded = new WeakMap();

  /** @param make makes what is gathered: of a live run, or of a recording with its events */
  constructor(app, make) {
    this.app = app;
    this.make = make;
    this.live = make();
  }
  static of(app) {
    if (!stores.has(this)) stores.set(this, new this(app));
    return stores.get(this);
  }

  get now() {
    const { recording } = this.app;
    if (!recording || recording.isPast) return this.live;
    if (!this.recorded.has(recording)) this.recorded.set(recording, this.make(recording.events));
    return this.recorded.get(recording);
  }
  onChange(listener) {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
  notify() {
    for (const listener of [...this.listeners]) listener();
  }
}
