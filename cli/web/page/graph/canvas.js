// The drawn graph: SVG that can be dragged, zoomed by the wheel, and clicked.

import { h, svg } from "../core/dom.js";

const ZOOM = 0.0012; // for each unit of the wheel
// units of the drawing for a px, at most, at first: text must be read, and what is outside can be dragged in
const LEAST = 1.7;
const STILL = 4; // px that a click may move

export class Canvas {
  constructor(select) {
    this.select = select;
    this.svg = svg("svg", { role: "group", "aria-label": "Nodes and topics" });
    this.element = h("div.canvas", {}, this.svg);
    this.box = [0, 0, 1, 1];
    this.svg.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    this.svg.addEventListener("pointerdown", (event) => (this.grip = { x: event.clientX, y: event.clientY, moved: 0 }));
    addEventListener("pointermove", (event) => this.drag(event));
    addEventListener("pointerup", () => setTimeout(() => (this.grip = undefined)));
    new ResizeObserver(() => this.fit()).observe(this.element);
  }

  show(drawing) {
    this.drawing = drawing;
    const marker = svg(
      "marker",
      { id: "tip", viewBox: "0 0 8 8", refX: 7, refY: 4, markerWidth: 7, markerHeight: 7, orient: "auto" },
      svg("path", { d: "M0 0L8 4L0 8z" }),
    );
    const edges = drawing.edges.map((edge) =>
      svg("path", {
        d: curve(edge.points),
        class: edge.bad ? "edge badly" : "edge",
        "data-from": edge.from,
        "data-to": edge.to,
        "marker-end": "url(#tip)",
      }),
    );
    this.items = new Map(drawing.nodes.map((node) => [node.id, this.item(node)]));
    this.svg.replaceChildren(svg("defs", {}, marker), ...edges, ...this.items.values());
    this.fit();
  }

  item(node) {
    const { x, y, width, height, kind, name } = node;
    const rate = svg("text", { class: "rate", x: 0, y: height / 2 + 11, "text-anchor": "middle" });
    const group = svg(
      "g",
      {
        class: `item ${kind}${node.bad ? " badly" : ""}`,
        transform: `translate(${x} ${y})`,
        tabindex: 0,
        role: "button",
        "aria-label": `${kind} ${name}`,
      },
      svg("rect", { x: -width / 2, y: -height / 2, width, height, rx: kind === "topic" ? height / 2 : 7 }),
      svg("text", { "text-anchor": "middle", "dominant-baseline": "central" }),
      rate,
    );
    group.children[1].textContent = name;
    const choose = () => this.select({ kind, name });
    group.addEventListener("click", () => (this.grip?.moved ?? 0) < STILL && choose());
    group.addEventListener(
      "keydown",
      (event) => (event.key === "Enter" || event.key === " ") && (event.preventDefault(), choose()),
    );
    return group;
  }

  /** Set the text under each of these, and in the name by which it is read out. */
  label(texts) {
    for (const [id, text] of texts) {
      const item = this.items?.get(id);
      const rate = item?.querySelector(".rate");
      if (!rate || rate.textContent === text) continue;
      rate.textContent = text;
      item.setAttribute("aria-label", `${id} ${text.trim()}`);
    }
  }

  /** Show which one is chosen, and its edges. */
  mark(id) {
    for (const [one, group] of this.items ?? []) group.classList.toggle("chosen", one === id);
    for (const edge of this.svg.querySelectorAll(".edge"))
      edge.classList.toggle("near", edge.dataset.from === id || edge.dataset.to === id);
  }

  /** Width over height. */
  get shape() {
    return this.element.clientWidth / Math.max(1, this.element.clientHeight) || 1.3;
  }

  /** Show all of it, or, unless it is to be `whole`, as much as can be read. */
  fit(whole = false) {
    const { width, height } = this.drawing ?? { width: 1, height: 1 };
    const { clientWidth, clientHeight } = this.element;
    if (!clientWidth || !clientHeight) return;
    const scale = Math.min(whole ? Infinity : LEAST, Math.max(width / clientWidth, height / clientHeight, 0.7) * 1.04);
    this.box = [
      width / 2 - (clientWidth * scale) / 2,
      height / 2 - (clientHeight * scale) / 2,
      clientWidth * scale,
      clientHeight * scale,
    ];
    this.apply();
  }

  apply() {
    this.svg.setAttribute("viewBox", this.box.join(" "));
  }

  wheel(event) {
    event.preventDefault();
    const factor = Math.exp(event.deltaY * ZOOM);
    const frame = this.svg.getBoundingClientRect();
    const [sx, sy] = [(event.clientX - frame.left) / frame.width, (event.clientY - frame.top) / frame.height];
    const [x, y, w, height] = this.box;
    this.box = [x + sx * w * (1 - factor), y + sy * height * (1 - factor), w * factor, height * factor];
    this.apply();
  }

  drag(event) {
    if (!this.grip || !event.buttons) return;
    const scale = this.box[2] / this.svg.clientWidth;
    this.grip.moved += Math.abs(event.clientX - this.grip.x) + Math.abs(event.clientY - this.grip.y);
    this.box[0] -= (event.clientX - this.grip.x) * scale;
    this.box[1] -= (event.clientY - this.grip.y) * scale;
    Object.assign(this.grip, { x: event.clientX, y: event.clientY });
    this.apply();
  }
}

/** A smooth line through points. */
function curve(points) {
  let path = `M${points[0].x} ${points[0].y}`;
  for (let i = 1; i < points.length - 1; i++) {
    const [here, next] = [points[i], points[i + 1]];
    path += ` Q${here.x} ${here.y} ${(here.x + next.x) / 2} ${(here.y + next.y) / 2}`;
  }
  const last = points[points.length - 1];
  return `${path} L${last.x} ${last.y}`;
}
