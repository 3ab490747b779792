// Click to go: a place on the floor, and by dragging the heading there.

import { brief, h, note, writing } from "../core/dom.js";

const ACTION = "/navigate_to_pose";
const TYPE = "nav2_msgs/action/NavigateToPose";
const TURN = 0.25; // m that a drag must be long to mean a heading

export class GoTo {
  constructor(bridge, world) {
    this.bridge = bridge;
    this.world = world;
    this.aim = null;
    this.picking = false;
    this.note = note();
    this.progress = h("progress", { max: 1, value: 0, hidden: true, "aria-label": "Share of the way that is done" });
    this.cancel = h("button.danger", { type: "button", hidden: true, onclick: () => this.goal?.cancel() }, "Cancel");
    this.button = h(
      "button",
      { type: "button", "aria-pressed": "false", title: "Click to go (G)", onclick: () => this.pick(!this.picking) },
      "Go to…",
    );
    this.element = h(
      "div.stack",
      {},
      h("p.muted", {}, "Press “Go to…” and click on the floor; drag to choose the heading."),
      this.note.element,
      this.progress,
      this.cancel,
    );
    addEventListener("keydown", (event) => {
      if (event.key === "g" && !writing(event) && this.button.isConnected) this.pick(!this.picking);
    });
  }

  /** Take places from this view from now on. */
  use(view) {
    this.view = view;
    view.element.addEventListener("pointerdown", (event) => this.down(event));
    view.element.addEventListener("pointermove", (event) => this.move(event));
    view.element.addEventListener("pointerup", () => this.up());
    this.pick(this.picking);
  }

  pick(on) {
    this.picking = on;
    this.view.steering = on;
    this.button.setAttribute("aria-pressed", String(on));
    this.view.element.style.cursor = on ? "crosshair" : "";
    if (!on) this.aim = null;
  }

  down(event) {
    const place = this.picking && event.button === 0 ? this.view.floorAt(event.clientX, event.clientY) : null;
    if (!place) return;
    this.view.element.setPointerCapture(event.pointerId);
    const from = this.world.pose?.p ?? [0, 0, 0];
    this.aim = { ...place, heading: Math.atan2(place.y - from[1], place.x - from[0]) };
    this.dragging = true;
  }

  move(event) {
    if (!this.dragging) return;
    const place = this.view.floorAt(event.clientX, event.clientY);
    if (place && Math.hypot(place.x - this.aim.x, place.y - this.aim.y) > TURN)
      this.aim.heading = Math.atan2(place.y - this.aim.y, place.x - this.aim.x);
  }

  up() {
    if (!this.dragging) return;
    this.dragging = false;
    const aim = this.aim;
    this.pick(false);
    this.start(aim);
  }

  async start({ x, y, heading }) {
    const pose = {
      position: { x, y, z: 0 },
      orientation: { x: 0, y: 0, z: Math.sin(heading / 2), w: Math.cos(heading / 2) },
    };
    const stamped = { header: { frame_id: this.world.fixed }, pose };
    this.note.say(`Going to ${brief(x, 2)}, ${brief(y, 2)} m`);
    try {
      const goal = await this.bridge.goal(ACTION, TYPE, { pose: stamped }, (feedback) => this.feedback(goal, feedback));
      this.goal = goal;
      this.whole = this.progress.value = 0;
      this.progress.hidden = this.cancel.hidden = false;
      const { status, values, succeeded } = await goal.result;
      if (this.goal !== goal) return; // a later one took its place
      this.note.say(text(status, values, this.world.latest.safety), !succeeded);
    } catch (error) {
      this.note.say(error.message, true);
    }
    this.progress.hidden = this.cancel.hidden = true;
  }

  feedback(goal, { distance_remaining: left }) {
    if (this.goal !== goal) return;
    this.whole = Math.max(this.whole, left); // a way that grows longer does not take back what has been done
    this.progress.value = Math.max(this.progress.value, this.whole ? 1 - left / this.whole : 1);
    this.note.say(`${brief(left, 1)} m left`);
  }
}

function text(status, values, safety) {
  if (status === 5)
    return safety?.stopped ? `Canceled: the robot was stopped (${safety.reasons.join("; ")})` : "Canceled";
  const end = { 4: "Arrived", 6: "Aborted" }[status] ?? `Ended with status ${status}`;
  const why = typeof values === "string" ? values : values?.error_msg;
  return why ? `${end}: ${why}` : end;
}
