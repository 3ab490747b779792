// Driving by hand: keys, and a stick on the screen for mouse and finger. Commands go out while something is held, and a
// last one of zero.

import { h, writing } from "../core/dom.js";

const TOPIC = "/teleop/cmd_vel";
const EVERY = 100; // ms between commands; the robot forgets them after 0.5 s
const SPEED = { forward: 0.6, sideways: 0.3, turn: 0.9 }; // m/s, m/s, rad/s
const FAST = 1.6; // times as fast with Shift
const KEYS = {
  w: [1, 0, 0],
  arrowup: [1, 0, 0],
  s: [-0.6, 0, 0],
  arrowdown: [-0.6, 0, 0],
  a: [0, 0, 1],
  arrowleft: [0, 0, 1],
  d: [0, 0, -1],
  arrowright: [0, 0, -1],
  q: [0, 1, 0],
  e: [0, -1, 0],
};

export class Drive {
  constructor(link, refused) {
    this.link = link;
    this.refused = refused; // () => why the robot would not walk now, or ""
    this.held = new Set();
    this.stick = null;
    this.fast = false;
    this.hint = h("p.note", { role: "status" });
    this.knob = h("span.knob");
    this.pad = h(
      "div.stick",
      { tabIndex: 0, role: "application", "aria-label": "Stick: drag to walk and turn, or use the keys W A S D Q E" },
      this.knob,
    );
    this.pad.onpointerdown = (event) => this.grab(event);
    this.pad.onpointermove = (event) => this.stick && this.grab(event);
    this.pad.onpointerup = this.pad.onpointercancel = this.pad.onlostpointercapture = () => this.release();
    addEventListener("keydown", (event) => this.key(event, true));
    addEventListener("keyup", (event) => this.key(event, false));
    addEventListener("blur", () => this.let());
    this.active = false;
  }

  key(event, down) {
    const name = event.key.toLowerCase();
    this.fast = event.shiftKey;
    if (!(name in KEYS) || (down && (!this.active || writing(event) || event.ctrlKey || event.metaKey || event.altKey)))
      return;
    if (down) this.held.add(name);
    else this.held.delete(name);
    if (down) event.preventDefault();
    this.run();
  }

  grab(event) {
    event.preventDefault();
    this.pad.setPointerCapture(event.pointerId);
    const box = this.pad.getBoundingClientRect();
    const reach = box.width / 2 - 24;
    let x = (event.clientX - box.left - box.width / 2) / reach;
    let y = (event.clientY - box.top - box.height / 2) / reach;
    const length = Math.max(1, Math.hypot(x, y));
    [x, y] = [x / length, y / length];
    this.knob.style.transform = `translate(${x * reach}px, ${y * reach}px)`;
    this.stick = [-y, 0, -x];
    this.run();
  }

  release() {
    if (!this.stick) return;
    this.stick = null;
    this.knob.style.transform = "";
    this.run();
  }

  /** Nothing is held any more: the window was left, or the pane. */
  let() {
    this.held.clear();
    this.release();
    this.run();
  }

  /** What is asked for now: [forward, left, turn], each -1..1; null when nothing is held. */
  get wish() {
    if (this.stick) return this.stick;
    if (!this.held.size) return null;
    const sum = [0, 0, 0];
    for (const key of this.held) KEYS[key].forEach((one, i) => (sum[i] += one));
    return sum.map((one) => Math.max(-1, Math.min(1, one)));
  }

  run() {
    const driving = this.wish !== null;
    if (driving && !this.timer) {
      this.timer = setInterval(() => this.send(), EVERY);
      this.send();
    } else if (!driving && this.timer) {
      clearInterval(this.timer);
      this.timer = undefined;
      this.publish([0, 0, 0]);
      this.hint.textContent = "";
    }
  }

  send() {
    this.hint.textContent = this.refused();
    this.publish(this.wish ?? [0, 0, 0]);
  }

  /** @param {number[]} wish */
  publish([forward, left, turn]) {
    const scale = this.fast ? FAST : 1;
    const linear = { x: forward * SPEED.forward * scale, y: left * SPEED.sideways * scale };
    this.link.publish(TOPIC, "geometry_msgs/msg/Twist", { linear, angular: { z: turn * SPEED.turn * scale } });
  }
}
