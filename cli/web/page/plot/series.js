// One plotted field: its values of the last minutes, in a ring.

import { valueAt } from "../core/cdr.js";

const CAPACITY = 65536; // values: five minutes at 200 Hz

export class Series {
  constructor(link, text, topic, field, color) {
    this.link = link;
    this.text = text;
    this.topic = topic;
    this.field = field;
    this.color = color;
    this.doubt = null; // why it may stay empty
    this.row = null; // its line in the legend
    this.times = new Float64Array(CAPACITY);
    this.values = new Float64Array(CAPACITY);
    this.count = 0; // all that ever came, but for what was cut off
    this.first = 0; // the values before this one are no longer in the ring
    this.last = NaN;
    const end = link.subscribe(topic, (message, at) => this.take(at, valueAt(message, field)));
    const cut = ({ detail }) => this.cut(detail);
    link.addEventListener("seek", cut);
    this.stop = () => {
      end();
      link.removeEventListener("seek", cut);
    };
  }

  /** A recording is shown at an earlier time: what comes after it has not happened. */
  cut(at) {
    while (this.newest >= at) this.count--;
    this.last = this.count > this.first ? this.values[(this.count - 1) % CAPACITY] : NaN;
  }

  take(at, value) {
    if (this.link.recording && at <= this.newest) return; // shown once more after a seek
    const place = this.count++ % CAPACITY;
    this.first = Math.max(this.first, this.count - CAPACITY);
    this.times[place] = at;
    this.values[place] = value;
    this.last = value;
  }

  get newest() {
    return this.count > this.first ? this.times[(this.count - 1) % CAPACITY] : -Infinity;
  }

  /** [time, value] of what is kept since `from`, the oldest first. */
  *rows(from = -Infinity) {
    for (let i = this.first; i < this.count; i++) {
      const place = i % CAPACITY;
      if (this.times[place] >= from) yield [this.times[place], this.values[place]];
    }
  }

  /**
   * What the values since `from` have in common: {rate, mean, least, most}, per second and in their own unit; null if
   * they are fewer than two.
   */
  summary(from) {
    const [times, values] = this.since(from);
    const known = values.filter(Number.isFinite);
    if (times.length < 2 || !known.length) return null;
    let [sum, least, most] = [0, Infinity, -Infinity];
    for (const value of known) {
      sum += value;
      least = Math.min(least, value);
      most = Math.max(most, value);
    }
    return { rate: (times.length - 1) / (times[times.length - 1] - times[0]), mean: sum / known.length, least, most };
  }

  /** The same as two arrays; found by halves, so that a long ring costs little. */
  since(from) {
    let low = this.first;
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
