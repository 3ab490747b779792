// Recordings: record what runs, look at what was recorded in all panes, and fetch it.

import { h, note } from "../core/dom.js";

const EVERY = 1000; // ms between two looks at what there is, while the pane is shown

export async function make(app) {
  return new BagsPane(app);
}

class BagsPane {
  constructor({ robot: link, without }) {
    this.link = link;
    this.without = without;
    this.note = note();
    this.state = h("p", { role: "status" });
    this.name = h("input.grow", {
      type: "text",
      "aria-label": "Name of the bag",
      placeholder: "name, or else the time of day",
      autocomplete: "off",
      spellcheck: false,
    });
    this.all = h("input", { type: "checkbox", checked: true, onchange: () => this.choose() });
    this.topics = h("div.topics", { hidden: true, role: "group", "aria-label": "Topics" });
    this.button = h(
      "button.primary",
      { type: "button", onclick: () => (this.running ? this.stop() : this.record()) },
      "Record",
    );
    this.rows = h("tbody");
    this.none = h("p.muted", {}, "There are no bags yet.");
    this.where = h("p.muted.mono");
    this.form = h(
      "div.card.stack",
      {},
      h("h2", {}, "Record"),
      h("div.row", {}, this.name, h("label", {}, this.all, "all topics"), this.button),
      this.topics,
      this.state,
      this.where,
    );
    const heads = ["name", "begun", "length", "messages", "topics", "size", ""];
    this.element = h(
      "section.pane.bags.stack",
      { "aria-label": "Bags" },
      this.note.element,
      this.form,
      h(
        "div.card.stack",
        {},
        h("h2", {}, "Bags"),
        this.none,
        h(
          "div.scroll",
          {},
          h(
            "table",
            {},
            h("thead", {}, h("tr", {}, ...heads.map((name) => h("th", { scope: "col" }, name)))),
            this.rows,
          ),
        ),
      ),
    );
    link.addEventListener("open", () => this.shown && this.look());
    link.addEventListener("channels", () => this.offer());
    this.offer();
  }

  show() {
    this.shown = true;
    this.look();
  }

  hide() {
    this.shown = false;
    clearTimeout(this.timer);
  }

  async look() {
    clearTimeout(this.timer);
    try {
      this.tell(await this.link.request("robactor.bags"));
    } catch (error) {
      this.note.say(error.message, true);
    }
    if (this.shown) this.timer = setTimeout(() => this.look(), EVERY);
  }

  tell({ folder, recording, bags }) {
    this.form.hidden = folder === null;
    this.running = recording !== null;
    if (folder === null) this.note.say("No bags are kept here: start the server with --bags DIR.");
    this.where.textContent = folder ?? "";
    this.button.textContent = recording ? "Stop recording" : "Record";
    this.button.classList.toggle("danger", this.running);
    this.button.classList.toggle("primary", !this.running);
    this.name.disabled = this.all.disabled = this.running;
    this.state.textContent = recording ? progress(recording) : "";
    this.state.classList.toggle("bad", Boolean(recording?.failure || recording?.dropped));
    this.none.hidden = bags.length > 0 || folder === null;
    const key = JSON.stringify(bags);
    if (key === this.key) return;
    this.key = key;
    this.rows.replaceChildren(...bags.map((bag) => this.row(bag)));
  }

  row(bag) {
    const query = new URLSearchParams(this.without("bag"));
    query.set("bag", bag.name);
    const begun = new Date(bag.start * 1000).toLocaleString();
    const open = h("a.button", { href: `?${query}#robot` }, "Play");
    open.setAttribute("aria-label", `Play ${bag.name}`);
    return h(
      "tr",
      {},
      h("th.mono", { scope: "row" }, bag.name, bag.cut ? h("span.warn", {}, " cut off") : ""),
      h("td", {}, begun),
      h("td.number", {}, `${bag.seconds.toFixed(1)} s`),
      h("td.number", {}, String(bag.messages)),
      h("td.number", {}, String(bag.topics)),
      h("td.number", {}, size(bag.bytes)),
      h("td", {}, h("div.row", {}, open, ...bag.files.map((file) => this.fetcher(bag, file)))),
    );
  }

  /** A button that fetches a file, piece by piece, so that neither side holds it in memory. */
  fetcher(bag, file) {
    const button = h("button", { type: "button", title: `${file.name}, ${size(file.bytes)}` }, "Download");
    button.setAttribute("aria-label", `Download ${file.name}`);
    button.onclick = async () => {
      button.disabled = true;
      try {
        const pieces = [];
        for (let offset = 0; ; ) {
          const piece = await this.link.request("robactor.readBag", { name: bag.name, file: file.name, offset });
          if (!piece.length) break;
          pieces.push(new Blob([piece]));
          offset += piece.length;
          button.textContent = `${Math.round((100 * offset) / file.bytes)} %`;
        }
        save(new Blob(pieces, { type: "application/octet-stream" }), file.name);
      } catch (error) {
        this.note.say(`${file.name}: ${error.message}`, true);
      }
      button.textContent = "Download";
      button.disabled = false;
    };
    return button;
  }

  /** The topics that there are, to be chosen from. */
  offer() {
    const chosen = new Set(this.chosen);
    const names = [...this.link.channels.keys()].sort();
    this.topics.replaceChildren(
      ...names.map((name) =>
        h("label.mono", {}, h("input", { type: "checkbox", value: name, checked: chosen.has(name) }), name),
      ),
    );
  }

  get chosen() {
    return [...this.topics.querySelectorAll("input:checked")].map(({ value }) => value);
  }

  choose() {
    this.topics.hidden = this.all.checked;
  }

  async record() {
    if (!this.all.checked && !this.chosen.length) return this.note.say("Choose a topic.", true);
    await this.ask("robactor.recordBag", {
      name: this.name.value.trim(),
      ...(this.all.checked ? {} : { topics: this.chosen }),
    });
    this.name.value = "";
  }

  stop() {
    return this.ask("robactor.stopRecording");
  }

  async ask(op, fields = {}) {
    this.button.disabled = true;
    try {
      await this.link.request(op, fields);
      this.note.say("");
    } catch (error) {
      this.note.say(error.message, true);
    }
    this.button.disabled = false;
    await this.look();
  }
}

function progress({ name, seconds, messages, dropped, bytes, topics, failure }) {
  const lost = dropped ? `, ${dropped} lost` : "";
  return failure
    ? `${name}: ${failure}`
    : `${name}: ${seconds.toFixed(0)} s, ${messages} messages of ${topics} topics${lost}, ${size(bytes)}`;
}

function size(bytes) {
  return bytes < 1e6 ? `${(bytes / 1e3).toFixed(0)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}

function save(blob, name) {
  const link = h("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
