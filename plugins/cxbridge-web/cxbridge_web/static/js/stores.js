// Data that views collect from a run, with one store for each kind. A store gets live events whichever view
// is open, and makes the data of a recording on demand.
const stores = new WeakMap(); // subclass -> its only instance

export class Store {
  listeners = new Set(); // called after each change of the data
  recorded = new WeakMap(); // recording -> its data

  /** @param make makes the data: empty for a live run, or from the events of a recording */
  constructor(app, make) {
    this.app = app;
    this.make = make;
    this.live = make();
  }
  /** The store of the page, made at the first call. */
  static of(app) {
    if (!stores.has(this)) stores.set(this, new this(app));
    return stores.get(this);
  }

  /** The data of the open recording; of the live run, also while its past is open. */
  get now() {
    const { recording } = this.app;
    if (!recording || recording.isPast) return this.live;
    if (!this.recorded.has(recording)) this.recorded.set(recording, this.make(recording.events));
    return this.recorded.get(recording);
  }
  /** Call a function after each change. Returns a function that ends this. */
  onChange(listener) {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
  notify() {
    for (const listener of [...this.listeners]) listener();
  }
}
