// The robot: where it is, what it sees, how it is, and what it is told.

import { h, note, recall, remember } from "../core/dom.js";
import { Camera } from "../robot/camera.js";
import { Drive } from "../robot/drive.js";
import { GoTo } from "../robot/goto.js";
import { View2D } from "../robot/view2d.js";
import { World, hasRobot } from "../robot/world.js";

export async function make(app) {
  const pane = new RobotPane(app);
  await pane.open();
  return pane;
}

/** Whether to draw in three dimensions: what was chosen, or else whether there is WebGL that a graphics card draws. */
function solid() {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) return { possible: false, wanted: false };
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const name = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return { possible: true, wanted: recall("solid", !/swiftshader|llvmpipe|software/i.test(name)) };
}

class RobotPane {
  constructor({ link, bridge, palette }) {
    this.link = link;
    this.bridge = bridge;
    this.palette = palette;
    this.world = new World(link);
    this.answer = note();
    this.drive = new Drive(link, () => this.whyNotWalking());
    this.camera = new Camera(link);
    this.host = h("div.view3d");
    this.chips = h("div.chips", { "aria-label": "State of the robot" });
    this.chip = {};
    for (const name of ["mode", "battery", "speed", "place", "power", "driver", "real time"]) {
      this.chip[name] = h("b", {}, "–");
      this.chips.append(h("span.chip", {}, h("span", {}, name), this.chip[name]));
    }
    this.feet = h(
      "div.feet",
      { role: "img", "aria-label": "Feet on the ground" },
      ...["fl", "fr", "rl", "rr"].map((leg) => h("i", { title: leg })),
    );
    this.tools = h("div.tools");
    this.element = h(
      "section.robot",
      { "aria-label": "Robot" },
      h(
        "div.stage",
        {},
        this.host,
        this.chips,
        this.tools,
        this.camera.element,
        (this.none = h("p.absent.card", { role: "status", hidden: true })),
      ),
      h(
        "div.side.stack",
        {},
        this.commands(),
        h("div.card.stack", {}, h("h2", {}, "Drive"), this.drive.pad, this.drive.hint, this.keys()),
        (this.goalCard = h("div.card.stack")),
      ),
    );
  }

  async open() {
    const { possible, wanted } = solid();
    this.go = new GoTo(this.bridge, this.world);
    this.goalCard.append(h("h2", {}, "Go to"), this.go.element);
    const follow = toggle("Follow", recall("follow", true), (on) => {
      this.view.follow = on;
      remember("follow", on);
    });
    const depth = toggle("3D", wanted, (on) => {
      remember("solid", on);
      this.see(on);
    });
    this.world.withRelief = recall("relief", true);
    const relief = toggle("Elevation", this.world.withRelief, (on) => {
      remember("relief", on);
      this.world.showRelief(on);
    });
    const offer = () => {
      relief.hidden = !this.world.hasRelief;
      this.none.hidden = !this.link.connected || hasRobot(this.link);
    };
    this.none.append(
      "No robot is seen here: nobody publishes /robot_description, /tf, /odom or the like. ",
      h("a", { href: "#graph" }, "What there is"),
    );
    for (const event of ["open", "channels"]) this.link.addEventListener(event, offer);
    for (const event of ["open", "services"]) this.link.addEventListener(event, () => this.offerCommands());
    offer();
    this.offerCommands();
    this.tools.append(
      follow,
      relief,
      ...(possible ? [depth] : []),
      toggle("Camera", false, (on) => this.camera.show(on)),
      this.go.button,
    );
    await this.see(wanted);
    addEventListener("theme", () => this.view.recolor(this.palette()));
    this.link.addEventListener("channels", () => this.shown && this.world.start());
  }

  async see(solid) {
    const View = solid ? (await import("../robot/view3d.js")).View3D : View2D;
    this.view?.dispose();
    this.view = new View(this.host, this.world, this.palette());
    this.view.follow = recall("follow", true);
    this.go.use(this.view);
    window.robactorView = this.view.name;
  }

  show() {
    this.shown = this.drive.active = true;
    this.world.start();
    this.camera.resume();
  }

  hide() {
    this.shown = this.drive.active = false;
    this.drive.let();
    this.world.stop();
    this.camera.pause();
  }

  frame() {
    this.world.update();
    this.view.draw(this.go.aim);
    this.tell();
  }

