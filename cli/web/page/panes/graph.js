// Nodes and topics, as they talk now; the supervisor tree, with lives and restarts; a button that lets a node fail.

import { brief, h, note, recall, remember } from "../core/dom.js";
import { layout } from "../graph/layout.js";
import { Canvas } from "../graph/canvas.js";
import { messageText } from "../graph/message.js";
import { processList } from "../graph/processes.js";

const QUIET = new Set(["/rosout", "/parameter_events", "/tf", "/tf_static", "/diagnostics", "/clock"]);
const SURE = 4000; // ms in which a second click kills
const EVERY = 200; // ms between two looks at the newest message of the topic that is selected
const FEW = 15; // nodes of which all are shown at first
const AWAY = "elsewhere"; // the state of a node of another process that tells nothing of it

export async function make(app) {
  return new GraphPane(app);
}

class GraphPane {
  constructor({ link, go }) {
    this.link = link;
    this.go = go;
    this.quiet = h("input", { type: "checkbox", onchange: () => this.changed(this.quiet.checked) });
    this.filter = h("input.grow", {
      type: "search",
      placeholder: "Filter nodes and topics",
      "aria-label": "Filter nodes and topics",
      oninput: () => this.changed(),
    });
    this.canvas = new Canvas((item) => this.select(item));
    this.empty = h("p.empty.muted", { role: "status", hidden: true });
    this.canvas.element.append(this.empty);
    this.tree = h("div.tree");
    this.places = h("div.card.stack", { hidden: true });
    this.details = h("div.card.stack.details", { "aria-live": "polite" }, h("p.muted", {}, "Click a node or a topic."));
    this.message = h("pre.message.mono", { "aria-live": "off", "aria-label": "Newest message", tabIndex: 0 });
    this.note = note();
    this.element = h(
      "section.pane.graph",
      { "aria-label": "Graph" },
      h(
        "div.main",
        {},
        h(
          "div.bar",
          {},
          this.filter,
          h("label", {}, this.quiet, "Hide the quiet ones"),
          h("button", { type: "button", onclick: () => this.canvas.fit(true) }, "Fit"),
        ),
        this.canvas.element,
      ),
      (this.side = h(
        "div.side.stack",
        {},
        this.details,
        h("div.card.stack", {}, (this.title = h("h2")), this.note.element, this.tree),
        this.places,
      )),
    );
    link.addEventListener("system", ({ detail }) => this.update(detail));
    if (link.system) this.update(link.system);
  }

  show(query) {
    if (query.has("node")) this.selected = { kind: "node", name: query.get("node") };
    if (query.has("topic")) this.selected = { kind: "topic", name: query.get("topic") };
    this.shown = true;
    if (this.system) this.update(this.system);
  }

  hide() {
    this.shown = false;
    this.listen(null);
  }

  /** Listen to this topic for its newest message, and to no other; null: to none. */
  listen(name) {
    if (name === this.heard) return;
    this.heard = name;
    this.latest?.stop();
    this.latest = name === null ? null : this.link.latest(name);
    this.looked = 0;
    this.message.textContent = name === null ? "" : "No message has come yet.";
  }

  /** Once a picture: the newest message, as it is. */
  frame() {
    if (!this.latest || performance.now() - this.looked < EVERY) return;
    const message = this.latest.take();
    if (message === null) return;
    this.looked = performance.now();
    this.message.textContent = messageText(message);
  }

  changed(quiet) {
    if (quiet !== undefined) remember("graph.quiet", quiet);
    this.drawn = undefined;
    if (this.system) this.update(this.system);
  }

  select(item) {
    this.selected = item;
    this.go(`graph?${item.kind}=${encodeURIComponent(item.name)}`, true);
    this.update(this.system);
    this.side.scrollTop = 0;
  }

  update(system) {
    this.system = system;
    if (!this.shown) return;
    const seen = system.nodes.filter(({ name }) => !hidden(name));
    this.quiet.checked = recall("graph.quiet", seen.length > FEW);
    const { nodes, edges } = this.parts(system);
    this.showEmpty(nodes, seen);
    const key = JSON.stringify([nodes.map(({ id }) => id), edges.map(({ from, to, bad }) => [from, to, bad])]);
    if (key !== this.drawn) {
      this.drawn = key;
      this.canvas.show(layout(nodes, edges, this.canvas.shape));
    }
    const rates = new Map(
      system.topics.map((topic) => [`topic ${topic.name}`, topic.rate ? ` ${brief(topic.rate, 1)} Hz` : ""]),
    );
    this.canvas.label(rates);
    this.canvas.mark(this.selected ? `${this.selected.kind} ${this.selected.name}` : "");
    this.showTree(system);
    this.showDetails(system);
    this.showPlaces(system);
  }

