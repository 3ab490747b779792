// Numbers over time: any numeric field by its path, several at once.

import { numericPaths } from "../core/cdr.js";
import { brief, h, note, recall, remember } from "../core/dom.js";
import { didYouMean } from "../core/suggest.js";
import { Chart } from "../plot/chart.js";
import { Series } from "../plot/series.js";

const SUM_EVERY = 500; // ms between two looks at rate, mean and extremes
const COLORS = ["#2f7bea", "#d9541e", "#0b9a64", "#b23ac2", "#c08a00", "#0f9bb3", "#d81b60", "#6a7f10"];

export async function make(app) {
  return new PlotPane(app);
}

class PlotPane {
  constructor({ link, go, palette }) {
    this.link = link;
    this.go = go;
    this.series = [];
    this.paths = h("datalist", { id: "paths" });
    this.input = h("input.grow.mono", {
      type: "text",
      "aria-label": "Topic and field",
      placeholder: "/imu/data.angular_velocity.z",
      list: "paths",
      autocomplete: "off",
      spellcheck: false,
    });
    this.input.onkeydown = (event) => event.key === "Enter" && this.add(this.input.value);
    this.window = h(
      "select",
      { "aria-label": "Seconds shown", onchange: () => remember("plot.window", this.window.value) },
      ...[5, 10, 30, 60, 300].map((s) => h("option", { value: String(s) }, `${s} s`)),
    );
    this.window.value = recall("plot.window", "10");
    this.pauseButton = h(
      "button",
      { type: "button", "aria-pressed": "false", onclick: () => this.pause(!this.paused) },
      "Pause",
    );
    this.note = note();
    this.legend = h("ul.legend", { "aria-label": "Plotted fields" });
    this.chart = new Chart(palette, (zoomed) => zoomed && this.pause(true));
    this.element = h(
      "section.pane.plot",
      { "aria-label": "Plot" },
      h(
        "div.bar",
        {},
        this.input,
        this.paths,
        h("button.primary", { type: "button", onclick: () => this.add(this.input.value) }, "Add"),
        this.window,
        this.pauseButton,
        h("button", { type: "button", onclick: () => this.chart.reset() }, "Reset zoom"),
        h("button", { type: "button", onclick: () => this.save() }, "CSV"),
      ),
      this.note.element,
      this.chart.element,
      this.legend,
    );
    this.empty = h(
      "p.empty.muted",
      {},
      "Write a topic and a number in it, such as /odom.twist.twist.linear.x: " +
        "the list under the field has those that there are.",
    );
    this.chart.element.append(this.empty);
    link.addEventListener("channels", () => this.offer());
    this.offer();
    for (const path of recall("plot.series", [])) this.add(path, false);
    addEventListener("theme", () => this.chart.restyle());
  }

  /** The paths of all numeric fields that there are, for the list under the input. */
  offer() {
    clearTimeout(this.offering);
    this.offering = setTimeout(() => {
      const found = [];
      for (const { topic, schema, schemaName } of this.link.channels.values())
        if (!topic.includes("/_"))
          for (const path of numericPaths(schema, schemaName, 40))
            found.push(`${topic}.${path.replaceAll("[]", "[0]")}`);
      for (const series of this.series) series.doubt = this.doubt(series);
      this.paths.replaceChildren(...found.sort().map((value) => h("option", { value })));
    }, 300);
  }

  show(query) {
    this.shown = true;
    for (const path of query.getAll("series")) this.add(path, false);
    this.address();
  }

  hide() {
    this.shown = false;
  }

  add(text, told = true) {
    const path = text.trim();
    if (!path || this.series.some((one) => one.text === path)) return;
    const split = this.split(path);
    if (!split)
      return this.note.say(`${path}: there is no topic of this name. Write a topic, a dot, and the field.`, true);
    const doubt = this.doubt(split);
    if (doubt && told && this.link.channels.has(split.topic)) return this.note.say(doubt, true);
    const color = COLORS.find((one) => !this.series.some((other) => other.color === one)) ?? COLORS[0];
    const series = new Series(this.link, path, split.topic, split.field, color);
    series.doubt = doubt;
    this.series.push(series);
    this.empty.hidden = true;
    series.row = this.row(series);
    this.legend.append(series.row);
    this.chart.use(this.series);
    if (told) this.input.value = "";
    this.note.say("");
    this.address();
  }

