// Every action: fill its goal in, send it, watch its feedback, cancel it.

import { h, note, recall, remember } from "../core/dom.js";
import { Form } from "../core/form.js";

const ENDS = { 0: "refused", 4: "succeeded", 5: "canceled", 6: "aborted" };

export async function make(app) {
  return new GoalsPane(app);
}

class GoalsPane {
  constructor({ link, bridge, go }) {
    this.link = link;
    this.bridge = bridge;
    this.go = go;
    this.actions = h("ul.plain.nodes", { "aria-label": "Actions" });
    this.title = h("h2.mono", {}, "Choose an action");
    this.type = h("p.mono.muted");
    this.fields = h("form", {
      id: "goal",
      "aria-label": "Goal",
      noValidate: true,
      onsubmit: (event) => (event.preventDefault(), this.start()),
    });
    this.text = h("textarea.mono", { rows: 8, spellcheck: false, "aria-label": "Goal, as JSON", hidden: true });
    this.asText = h(
      "button",
      { type: "button", "aria-pressed": "false", disabled: true, onclick: () => this.turn() },
      "As JSON",
    );
    this.send = h("button.primary", { type: "submit", disabled: true }, "Send goal");
    this.send.setAttribute("form", "goal"); // it stands outside of it, and Enter in a field presses it
    this.note = note();
    this.runs = h("div.stack", { "aria-label": "Goals", role: "log" });
    this.element = h(
      "section.pane.goals",
      { "aria-label": "Goals" },
      h("div.card", {}, h("h3", {}, "Actions"), this.actions),
      h(
        "div.stack",
        {},
        h(
          "div.card.stack",
          {},
          this.title,
          this.type,
          this.fields,
          this.text,
          h("div.row", {}, this.send, this.asText, this.note.element),
        ),
        this.runs,
      ),
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
    this.actions.replaceChildren(
      ...found.map((action) =>
        h(
          "li",
          {},
          h(
            "button.quiet.link.mono",
            {
              type: "button",
              "aria-pressed": String(action.name === this.action?.name),
              onclick: () => this.open(action),
            },
            action.name,
          ),
        ),
      ),
    );
    if (!found.length) this.actions.append(h("li.muted", {}, "no actions here"));
    if (!this.action && this.asked) this.open(this.known.get(this.asked));
  }

  async open(action) {
    if (!action || action.name === this.action?.name) return;
    this.action = action;
    remember("goals.action", action.name);
    this.go(`goals?action=${encodeURIComponent(action.name)}`, true);
    for (const button of this.actions.querySelectorAll("button"))
      button.setAttribute("aria-pressed", String(button.textContent === action.name));
    this.title.textContent = action.name;
    this.type.textContent = action.type;
    this.form = null;
    this.fields.replaceChildren();
    this.note.say("");
    if (!this.text.hidden) this.turn();
    this.send.disabled = this.asText.disabled = true;
    try {
      const { typedefs } = await this.bridge.call("/rosapi/action_goal_details", { type: action.type });
      if (this.action !== action) return;
      this.form = new Form(typedefs);
      this.fields.replaceChildren(this.form.element);
      this.asText.disabled = false;
    } catch (error) {
      if (this.action !== action) return;
      this.note.say(`${error.message}: write the goal as JSON`, true);
      this.text.value = "{}";
      this.text.hidden = false;
    }
    this.send.disabled = false;
  }

  /** From the form to the text and back, with what is written. */
  turn() {
    const toText = this.text.hidden;
    const goal = this.form && (toText ? this.form.read() : this.written());
    if (this.form && goal === undefined) return;
    if (toText) this.text.value = JSON.stringify(goal, null, 2);
    else
      try {
        this.form?.fill(goal);
      } catch (error) {
        return this.note.say(error.message, true);
      }
    this.note.say("");
    this.text.hidden = !toText;
    this.fields.hidden = toText;
    this.asText.setAttribute("aria-pressed", String(toText));
  }

  /** The goal of the text; undefined, with the reason, when it is none. */
  written() {
    try {
      return JSON.parse(this.text.value);
    } catch (error) {
      this.note.say(`The goal is no JSON: ${error.message}`, true);
    }
  }

  async start() {
    const form = this.text.hidden ? this.form : null;
    const args = form ? form.read() : this.written();
    if (args === undefined) return;
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
      if (status === 0 && this.form === form) form?.blame(String(values).replace(/^Action goal was rejected: /, ""));
    } catch (error) {
      tell("failed", "bad");
      feedback.textContent = error.message;
    }
    cancel.remove();
  }
}
