// The parameters of every node: edited with their ranges, and beside each one why a change was refused.

import { brief, h, note, recall, remember } from "../core/dom.js";

const SUFFIX = "/set_parameters";
const FIELDS = [
  "",
  "bool_value",
  "integer_value",
  "double_value",
  "string_value",
  "byte_array_value",
  "bool_array_value",
  "integer_array_value",
  "double_array_value",
  "string_array_value",
];
const NAMES = ["not set", "bool", "integer", "double", "string", "bytes", "bools", "integers", "doubles", "strings"];
const [BOOL, INTEGER, DOUBLE, STRING] = [1, 2, 3, 4];
const EDITABLE = 1e6; // a range that is wider has no slider

export async function make(app) {
  return new ParametersPane(app);
}

class ParametersPane {
  constructor({ link, bridge, go }) {
    this.link = link;
    this.bridge = bridge;
    this.go = go;
    this.nodes = h("ul.plain.nodes", { "aria-label": "Nodes" });
    this.filter = h("input.grow", {
      type: "search",
      placeholder: "Filter parameters",
      "aria-label": "Filter parameters",
      oninput: () => this.sift(),
    });
    this.note = note();
    this.list = h("div.stack");
    this.title = h("h2.mono");
    this.element = h(
      "section.pane.parameters",
      { "aria-label": "Parameters" },
      h("div.card", {}, h("h3", {}, "Nodes"), this.nodes),
      h("div.stack", {}, h("div.row", {}, this.title, this.filter), this.note.element, this.list),
    );
    this.rows = new Map(); // parameter -> {element, take(value)}
    link.addEventListener("services", () => this.showNodes());
    link.addEventListener("system", () => this.showNodes());
    link.subscribe("/parameter_events", (event) => event.node === this.node && this.heard(event));
    this.showNodes();
  }

  show(query) {
    const node = query.get("node") ?? recall("parameters.node", "");
    if (node && node !== this.node) this.open(node);
    else if (!node) this.note.say("Choose a node.");
  }

  showNodes() {
    const served = [...this.link.services.keys()]
      .filter((name) => name.endsWith(SUFFIX))
      .map((name) => name.slice(0, -SUFFIX.length));
    const here = (this.link.system?.nodes ?? []).map(({ name }) => name); // their services are made when they are asked
    const names = [...new Set([...served, ...here])].filter((name) => !name.includes("/_")).sort();
    const key = names.join(" ");
    if (key === this.known) return;
    this.known = key;
    this.nodes.replaceChildren(
      ...names.map((name) =>
        h(
          "li",
          {},
          h(
            "button.quiet.link.mono",
            { type: "button", "aria-pressed": String(name === this.node), onclick: () => this.open(name) },
            name,
          ),
        ),
      ),
    );
  }

  async open(node) {
    this.node = node;
    remember("parameters.node", node);
    this.go(`parameters?node=${encodeURIComponent(node)}`, true);
    for (const button of this.nodes.querySelectorAll("button"))
      button.setAttribute("aria-pressed", String(button.textContent === node));
    this.title.textContent = node;
    this.rows.clear();
    this.list.replaceChildren();
    this.note.say("asking the node …");
    try {
      const { result } = await this.ask(node, "ListParameters", { prefixes: [], depth: 0 });
      const names = result.names;
      const [{ descriptors }, { values }] = await Promise.all([
        this.ask(node, "DescribeParameters", { names }),
        this.ask(node, "GetParameters", { names }),
      ]);
      if (this.node !== node) return;
      const rows = names.map((name, i) => this.row(descriptors[i], values[i]));
      this.list.replaceChildren(...rows);
      this.note.say(names.length ? "" : "This node has no parameters.");
      this.sift();
    } catch (error) {
      if (this.node === node) this.note.say(error.message, true);
    }
  }

  /** One of the services that every node has: "ListParameters" is `/node/list_parameters`. */
  ask(node, type, request) {
    const name = type.replace(/(?!^)[A-Z]/g, "_$&").toLowerCase();
    return this.bridge.call(`${node}/${name}`, request, `rcl_interfaces/srv/${type}`);
  }

  sift() {
    const text = this.filter.value.toLowerCase();
    for (const [name, { element }] of this.rows) element.hidden = !name.toLowerCase().includes(text);
  }

  heard(event) {
    for (const { name, value } of [...event.new_parameters, ...event.changed_parameters])
      this.rows.get(name)?.take(value);
  }