  /**
   * The longest name of a topic that the path begins with; a topic that is not there yet ends at the first dot. Fields
   * may be parted by slashes, too.
   */
  split(path) {
    const topics = [...this.link.channels.keys()].filter(
      (topic) => path.startsWith(topic) && /^[./]/.test(path.slice(topic.length)),
    );
    const topic = topics.sort((a, b) => b.length - a.length)[0] ?? (/^\/[^.]+\./.exec(path)?.[0].slice(0, -1) || null);
    return topic && { topic, field: path.slice(topic.length + 1).replaceAll("/", ".") };
  }

  /** Why nothing may come of a topic and field, with what was probably meant; "" if it will. */
  doubt({ topic, field }) {
    const { channels } = this.link;
    const channel = channels.get(topic);
    if (!channel) return `nobody publishes ${topic} yet${didYouMean(topic, channels.keys())}`;
    const paths = numericPaths(channel.schema, channel.schemaName, 2000);
    return paths.includes(field.replace(/\[\d+\]/g, "[]"))
      ? ""
      : `${topic} has no number ${field}${didYouMean(field, paths)}`;
  }

  row(series) {
    const value = h("b.mono", {}, "–");
    const sums = h("span.mono.muted.sums");
    series.tell = (number) => (value.textContent = Number.isNaN(number) ? "–" : brief(number, 4));
    series.sumUp = (sum) => {
      const doubted = !sum && Boolean(series.doubt);
      sums.classList.toggle("bad", doubted);
      sums.classList.toggle("muted", !doubted);
      sums.textContent = sum
        ? `${brief(sum.rate, 1)} Hz, mean ${brief(sum.mean, 4)}, ${brief(sum.least, 4)} to ${brief(sum.most, 4)}`
        : series.doubt;
    };
    const remove = h("button.quiet", { type: "button", title: "Remove", onclick: () => this.remove(series) }, "×");
    remove.setAttribute("aria-label", `Remove ${series.text}`);
    const swatch = h("i.swatch");
    swatch.style.background = series.color;
    return h("li", {}, swatch, h("span.mono.grow", {}, series.text), sums, value, remove);
  }

  remove(series) {
    series.stop();
    series.row.remove();
    this.series.splice(this.series.indexOf(series), 1);
    this.empty.hidden = this.series.length > 0;
    this.chart.use(this.series);
    this.address();
  }

  address() {
    const texts = this.series.map(({ text }) => text);
    remember("plot.series", texts);
    if (this.shown)
      this.go(
        `plot${texts.length ? "?" : ""}${texts.map((text) => `series=${encodeURIComponent(text)}`).join("&")}`,
        true,
      );
  }

  pause(on) {
    this.paused = on;
    this.pauseButton.setAttribute("aria-pressed", String(on));
    if (!on) this.chart.reset();
  }

  frame() {
    for (const series of this.series) series.tell(series.last);
    if (!this.paused && performance.now() - (this.summed ?? -SUM_EVERY) >= SUM_EVERY) {
      this.summed = performance.now();
      for (const series of this.series) series.sumUp(series.summary(series.newest - Number(this.window.value)));
    }
    this.chart.draw(this.series, this.paused ? null : Number(this.window.value));
  }

  /** All that is kept, one line for each value: topic and field, time, value. */
  save() {
    const lines = ["series,time_s,value"];
    for (const series of this.series)
      for (const [time, value] of series.rows()) lines.push(`${series.text},${time.toFixed(6)},${value}`);
    const link = h("a", {
      href: URL.createObjectURL(new Blob([`${lines.join("\n")}\n`], { type: "text/csv" })),
      download: "plot.csv",
    });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
}
