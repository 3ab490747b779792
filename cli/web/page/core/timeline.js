// The bar under a recording: play and stand still, step, rate, again and again, and any time of it. Other viewers of
// the recording see the same.

import { brief, find, h, icon, writing } from "./dom.js";

const RATES = [0.1, 0.25, 0.5, 1, 2, 5, 10];
const STEP = "/rosbag2_player/play_next";
const PLAY = "M4 2l10 6-10 6z";
const PAUSE = "M3 2h4v12H3zM9 2h4v12H9z";
const NEXT = "M2 2l8 6-8 6zM11 2h3v12h-3z";
const AGAIN = "M8 2a6 6 0 1 1-5.7 4.1l1.9.6A4 4 0 1 0 8 4v2.5L3.5 3 8-.5z";

export class Timeline {
  /** `back` is the address of the running robot; empty if there is none. */
  constructor(link, back) {
    this.link = link;
    this.state = { playing: false, ended: false, rate: 1, at: 0 };
    this.play = h("button.primary", {
      type: "button",
      title: "Play or stand still (space)",
      onclick: () => this.toggle(),
    });
    const step = h(
      "button",
      { type: "button", title: "The next message (.)", "aria-label": "Step", onclick: () => this.step() },
      icon(NEXT),
    );
    this.rate = h(
      "select",
      { "aria-label": "Rate", onchange: () => this.ask(this.state.playing) },
      ...RATES.map((rate) => h("option", { value: String(rate) }, `${rate}×`)),
    );
    this.loop = h(
      "button",
      {
        type: "button",
        "aria-pressed": "false",
        title: "Again and again",
        "aria-label": "Loop",
        onclick: () => this.setLoop(),
      },
      icon(AGAIN),
    );
    this.slider = h("input", {
      type: "range",
      min: 0,
      step: 0.001,
      "aria-label": "Time of the recording",
      oninput: () => this.seek(),
    });
    this.time = h("span.time.mono");
    this.name = h("b.mono");
    this.element = find("#timeline");
    this.element.append(
      this.play,
      step,
      this.loop,
      this.rate,
      this.slider,
      this.time,
      this.name,
      back ? h("a", { href: back }, "Back to the robot") : "",
    );
    link.addEventListener("open", () => this.open());
    link.addEventListener("playback", ({ detail }) => this.told(detail));
    link.addEventListener("time", ({ detail }) => this.show(detail));
    addEventListener("keydown", (event) => this.key(event));
  }

  open() {
    const { recording } = this.link;
    document.body.classList.toggle("recorded", Boolean(recording));
    this.element.hidden = !recording;
    if (!recording) return;
    this.start = recording.start;
    this.length = recording.end - recording.start;
    this.slider.max = this.length;
    this.name.textContent = recording.name;
  }

  told(state) {
    this.state = state;
    this.waiting = false;
    this.play.replaceChildren(icon(state.playing ? PAUSE : PLAY));
    this.play.setAttribute("aria-label", state.playing ? "Stand still" : "Play");
    const rate = String(state.rate < 1 ? brief(state.rate, 2) : state.rate);
    if (![...this.rate.options].some((option) => option.value === rate))
      this.rate.append(h("option", { value: rate }, `${rate}×`));
    this.rate.value = rate;
    if (this.wanted !== null && this.wanted !== undefined) this.seek();
    else this.show(state.at);
    if (state.ended && this.loop.getAttribute("aria-pressed") === "true") this.ask(true);
  }

  /** Show a time, in seconds since 1970, unless another one is being chosen. */
  show(at) {
    if (this.waiting) return;
    const offset = Math.min(Math.max(0, at - this.start), this.length);
    this.slider.value = offset;
    this.say(offset);
  }

  say(offset) {
    const text = `${offset.toFixed(1)} of ${this.length.toFixed(1)} s`;
    this.time.textContent = text;
    this.slider.setAttribute("aria-valuetext", text);
  }

  ask(play, seek = null) {
    this.link.control(play, Number(this.rate.value), seek);
  }

  toggle() {
    this.ask(!this.state.playing);
  }

  /** Go where the slider is. While the server has not answered, only the newest place is kept. */
  seek() {
    const offset = Number(this.slider.value);
    this.say(offset);
    this.wanted = this.waiting ? offset : null;
    if (this.waiting) return;
    this.waiting = true;
    this.ask(this.state.playing, offset);
  }

  async step() {
    if (this.state.playing) this.ask(false);
    try {
      await this.link.call(STEP);
    } catch (error) {
      this.time.textContent = error.message;
    }
  }

  setLoop() {
    const on = this.loop.getAttribute("aria-pressed") !== "true";
    this.loop.setAttribute("aria-pressed", String(on));
    if (on && this.state.ended) this.ask(true);
  }

  key(event) {
    if (
      this.element.hidden ||
      writing(event) ||
      event.ctrlKey ||
      event.metaKey ||
      event.altKey ||
      event.target.closest?.("button, a")
    )
      return;
    if (event.key === " ") this.toggle();
    else if (event.key === ".") this.step();
    else return;
    event.preventDefault();
  }
}