  /** Why nothing is drawn, and what to do. */
  showEmpty(nodes, seen) {
    this.empty.hidden = nodes.length > 0;
    if (nodes.length) return;
    const [nobody, nothing] = [
      "No nodes are found in this domain yet: start one, or run robactor doctor.",
      `Nothing has “${this.filter.value.trim()}” in its name.`,
    ];
    const text = this.filter.value.trim()
      ? nothing
      : seen.length
        ? `Nothing talks to anything else yet; ${seen.length} node${seen.length > 1 ? "s are" : " is"} hidden as quiet.`
        : nobody;
    if (this.empty.textContent !== text) this.empty.textContent = text;
  }

  parts(system) {
    const text = this.filter.value.trim().toLowerCase();
    const match = (name) => !text || name.toLowerCase().includes(text);
    const topics = system.topics.filter(
      (topic) =>
        !this.quiet.checked ||
        (!QUIET.has(topic.name) && topic.publishers.length && (topic.subscriptions.length || this.link.recording)) ||
        topic.mismatches.length,
    );
    const edges = [];
    for (const topic of topics) {
      const bad = topic.mismatches.length > 0;
      for (const { node } of topic.publishers) edges.push({ from: `node ${node}`, to: `topic ${topic.name}`, bad });
      for (const { node } of topic.subscriptions) edges.push({ from: `topic ${topic.name}`, to: `node ${node}`, bad });
    }
    let kept = edges.filter(({ from, to }) => ![from, to].some((id) => hidden(id.slice(id.indexOf(" ") + 1))));
    if (text) kept = kept.filter(({ from, to }) => match(from) || match(to));
    const ids = new Set(kept.flatMap(({ from, to }) => [from, to]));
    if (!this.quiet.checked)
      for (const node of system.nodes) if (match(node.name) && !hidden(node.name)) ids.add(`node ${node.name}`);
    const bad = new Set(topics.filter((topic) => topic.mismatches.length).map((topic) => `topic ${topic.name}`));
    const nodes = [...ids].map((id) => ({
      id,
      kind: id.split(" ")[0],
      name: id.slice(id.indexOf(" ") + 1),
      bad: bad.has(id),
    }));
    return { nodes, edges: kept };
  }

  showTree(system) {
    const key = JSON.stringify([
      system.nodes.map((node) => [node.name, node.path, node.state, node.incarnation, node.host, node.process]),
      system.restarts,
      system.canKill,
    ]);
    if (key === this.treeKey) return;
    this.treeKey = key;
    const focus = /** @type {HTMLElement} */ (document.activeElement)?.dataset?.node;
    const root = { children: new Map() };
    for (const node of system.nodes.filter(({ name }) => !hidden(name))) {
      let here = root;
      const parts = (node.path || node.name).split("/").filter(Boolean);
      parts.forEach((part, i) => {
        if (!here.children.has(part)) here.children.set(part, { children: new Map() });
        here = here.children.get(part);
        if (i === parts.length - 1) here.node = node;
      });
    }
    this.title.textContent = system.nodes.some(({ name, path }) => path && !hidden(name)) ? "Supervisor tree" : "Nodes";
    this.tree.replaceChildren(this.branch(root, system));
    if (focus) this.tree.querySelector(`[data-node="${CSS.escape(focus)}"]`)?.focus();
  }

  showPlaces(system) {
    if (this.places.matches(":hover, :focus-within")) return; // do not take away what is being read or clicked
    const list = processList(system, (name) => this.nodeLink(name));
    this.places.hidden = !list;
    this.places.replaceChildren(h("h2", {}, "Hosts and processes"), list);
  }

  branch({ children }, system) {
    return h(
      "ul",
      {},
      ...[...children].map(([name, child]) =>
        h(
          "li",
          {},
          child.node ? this.leaf(name, child.node, system) : h("span.supervisor", {}, name),
          child.children.size ? this.branch(child, system) : "",
        ),
      ),
    );
  }

  leaf(name, node, system) {
    const restarts = system.restarts[node.name] ?? Math.max(0, node.incarnation - 1);
    const where = [node.host, node.process].filter((part) => part && part !== "here").join(" ");
    const open = h(
      "button.quiet.link",
      { type: "button", onclick: () => this.select({ kind: "node", name: node.name }) },
      name,
    );
    open.dataset.node = node.name;
    const kill = system.canKill && node.path ? this.killer(node.name) : "";
    return h(
      "span.leaf",
      {},
      h(`i.dot.${/run|active|start/.test(node.state) ? "on" : node.state === AWAY ? "away" : "off"}`, {
        title: stateOf(node),
      }),
      open,
      node.incarnation
        ? h("span.life", { title: "which life of the node this is" }, `#${node.incarnation}`)
        : h("span.life", {}, stateOf(node)),
      restarts ? h("span.warn", {}, `${restarts} restart${restarts > 1 ? "s" : ""}`) : "",
      where ? h("span.muted", {}, where) : "",
      kill,
    );
  }

