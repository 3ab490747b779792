// What is not as it should be: the robot's diagnostics, and what the running system shows.

import { h } from "../core/dom.js";

const LEVELS = ["ok", "warn", "error", "stale"];
const KINDS = ["good", "warn", "bad", "muted"];
const SLOW = 0.5; // s, a handler that held its node up

export async function make(app) {
  return new DoctorPane(app);
}

class DoctorPane {
  constructor({ link }) {
    this.findings = h("div.stack");
    this.diagnostics = h("tbody");
    this.none = h("p.muted", {}, "Nobody publishes /diagnostics.");
    this.element = h(
      "section.pane.doctor", { "aria-label": "Doctor" },
      h("div.card.stack", {}, h("h2", {}, "Findings"), this.findings),
      h("div.card.stack", {}, h("h2", {}, "Diagnostics"), this.none, h("div.scroll", {}, h("table", {}, h("thead", {}, h("tr", {}, ...["level", "what", "message", "values"].map((name) => h("th", { scope: "col" }, name)))), this.diagnostics))),
    );
    this.statuses = new Map();
    link.addEventListener("seek", () => this.statuses.clear());
    link.subscribe("/diagnostics", (message) => this.heard(message));
    link.addEventListener("system", ({ detail }) => this.judge(detail));
    if (link.system) this.judge(link.system);
    else this.findings.append(h("p.muted", {}, "This server tells nothing of the system behind it."));
  }

  heard(message) {
    for (const status of message.status) this.statuses.set(status.name, status);
    this.none.hidden = true;
    const worst = (status) => [0, 2, 3, 1][status.level] ?? 1;
    this.diagnostics.replaceChildren(
      ...[...this.statuses.values()].sort((a, b) => worst(b) - worst(a) || a.name.localeCompare(b.name)).map((status) =>
        h("tr", {}, h("td", {}, h(`span.level.${KINDS[status.level] ?? "bad"}`, {}, LEVELS[status.level] ?? status.level)), h("td", {}, status.name), h("td", {}, status.message), h("td.mono.muted", {}, status.values.map(({ key, value }) => `${key} ${value}`).join(", "))),
      ),
    );
  }

  judge(system) {
    const found = [];
    for (const topic of system.topics) {
      for (const text of topic.mismatches) found.push(["bad", `${topic.name}: ${text}`, `graph?topic=${topic.name}`]);
      if (topic.types.length > 1) found.push(["bad", `${topic.name} has several types: ${topic.types.join(", ")}`, `graph?topic=${topic.name}`]);
      for (const edge of topic.subscriptions) if (edge.dropped > 0) found.push(["warn", `${edge.node} lost ${edge.dropped} messages of ${topic.name}: it reads more slowly than they come`, `graph?topic=${topic.name}`]);
    }
    for (const [node, count] of Object.entries(system.restarts)) if (count) found.push(["warn", `${node} was restarted ${count} time${count > 1 ? "s" : ""}`, `graph?node=${node}`]);
    for (const node of system.nodes) {
      if (secondsOf(node.slowest) > SLOW) found.push(["warn", `${node.name}: a handler held it up: ${node.slowest}`, `graph?node=${node.name}`]);
      if (!/run|active|start|idle/.test(node.state)) found.push(["bad", `${node.name} is ${node.state}`, `graph?node=${node.name}`]);
    }
    const key = JSON.stringify(found);
    if (key === this.key) return;
    this.key = key;
    this.findings.replaceChildren(...(found.length ? found.map(([kind, text, address]) => h("p.finding", {}, h(`span.level.${kind}`, {}, kind === "bad" ? "error" : "warn"), h("a", { href: `#${address}` }, text))) : [h("p.good", {}, "Nothing to complain about.")]));
  }
}

/** "Battery.load 0.0511 s" -> 0.0511. */
function secondsOf(text) {
  return Number(/([\d.e+-]+) s$/.exec(text)?.[1] ?? 0);
}
