// The drawn curves, by uPlot: zoom by dragging, values under the cursor.

import uPlot from "../vendor/uplot.js";
import { brief, h } from "../core/dom.js";

const EVERY = 50; // ms between two drawings
const MOST = 300; // s that are drawn while paused

export class Chart {
  constructor(palette, zoomed) {
    this.palette = palette;
    this.zoomed = zoomed;
    this.element = h("div.chart", {});
    this.series = [];
    this.drawn = 0;
    this.zoom = null;
    this.last = 0; // the time at the right edge: labels count from there
    document.head.append(h("link", { rel: "stylesheet", href: "vendor/uplot.css" }));
    new ResizeObserver(() => this.plot?.setSize(this.size)).observe(this.element);
  }

  get size() {
    return { width: Math.max(100, this.element.clientWidth), height: Math.max(160, this.element.clientHeight - 34) };
  }

  use(series) {
    this.series = [...series];
    this.plot?.destroy();
    this.plot = undefined;
    if (!series.length) return;
    const { muted, line } = this.palette();
    const axis = { stroke: muted, grid: { stroke: line, width: 1 }, ticks: { stroke: line } };
    /** @type {any} */ // its types know no axis whose labels count from the newest value
    const options = {
      ...this.size,
      ms: 1e-3,
      scales: { x: { time: false } },
      axes: [
        {
          ...axis,
          splits: (_, __, low, high) => this.ticks(low, high),
          values: (_, values) => values.map((value) => brief(value - this.last, 3)),
        },
        { ...axis, size: 64 },
      ],
      series: [
        { label: "time", value: (_, value) => (value === null ? "–" : `${(value - this.last).toFixed(3)} s`) },
        ...series.map(({ text, color }) => ({
          label: text,
          stroke: color,
          width: 1.5,
          spanGaps: true,
          points: { show: false },
        })),
      ],
      cursor: { drag: { x: true, y: true, uni: 30 } },
      hooks: { setSelect: [(plot) => plot.select.width > 0 && this.zoomTo(plot)] },
    };
    this.plot = new uPlot(options, [[], ...series.map(() => [])], this.element);
    this.plot.over.ondblclick = () => this.reset();
    this.drawn = 0;
  }

  /** Whole steps back from the newest value. */
  ticks(low, high) {
    const rough = (high - low) / 6;
    const ten = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((one) => one * ten).find((one) => one >= rough);
    const found = [];
    for (let k = Math.floor((this.last - low) / step); this.last - k * step <= high; k--)
      found.push(this.last - k * step);
    return found;
  }

  restyle() {
    if (this.series.length) this.use(this.series);
  }

  zoomTo(plot) {
    this.zoom = { x: [plot.posToVal(plot.select.left, "x"), plot.posToVal(plot.select.left + plot.select.width, "x")] };
    this.zoomed(true);
  }

  reset() {
    this.zoom = null;
    this.frozen = null;
  }

  /** Draw the last `seconds`; with null, what was there when it was paused. */
  draw(series, seconds) {
    const now = performance.now();
    if (!this.plot || now - this.drawn < EVERY) return;
    this.drawn = now;
    if (seconds === null) {
      if (!this.frozen) {
        this.frozen = this.data(series, this.end(series) - MOST);
        this.plot.setData(this.frozen, false);
        if (!this.zoom && this.shown !== undefined) this.plot.setScale("x", { min: this.shown, max: this.last });
      }
      return;
    }
    this.frozen = null;
    const end = this.end(series);
    if (!Number.isFinite(end)) return;
    this.last = end;
    this.shown = end - seconds;
    this.plot.setData(this.data(series, this.shown), false);
    this.plot.setScale("x", { min: this.shown, max: end });
  }

  end(series) {
    return Math.max(...series.map((one) => one.newest));
  }

  data(series, from) {
    return uPlot.join(series.map((one) => one.since(from)));
  }
}