  tell() {
    const { gait, battery, odom, drive, contacts, power, localization } = this.world.latest;
    const say = (name, known, tell) => {
      const text = known ? tell(known) : "–";
      if (this.chip[name].textContent !== text) this.chip[name].textContent = text;
    };
    say("mode", gait, ({ mode, gait: way }) => (way && mode === "walk" ? `walk (${way})` : mode));
    say("battery", battery, ({ percentage }) => `${(100 * percentage).toFixed(0)} %`);
    say("speed", odom, ({ twist: { twist } }) => `${Math.hypot(twist.linear.x, twist.linear.y).toFixed(2)} m/s`);
    say("power", power, ({ mean }) => `${mean.toFixed(0)} W`);
    const slow = power && power.real_time_factor < 0.8;
    say("real time", slow && power, ({ real_time_factor: factor }) => `x ${factor.toFixed(2)}`);
    this.chip["real time"].parentElement.hidden = !slow;
    this.chip["real time"].classList.toggle("bad", Boolean(slow));
    say("driver", drive, ({ enabled, source }) => (enabled ? source || "nobody" : "disabled"));
    const unsure = localization && localization.data !== "tracking" ? `${localization.data}: ` : "";
    say("place", this.world.pose, ({ p }) => `${unsure}${metres(p[0])}, ${metres(p[1])} m`);
    this.chip.place.classList.toggle("bad", Boolean(unsure));
    if (contacts)
      [...this.feet.children].forEach((foot, i) =>
        foot.classList.toggle("down", contacts.contact[i] !== 0 && contacts.contact[i] !== false),
      );
    if (drive && drive.enabled !== this.enabled) {
      this.enabled = drive.enabled;
      this.enable.setAttribute("aria-pressed", String(drive.enabled));
      this.enable.textContent = drive.enabled ? "Enabled" : "Enable";
    }
    for (const [mode, button] of Object.entries(this.modes)) {
      const pressed = String(gait?.goal === mode);
      if (button.getAttribute("aria-pressed") !== pressed) button.setAttribute("aria-pressed", pressed);
    }
    this.forgetAnswer(gait, drive);
  }

  /** An answer stands for as long as what it says is so. */
  forgetAnswer(gait, drive) {
    if (!this.answered) return;
    const holds = this.answered.mode ? gait?.goal === this.answered.mode : drive?.enabled === this.answered.enabled;
    if (this.answered.held && !holds) {
      this.answer.say("");
      this.answered = null;
    } else if (holds) this.answered.held = true;
  }

  /** Commands that nobody carries out are shown as such. */
  offerCommands() {
    for (const button of [this.enable, ...Object.values(this.modes)]) {
      button.disabled = this.link.connected && !this.link.services.has(button.dataset.service);
      button.title = button.disabled ? `nobody serves ${button.dataset.service}` : "";
    }
  }

  commands() {
    const call = (service, args) => async () => {
      const asked = args();
      this.answered = null;
      try {
        const answer = await this.link.call(service, asked);
        this.answer.say(answer.message, !answer.success);
        this.answered =
          answer.success && "data" in asked
            ? { enabled: asked.data }
            : answer.success && { mode: service.split("/").pop() };
      } catch (error) {
        this.answer.say(error.message, true);
      }
    };
    const button = (title, service, args = () => ({})) => {
      const made = h("button", { type: "button", onclick: call(service, args) }, title);
      made.dataset.service = service;
      return made;
    };
    this.enable = button("Enable", "/robot/enable", () => ({ data: !this.enabled }));
    this.modes = {
      stand: button("Stand", "/spot/stand"),
      walk: button("Walk", "/spot/walk"),
      sit: button("Sit", "/spot/sit"),
    };
    return h(
      "div.card.stack",
      {},
      h("div.row", {}, h("h2.grow", {}, "Robot"), this.feet),
      h("div.modes", {}, this.enable, ...Object.values(this.modes)),
      this.answer.element,
    );
  }

  keys() {
    const rows = [
      ["W S", "forward, back"],
      ["A D", "turn"],
      ["Q E", "sideways"],
      ["Shift", "faster"],
      ["Esc", "stop"],
      ["G", "go to"],
      ["1 – 8", "panes"],
      ["T", "light, dark"],
    ];
    return h(
      "details.keys",
      {},
      h("summary", {}, "Keys"),
      h("dl", {}, ...rows.flatMap(([key, what]) => [h("dt.mono", {}, key), h("dd", {}, what)])),
    );
  }

  /** What to do before driving has an effect. */
  whyNotWalking() {
    const { gait, drive, safety } = this.world.latest;
    if (safety?.stopped) return "The robot is stopped: clear the stop first.";
    if (drive && !drive.enabled) return "Commands are not let through: press Enable.";
    if (gait && gait.goal !== "walk") return "The robot does not walk: press Walk.";
    return "";
  }
}

/** To the centimetre, without a minus before nothing. */
function metres(value) {
  return (Math.round(100 * value) / 100 + 0).toFixed(2);
}

function toggle(title, on, changed) {
  const button = h("button", { type: "button", "aria-pressed": String(on) }, title);
  button.onclick = () => {
    const now = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", String(now));
    changed(now);
  };
  return button;
}