  row(descriptor, value) {
    const { name } = descriptor;
    const said = note("p.note.reason");
    const input = this.editor(descriptor, value, async (changed) => {
      try {
        const { results } = await this.ask(this.node, "SetParameters", { parameters: [{ name, value: changed }] });
        said.say(results[0].successful ? "changed" : results[0].reason || "refused", !results[0].successful);
        if (!results[0].successful) input.element.setAttribute("aria-invalid", "true");
        else input.element.removeAttribute("aria-invalid");
      } catch (error) {
        said.say(error.message, true);
      }
    });
    const element = h(
      "div.card.parameter",
      {},
      h(
        "div.row",
        {},
        h("label.mono.name", { htmlFor: input.id }, name),
        h("span.muted", {}, NAMES[value.type] ?? "", descriptor.read_only ? ", read-only" : ""),
      ),
      descriptor.description ? h("p.muted", {}, descriptor.description) : "",
      input.element,
      rangeText(descriptor),
      said.element,
    );
    this.rows.set(name, { element, take: input.take });
    return element;
  }

  /** The control for a value: {element, id, take(value)}. `change` is called with a ParameterValue. */
  editor(descriptor, value, change) {
    const id = `p-${descriptor.name.replace(/\W/g, "-")}`;
    const disabled = descriptor.read_only;
    const choices = choicesOf(descriptor);
    const type = value.type;
    const tell = (content) => change({ type, [FIELDS[type]]: content });
    if (type === BOOL) {
      const box = h("input", {
        id,
        type: "checkbox",
        disabled,
        checked: value.bool_value,
        onchange: () => tell(box.checked),
      });
      return { element: box, id, take: (next) => (box.checked = next.bool_value) };
    }
    if (type === STRING && choices) {
      const select = h(
        "select",
        { id, disabled, onchange: () => tell(select.value) },
        ...choices.map((choice) => h("option", { value: choice }, choice)),
      );
      select.value = value.string_value;
      return { element: select, id, take: (next) => (select.value = next.string_value) };
    }
    const show = (one) =>
      type >= 5
        ? JSON.stringify(one[FIELDS[type]] ?? [])
        : type === STRING
          ? one.string_value
          : brief(one[FIELDS[type]], 9);
    const field = h("input.mono", {
      id,
      disabled,
      type: "text",
      inputMode: type === INTEGER || type === DOUBLE ? "decimal" : "text",
      value: show(value),
      autocomplete: "off",
    });
    const slider = this.slider(descriptor, type, value, (text) => {
      field.value = text;
      tell(Number(text));
    });
    field.onchange = () => {
      const content = read(field.value, type);
      // the node says why it does not take that
      if (content === undefined) return change({ type: STRING, string_value: field.value });
      tell(content);
    };
    const take = (next) => {
      if (document.activeElement !== field) field.value = show(next);
      if (slider) slider.value = next[FIELDS[type]];
    };
    return { element: h("div.row", {}, field, slider ?? ""), id, take };
  }

  slider(descriptor, type, value, moved) {
    const range = (type === DOUBLE ? descriptor.floating_point_range : descriptor.integer_range)?.[0];
    if (!range || descriptor.read_only || !(range.to_value - range.from_value < EDITABLE)) return null;
    const step = range.step || (type === INTEGER ? 1 : (range.to_value - range.from_value) / 200);
    const slider = h("input.grow", {
      type: "range",
      min: range.from_value,
      max: range.to_value,
      step,
      "aria-label": `${descriptor.name} by slider`,
    });
    slider.value = value[FIELDS[type]];
    slider.onchange = () => moved(slider.value);
    return slider;
  }
}

/** What was written as a value of the type; undefined when it is none. */
function read(text, type) {
  if (type === STRING) return text;
  if (type === INTEGER || type === DOUBLE)
    return text.trim() === "" || Number.isNaN(Number(text)) ? undefined : Number(text);
  try {
    const list = JSON.parse(text);
    return Array.isArray(list) ? list : undefined;
  } catch {
    return undefined;
  }
}

function choicesOf({ additional_constraints: text }) {
  const found = /one of:? (.+)$/.exec(text ?? "");
  return found && found[1].split(/,\s*/).map((one) => one.replace(/^['"]|['".]$/g, ""));
}

function rangeText({ floating_point_range: doubles, integer_range: integers, additional_constraints: more }) {
  const range = doubles?.[0] ?? integers?.[0];
  const parts = [];
  if (range)
    parts.push(
      `from ${brief(range.from_value)} to ${brief(range.to_value)}` +
        (range.step ? ` in steps of ${brief(range.step)}` : ""),
    );
  if (more) parts.push(more);
  return parts.length ? h("p.muted.range", {}, parts.join("; ")) : "";
}
