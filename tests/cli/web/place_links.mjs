// Reads one JSON of {robot: element, positions: {joint: number}} and writes where the page places each link. An element is {name, attributes, children}.
import { readFileSync } from "node:fs";

class Element {
  constructor({ name, attributes, children }) {
    Object.assign(this, { tagName: name, attributes, children: children.map((child) => new Element(child)) });
  }

  getAttribute(name) {
    return this.attributes[name] ?? null;
  }

  *below() {
    for (const child of this.children) {
      yield child;
      yield* child.below();
    }
  }

  /** The selectors that the page's reader uses: "name", ":scope > name" and "name > *". */
  querySelectorAll(selector) {
    const [left, right] = selector.split(" > ");
    if (right === "*") return [...this.below()].filter(({ tagName }) => tagName === left).flatMap(({ children }) => children);
    const among = left === ":scope" ? this.children : [...this.below()];
    return among.filter(({ tagName }) => tagName === (right ?? left));
  }

  querySelector(selector) {
    return this.querySelectorAll(selector)[0] ?? null;
  }
}

const { robot, positions } = JSON.parse(readFileSync(0, "utf8"));
globalThis.DOMParser = class {
  parseFromString() {
    return new Element({ name: "document", attributes: {}, children: [robot] });
  }
};
const { Robot } = await import("../../../cli/web/page/robot/urdf.js");
process.stdout.write(JSON.stringify([...new Robot("").poses(new Map(Object.entries(positions)))]));
