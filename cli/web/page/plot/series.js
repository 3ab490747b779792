// One plotted field: its values of the last minutes, in a ring.

import { valueAt } from "../core/cdr.js";

const CAPACITY = 65536; // values: five minutes at 200 Hz

export class Series {
  constructor(link, text, topic, field, color) {
    Object.assign(this, { text, topic, field, color });
    this.times = new Float64Array(CAPACITY);
    this.values = new Float64Array(CAPACITY);
    this.count = 0; // all that ever came
    this.last = NaN;
    this.stop = link.subscribe(topic, (message, at) => this.take(at, valueAt(message, field)));
  }

  take(at, value) {
    const place = this.count++ % CAPACITY;
    this.times[place] = at;
    this.values[place] = value;
    this.last = value;
  }

  get newest() {
    return this.count ? this.times[(this.count - 1) % CAPACITY] : -Infinity;
  }

  /** [time, value] of what is kept since `from`, the oldest first. */
  *rows(from = -Infinity) {
    for (let i = Math.max(0, this.count - CAPACITY); i < this.count; i++) {
      const place = i % CAPACITY;
      if (this.times[place] >= from) yield [this.times[place], this.values[place]];
    }
  }

  /** The same as two arrays; found by halves, so that a long ring costs little. */
  since(from) {
    let low = Math.max(0, this.count - CAPACITY);
    let high = this.count;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle % CAPACITY] < from) low = middle + 1;
      else high = middle;
    }
    const times = [];
    const values = [];
    for (let i = low; i < this.count; i++) {
      times.push(this.times[i % CAPACITY]);
      values.push(this.values[i % CAPACITY]);
    }
    return [times, values];
  }
}
