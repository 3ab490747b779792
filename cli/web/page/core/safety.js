// The stop button and what tells that the robot is stopped. They are there wherever the robot's emergency stop is.

import { find, h, writing } from "./dom.js";

const SERVICE = "/emergency_stop";
const STATE = "/safety/state";
const AGAIN = 1000; // ms after which a stop that failed for want of a connection is tried again, until it is heard

export function watchSafety(link) {
  const button = find("#stop");
  const banner = find("#stopped");
  let said = "";

  const show = (stopped, reasons) => {
    const text = stopped ? `Stopped: ${reasons.join("; ") || "no reason given"}` : "";
    if (text === said) return;
    said = text;
    banner.hidden = !stopped;
    const clear = h("button", { type: "button", onclick: () => ask(false) }, "Clear the stop");
    banner.replaceChildren(h("span.grow", {}, text), stopped ? clear : "");
  };

  const complain = (text) => {
    said = text;
    banner.hidden = false;
    banner.replaceChildren(h("span", {}, text));
  };

  const ask = async (stop) => {
    try {
      const answer = await link.call(SERVICE, { data: stop });
      if (!answer.success) complain(answer.message);
    } catch (error) {
      complain(`The robot was not ${stop ? "stopped" : "released"}: ${error.message}`);
      if (stop) setTimeout(() => ask(true), AGAIN);
    }
  };

  button.onclick = () => ask(true);
  addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || writing(event) || button.hidden) return;
    event.preventDefault();
    ask(true);
  });
  link.subscribe(STATE, (state) => link.recording || show(state.stopped, state.reasons));
  link.addEventListener("services", () => {
    // it stays when the connection is lost: it tells then that nothing was stopped
    if (link.services.has(SERVICE)) button.hidden = false;
  });
}
