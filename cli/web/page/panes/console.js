// What the nodes say: /rosout, by level, node and text.

import { h, recall, remember } from "../core/dom.js";

const LEVELS = [
  [10, "debug"],
  [20, "info"],
  [30, "warn"],
  [40, "error"],
  [50, "fatal"],
];
const KEPT = 5000; // lines that are remembered
const SHOWN = 400; // lines that are drawn: the newest that pass

export async function make(app) {
  return new ConsolePane(app);
}

class ConsolePane {
  constructor({ link, go }) {
    this.go = go;
    this.lines = [];
    this.level = h(
      "select",
      { "aria-label": "Least level", onchange: () => this.changed() },
      ...LEVELS.map(([value, name]) => h("option", { value: String(value) }, name)),
    );
    this.level.value = recall("console.level", "20");
    this.node = h(
      "select",
      { "aria-label": "Node", onchange: () => this.changed() },
      h("option", { value: "" }, "every node"),
    );
    this.text = h("input.grow", {
      type: "search",
      placeholder: "Text",
      "aria-label": "Text",
      oninput: () => this.changed(),
    });
    this.pauseButton = h(
      "button",
      { type: "button", "aria-pressed": "false", onclick: () => this.pause(!this.paused) },
      "Pause",
    );
    this.rows = h("tbody");
    this.count = h("span.muted", {});
    this.view = h(
      "div.scroll.log",
      { tabIndex: 0, role: "region", "aria-label": "Log lines" },
      h(
        "table",
        {},
        h(
          "thead",
          {},
          h("tr", {}, ...["time", "level", "node", "message"].map((name) => h("th", { scope: "col" }, name))),
        ),
        this.rows,
      ),
    );
    this.element = h(
      "section.pane.console",
      { "aria-label": "Console" },
      h(
        "div.bar",
        {},
        this.level,
        this.node,
        this.text,
        this.pauseButton,
        h("button", { type: "button", onclick: () => this.clear() }, "Clear"),
        this.count,
      ),
      this.view,
    );
    link.subscribe("/rosout", (line, at) => this.take(line, at));
    link.addEventListener("seek", ({ detail }) => this.cut(detail));
  }

  show(query) {
    if (query.has("node")) this.choose(query.get("node"));
    if (query.has("level")) this.level.value = query.get("level");
    if (query.has("text")) this.text.value = query.get("text");
    this.dirty = true;
  }

  /** A recording is shown at an earlier time: what was said after it has not been said. */
  cut(at) {
    this.lines = this.lines.filter((line) => line.at < at);
    this.recorded = new Set(this.lines.map((line) => keyOf(line)));
    this.dirty = true;
  }

  take(line, at) {
    line.at = at;
    if (this.recorded) {
      const key = keyOf(line);
      if (this.recorded.has(key)) return; // shown once more after a seek
      this.recorded.add(key);
    }
    let place = this.lines.length; // lines that were kept for newcomers come node by node, not in the order of time
    while (place > 0 && later(this.lines[place - 1], line)) place--;
    this.lines.splice(place, 0, line);
    if (this.lines.length > KEPT) this.lines.splice(0, this.lines.length - KEPT);
    this.choose(line.name, false);
    if (!this.paused) this.dirty = true;
  }

  /** Offer a node in the list, and choose it. */
  choose(name, select = true) {
    if (![...this.node.options].some((option) => option.value === name)) {
      const later = [...this.node.options].slice(1).find((option) => option.value > name);
      this.node.insertBefore(h("option", { value: name }, name), later ?? null);
    }
    if (select) this.node.value = name;
  }

  changed() {
    remember("console.level", this.level.value);
    const query = new URLSearchParams();
    if (this.node.value) query.set("node", this.node.value);
    if (this.text.value) query.set("text", this.text.value);
    this.go(`console${query.size ? `?${query}` : ""}`, true);
    this.dirty = true;
  }

  pause(on) {
    this.paused = on;
    this.pauseButton.setAttribute("aria-pressed", String(on));
    this.dirty = true;
  }

  clear() {
    this.lines = [];
    this.dirty = true;
  }

  frame() {
    if (!this.dirty) return;
    this.dirty = false;
    const [least, node, text] = [Number(this.level.value), this.node.value, this.text.value.toLowerCase()];
    const found = this.lines.filter(
      (line) =>
        line.level >= least && (!node || line.name === node) && (!text || line.msg.toLowerCase().includes(text)),
    );
    const atEnd = this.view.scrollHeight - this.view.scrollTop - this.view.clientHeight < 40;
    this.rows.replaceChildren(...found.slice(-SHOWN).map(row));
    this.count.textContent = `${found.length} of ${this.lines.length} lines`;
    if (atEnd) this.view.scrollTop = this.view.scrollHeight;
  }
}

function keyOf({ at, name, msg }) {
  return `${at} ${name} ${msg}`;
}

function later({ stamp: a }, { stamp: b }) {
  return a.sec > b.sec || (a.sec === b.sec && a.nanosec > b.nanosec);
}

function row(line) {
  const name = LEVELS.find(([value]) => value === line.level)?.[1] ?? String(line.level);
  const kind = { warn: "warn", error: "bad", fatal: "bad" }[name] ?? "muted";
  const time = new Date(line.stamp.sec * 1000 + line.stamp.nanosec / 1e6).toISOString().slice(11, 23);
  return h(
    "tr",
    {},
    h("td.mono.muted", {}, time),
    h("td", {}, h(`span.level.${kind}`, {}, name)),
    h("td.mono", {}, line.name),
    h("td.text", {}, line.msg),
  );
}