  killer(name) {
    const button = h(
      "button.danger.kill",
      { type: "button", title: `Let ${name} fail; its supervisor restarts it` },
      "Kill",
    );
    button.setAttribute("aria-label", `Kill ${name}`);
    button.onclick = async () => {
      if (button.textContent === "Kill") {
        button.textContent = "Sure?";
        setTimeout(() => (button.textContent = "Kill"), SURE);
        return;
      }
      button.textContent = "Kill";
      try {
        await this.link.killNode(name);
        this.note.say(`${name} was killed; its supervisor restarts it`);
      } catch (error) {
        this.note.say(error.message, true);
      }
    };
    return button;
  }

  showDetails(system) {
    const { kind, name } = this.selected ?? {};
    this.listen(kind === "topic" && system.topics.some((one) => one.name === name) ? name : null);
    if (kind === "node") this.showNode(system, name);
    else if (kind === "topic") this.showTopic(system, name);
  }

  showNode(system, name) {
    const node = system.nodes.find((one) => one.name === name);
    const of = (side) =>
      system.topics
        .filter((topic) => topic[side].some((edge) => edge.node === name))
        .map((topic) => this.topicLink(topic.name));
    const called = system.services.filter((service) => service.clients.includes(name));
    const served = system.services.filter(
      (service) =>
        service.server === name &&
        !/\/(get|set|list|describe)_parameter|get_type_description|set_parameters_atomically/.test(service.name),
    );
    const known = [
      ["state", node && stateOf(node)],
      ["life", node?.incarnation],
      ["handled", node?.handled],
      ["waiting", node?.waiting],
      ["slowest", node?.slowest || "–"],
    ];
    const facts = !node ? [] : node.state === AWAY ? known.slice(0, 1) : known;
    this.replaceDetails(
      h("h2.mono", {}, name),
      node ? "" : h("p.muted", {}, "not in this system's tree"),
      h("div.facts", {}, ...facts.map(([key, value]) => h("span", {}, `${key} `, h("b", {}, brief(value))))),
      h("a", { href: `#parameters?node=${encodeURIComponent(name)}` }, "its parameters"),
      list("publishes", of("publishers")),
      list("takes", of("subscriptions")),
      list(
        "serves",
        served.map((service) => h("span.mono", {}, service.name)),
      ),
      list(
        "calls",
        called.map((service) =>
          h(
            "span",
            {},
            h("span.mono", {}, service.name),
            service.server ? [" of ", this.nodeLink(service.server)] : "",
          ),
        ),
      ),
    );
  }

  showTopic(system, name) {
    const topic = system.topics.find((one) => one.name === name);
    if (!topic)
      return this.replaceDetails(h("h2.mono", {}, name), h("p.muted", {}, "nobody publishes or takes it now"));
    const rows = (side) =>
      topic[side].map((edge) =>
        h(
          "span",
          {},
          this.nodeLink(edge.node),
          " ",
          h("span.muted", {}, edge.qos),
          edge.dropped ? h("b.warn", {}, ` ${edge.dropped} dropped`) : "",
        ),
      );
    this.replaceDetails(
      h("h2.mono", {}, name),
      h("p.mono.muted", {}, topic.types.join(", ")),
      h(
        "p",
        {},
        topic.messages || topic.rate
          ? `${brief(topic.rate ?? 0, 1)} messages a second, ${topic.messages} so far`
          : "none seen: nobody takes it here",
      ),
      ...topic.mismatches.map((text) => h("p.bad", {}, text)),
      this.message,
      list("publishers", rows("publishers")),
      list("subscriptions", rows("subscriptions")),
    );
  }

  replaceDetails(...children) {
    if (
      this.details.matches(":hover, :focus-within") &&
      this.details.dataset.of === `${this.selected.kind} ${this.selected.name}`
    )
      return; // do not take away what is being read or clicked
    this.details.dataset.of = `${this.selected.kind} ${this.selected.name}`;
    this.details.replaceChildren(...children.filter(Boolean));
  }

  topicLink(name) {
    return h("button.quiet.link.mono", { type: "button", onclick: () => this.select({ kind: "topic", name }) }, name);
  }

  nodeLink(name) {
    return h("button.quiet.link.mono", { type: "button", onclick: () => this.select({ kind: "node", name }) }, name);
  }
}

function hidden(name) {
  return name.split("/").some((part) => part.startsWith("_"));
}

function stateOf({ state }) {
  return state === AWAY ? "other process" : state;
}

function list(title, items) {
  return items.length
    ? h("div", {}, h("h3", {}, title), h("ul.plain", {}, ...items.map((item) => h("li", {}, item))))
    : "";
}
