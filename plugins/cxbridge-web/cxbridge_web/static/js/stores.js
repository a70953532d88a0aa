// Data that views collect from a run, with one store for each kind. A store gets live events whichever view is
// open, and makes the data of a recording on demand.
const stores = new WeakMap(); // class -> the store of the page

export class Store {
  listeners = new Set();
  recorded = new WeakMap();

  /** @param make makes the data: empty for a live run, or from the events of a recording */
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
