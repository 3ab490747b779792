// What is not as it should be: what the server's doctor finds in the running system, and the robot's diagnostics.

import { h } from "../core/dom.js";

const LEVELS = ["ok", "warn", "error", "stale"];
const KINDS = ["good", "warn", "bad", "muted"];

export async function make(app) {
  return new DoctorPane(app);
}

class DoctorPane {
  constructor({ link }) {
    this.link = link;
    this.findings = h("ul.plain.stack", { "aria-label": "Findings" });
    this.diagnostics = h("tbody");
    this.none = h("p.muted", {}, "Nobody publishes /diagnostics.");
    this.element = h(
      "section.pane.doctor",
      { "aria-label": "Doctor" },
      h("div.card.stack", {}, h("h2", {}, "Findings"), this.findings),
      h(
        "div.card.stack",
        {},
        h("h2", {}, "Diagnostics"),
        this.none,
        h(
          "div.scroll",
          {},
          h(
            "table",
            {},
            h(
              "thead",
              {},
              h("tr", {}, ...["level", "what", "message", "values"].map((name) => h("th", { scope: "col" }, name))),
            ),
            this.diagnostics,
          ),
        ),
      ),
    );
    this.statuses = new Map();
    link.addEventListener("seek", () => this.statuses.clear());
    link.subscribe("/diagnostics", (message) => this.heard(message));
    link.addEventListener("findings", ({ detail }) => this.tell(detail));
    if (link.findings) this.tell(link.findings);
    else this.findings.append(h("li.muted", {}, "Looking …"));
  }

  heard(message) {
    for (const status of message.status) this.statuses.set(status.name, status);
    this.none.hidden = true;
    const worst = (status) => [0, 2, 3, 1][status.level] ?? 1;
    this.diagnostics.replaceChildren(
      ...[...this.statuses.values()]
        .sort((a, b) => worst(b) - worst(a) || a.name.localeCompare(b.name))
        .map((status) =>
          h(
            "tr",
            {},
            h("td", {}, h(`span.level.${KINDS[status.level] ?? "bad"}`, {}, LEVELS[status.level] ?? status.level)),
            h("td", {}, status.name),
            h("td", {}, status.message),
            h("td.mono.muted", {}, status.values.map(({ key, value }) => `${key} ${value}`).join(", ")),
          ),
        ),
    );
  }

  /**
   * Problems first, then notes; below each what was measured, and what helps. While only what was measured changes,
   * the links stay.
   */
  tell(found) {
    const sorted = [...found].sort((a, b) => Number(a.level === "note") - Number(b.level === "note"));
    const text = JSON.stringify(sorted.map(({ measured, ...rest }) => rest));
    if (text !== this.told) {
      this.told = text;
      this.measured = sorted.map(() => h("p.muted"));
      const rows = sorted.map((one, i) => this.row(one, this.measured[i]));
      this.findings.replaceChildren(...(rows.length ? rows : [h("li.good", {}, "Nothing to complain about.")]));
    }
    sorted.forEach(({ check, measured }, i) => (this.measured[i].textContent = `${check}: ${measured}`));
  }

  row({ level, subject, cause, remedy }, measured) {
    const address = this.addressOf(subject);
    const about = address ? h("a.mono", { href: `#${address}` }, subject) : h("b.mono", {}, subject);
    const kind = level === "problem" ? "bad" : "warn";
    return h(
      "li.finding",
      {},
      h(`span.level.${kind}`, {}, level),
      h("div", {}, h("p", {}, about, ` ${cause}`), measured, remedy ? h("p.muted", {}, `What helps: ${remedy}`) : ""),
    );
  }

  /** Where the graph shows a topic or a node. */
  addressOf(subject) {
    const { nodes = [], topics = [] } = this.link.system ?? {};
    const kind = nodes.some(({ name }) => name === subject)
      ? "node"
      : topics.some(({ name }) => name === subject)
        ? "topic"
        : "";
    return kind && `graph?${kind}=${encodeURIComponent(subject)}`;
  }
}
