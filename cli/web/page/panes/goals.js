// Every action: send a goal, watch its feedback, cancel it.

import { h, note, recall, remember } from "../core/dom.js";

const ENDS = { 4: "succeeded", 5: "canceled", 6: "aborted" };

export async function make(app) {
  return new GoalsPane(app);
}

class GoalsPane {
  constructor({ link, bridge, go }) {
    Object.assign(this, { link, bridge, go });
    this.actions = h("ul.plain.nodes", { "aria-label": "Actions" });
    this.title = h("h2.mono", {}, "Choose an action");
    this.type = h("p.mono.muted");
    this.text = h("textarea.mono", { rows: 8, spellcheck: false, "aria-label": "Goal, as JSON", disabled: true });
    this.send = h("button.primary", { type: "button", disabled: true, onclick: () => this.start() }, "Send goal");
    this.note = note();
    this.runs = h("div.stack", { "aria-label": "Goals", role: "log" });
    this.element = h(
      "section.pane.goals", { "aria-label": "Goals" },
      h("div.card", {}, h("h3", {}, "Actions"), this.actions),
      h("div.stack", {}, h("div.card.stack", {}, this.title, this.type, this.text, h("div.row", {}, this.send, this.note.element)), this.runs),
    );
    link.addEventListener("system", ({ detail }) => this.offer(detail));
    if (link.system) this.offer(link.system);
  }

  show(query) {
    this.asked = query.get("action") ?? recall("goals.action", "");
    if (this.known) this.open(this.known.get(this.asked));
  }

  offer({ services }) {
    const found = services.filter((service) => service.kind === "action").sort((a, b) => a.name.localeCompare(b.name));
    const key = found.map(({ name }) => name).join(" ");
    if (key === this.key) return;
    this.key = key;
    this.known = new Map(found.map((action) => [action.name, action]));
    this.actions.replaceChildren(...found.map((action) => h("li", {}, h("button.quiet.link.mono", { type: "button", "aria-pressed": String(action.name === this.action?.name), onclick: () => this.open(action) }, action.name))));
    if (!found.length) this.actions.append(h("li.muted", {}, "no actions here"));
    if (!this.action && this.asked) this.open(this.known.get(this.asked));
  }

  async open(action) {
    if (!action || action.name === this.action?.name) return;
    this.action = action;
    remember("goals.action", action.name);
    this.go(`goals?action=${encodeURIComponent(action.name)}`, true);
    for (const button of this.actions.querySelectorAll("button")) button.setAttribute("aria-pressed", String(button.textContent === action.name));
    this.title.textContent = action.name;
    this.type.textContent = action.type;
    this.text.value = "…";
    try {
      const { typedefs } = await this.bridge.call("/rosapi/action_goal_details", { type: action.type });
      if (this.action !== action) return;
      this.text.value = JSON.stringify(template(typedefs), null, 2);
    } catch (error) {
      this.text.value = "{}";
      this.note.say(error.message, true);
    }
    this.text.disabled = this.send.disabled = false;
  }

  async start() {
    let args;
    try {
      args = JSON.parse(this.text.value);
    } catch (error) {
      return this.note.say(`The goal is no JSON: ${error.message}`, true);
    }
    this.note.say("");
    const { name, type } = this.action;
    const state = h("b", {}, "sent");
    const feedback = h("pre.mono");
    const cancel = h("button.danger", { type: "button" }, "Cancel");
    const card = h("div.card.stack.run", {}, h("div.row", {}, h("span.mono.grow", {}, name), state, cancel), feedback);
    this.runs.prepend(card);
    const tell = (text, kind = "") => {
      state.textContent = text;
      state.className = kind;
    };
    try {
      const goal = await this.bridge.goal(name, type, args, (values) => {
        tell("running", "warn");
        feedback.textContent = JSON.stringify(values, null, 1);
      });
      cancel.onclick = () => goal.cancel();
      const { status, values, succeeded } = await goal.result;
      tell(ENDS[status] ?? `ended with status ${status}`, succeeded ? "good" : "bad");
      feedback.textContent = typeof values === "string" ? values : JSON.stringify(values, null, 1);
    } catch (error) {
      tell("failed", "bad");
      feedback.textContent = error.message;
    }
    cancel.remove();
  }
}

/** A goal with the default of every field, from rosapi's description of types: [{type, fieldnames, fieldtypes, fieldarraylen}]. */
function template(typedefs) {
  const byType = new Map(typedefs.map((one) => [one.type.replace("/msg/", "/"), one]));
  const make = (typedef, depth) => {
    const found = {};
    typedef?.fieldnames.forEach((name, i) => {
      const type = typedef.fieldtypes[i].replace("/msg/", "/");
      const length = typedef.fieldarraylen[i];
      const one = () => (type === "string" || type === "wstring" ? "" : type === "bool" || type === "boolean" ? false : byType.has(type) && depth < 8 ? make(byType.get(type), depth + 1) : 0);
      found[name] = length === -1 ? one() : length > 0 ? Array.from({ length }, one) : [];
    });
    if (typedef?.type.endsWith("/Quaternion")) found.w = 1;
    if (typedef?.type.endsWith("/Header")) found.frame_id = "map";
    return found;
  };
  return make(typedefs[0], 0);
}
