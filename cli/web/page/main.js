// The frame around the panes: connection, tabs, theme, the stop button, and one loop that draws what is shown.

import { find, h, recall, remember, writing } from "./core/dom.js";
import { Foxglove } from "./core/foxglove.js";
import { Rosbridge } from "./core/rosbridge.js";
import { startReport } from "./core/report.js";
import { watchSafety } from "./core/safety.js";
import { Timeline } from "./core/timeline.js";

const PANES = {
  robot: "Robot",
  graph: "Graph",
  plot: "Plot",
  console: "Console",
  parameters: "Parameters",
  goals: "Goals",
  doctor: "Doctor",
  bags: "Bags",
};
const REPLACES = { graph: "rqt_graph", plot: "rqt_plot", console: "rqt_console", parameters: "rqt_reconfigure" };
const host = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/`;
const here = `${host}${location.search}`; // with ?bag=NAME the panes show that recording
const main = find("#main");
const status = find("#status");

const link = new Foxglove(here);
const bridge = new Rosbridge(here);
// a recording beside the robot does not take the stop button away
const robot = asked("bag") ? new Foxglove(`${host}${without("bag")}`) : link;
const panes = new Map(); // name -> promise of {element, show, hide, frame}
const app = { link, robot, bridge, palette, go, without };
let shown = null;
let wanted = "";

function asked(name) {
  return new URLSearchParams(location.search).get(name);
}

/** The query of this page without one of its words. */
function without(name) {
  const query = new URLSearchParams(location.search);
  query.delete(name);
  return query.size ? `?${query}` : "";
}

/** Colours for what is drawn on a canvas. */
function palette() {
  const style = getComputedStyle(document.documentElement);
  const names = [
    "ground",
    "panel",
    "text",
    "muted",
    "line",
    "accent",
    "sky",
    "grid",
    "floor",
    "wall",
    "scan",
    "path",
    "trail",
    "force",
    "good",
    "warn",
    "bad",
  ];
  return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

/**
 * Open a pane: "plot", or "plot?series=/odom.pose.pose.position.x". What is shown is in the address, so it can be sent
 * to somebody.
 */
function go(address, replace = false) {
  if (replace) {
    history.replaceState(null, "", `#${address}`);
    remember("address", address);
  } else location.hash = address;
}

async function route() {
  const address = location.hash.slice(1) || recall("address", "robot");
  const [asked, query = ""] = address.split("?");
  const name = asked in PANES ? asked : "robot";
  wanted = name;
  remember("address", address);
  for (const tab of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("#tabs a"))) {
    if (tab.dataset.pane === name) {
      tab.setAttribute("aria-current", "page");
      tab.scrollIntoView({ block: "nearest", inline: "nearest" });
    } else tab.removeAttribute("aria-current");
  }
  document.title = `${PANES[name]} · robactor`;
  if (!panes.has(name))
    panes.set(
      name,
      import(`./panes/${name}.js`).then((module) => module.make(app)),
    );
  const pane = await panes.get(name);
  if (wanted !== name) return;
  if (shown !== pane) {
    shown?.hide?.();
    main.replaceChildren(pane.element);
    shown = pane;
  }
  pane.show?.(new URLSearchParams(query));
}

/** Where nothing was chosen and there is no robot to be seen, the graph is what there is. */
async function choose() {
  const { hasRobot } = await import("./robot/world.js");
  if (!location.hash && !recall("chosen", false) && !hasRobot(link)) go("graph");
}

function theme(choice) {
  const dark = choice ? choice === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  dispatchEvent(new Event("theme"));
}

function toggleTheme() {
  const next = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
  remember("theme", next);
  theme(next);
}

function showStatus() {
  status.className = `status ${link.connected ? "on" : "off"}`;
  status.textContent = link.connected ? "connected" : "not connected";
}

/** The number of problems beside the doctor's tab: they arise whatever is being looked at. */
function warn(problems) {
  const tab = document.querySelector('#tabs a[data-pane="doctor"]');
  tab.querySelector(".count")?.remove();
  if (problems) tab.append(h("span.count", { title: `${problems} problem${problems > 1 ? "s" : ""}` }, problems));
}

for (const [name, title] of Object.entries(PANES)) {
  const tab = h("a", { href: `#${name}`, title: REPLACES[name] && `Instead of ${REPLACES[name]}` }, title);
  tab.dataset.pane = name;
  find("#tabs").append(tab);
}
theme(recall("theme", ""));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => theme(recall("theme", "")));
find("#theme").onclick = toggleTheme;
addEventListener("hashchange", () => {
  remember("chosen", true);
  route();
});
link.addEventListener("channels", choose, { once: true });
addEventListener("keydown", (event) => {
  if (writing(event) || event.ctrlKey || event.metaKey || event.altKey) return;
  const number = Number(event.key) - 1;
  if (number in Object.keys(PANES)) go(Object.keys(PANES)[number]);
  else if (event.key === "t") toggleTheme();
});
link.addEventListener("open", showStatus);
link.addEventListener("close", showStatus);
link.addEventListener("findings", (/** @type {CustomEvent} */ { detail }) =>
  warn(detail.filter(({ level }) => level === "problem").length),
);
link.watchSystem();
watchSafety(robot);
new Timeline(link, asked("bag") ? `${location.pathname}${without("bag")}#robot` : "");
startReport(link, () => shown?.frame?.());
route();
