// A robot from its URDF: shapes to draw, and where its links are for given joint positions.

import { ORIGIN, compose, fromRpy, times, turned } from "./frames.js";

const numbers = (text, otherwise) => (text ? text.trim().split(/\s+/).map(Number) : otherwise);

function origin(element) {
  const found = element.querySelector(":scope > origin");
  return {
    p: numbers(found?.getAttribute("xyz"), [0, 0, 0]),
    q: fromRpy(numbers(found?.getAttribute("rpy"), [0, 0, 0])),
  };
}

function shape(visual, colors) {
  const form = visual.querySelector("geometry > *");
  if (!form) return null;
  const get = (name) => numbers(form.getAttribute(name), [0]);
  const material = visual.querySelector("material");
  const rgba = material?.querySelector("color")?.getAttribute("rgba") ?? colors.get(material?.getAttribute("name"));
  return {
    kind: form.tagName,
    size: get("size"),
    radius: get("radius")[0],
    length: get("length")[0],
    file: form.getAttribute("filename"),
    scale: numbers(form.getAttribute("scale"), [1, 1, 1]),
    pose: origin(visual),
    color: numbers(rgba, [0.6, 0.6, 0.6, 1]),
  };
}

export class Robot {
  constructor(text) {
    const root = new DOMParser().parseFromString(text, "application/xml").querySelector("robot");
    if (!root) throw new Error("the robot's description is no URDF");
    const colors = new Map();
    for (const material of root.querySelectorAll(":scope > material"))
      colors.set(material.getAttribute("name"), material.querySelector("color")?.getAttribute("rgba"));
    this.links = new Map(); // name -> shapes
    for (const link of root.querySelectorAll(":scope > link"))
      this.links.set(
        link.getAttribute("name"),
        [...link.querySelectorAll(":scope > visual")].map((one) => shape(one, colors)).filter(Boolean),
      );
    const joints = [...root.querySelectorAll(":scope > joint")].map((joint) => ({
      name: joint.getAttribute("name"),
      kind: joint.getAttribute("type"),
      parent: joint.querySelector("parent").getAttribute("link"),
      child: joint.querySelector("child").getAttribute("link"),
      origin: origin(joint),
      axis: unit(numbers(joint.querySelector("axis")?.getAttribute("xyz"), [1, 0, 0])),
      mimic: mimicked(joint.querySelector("mimic")),
    }));
    this.named = new Map(joints.map((joint) => [joint.name, joint]));
    this.carrier = new Map(joints.map((joint) => [joint.child, joint]));
    this.root = [...this.links.keys()].find((name) => !this.carrier.has(name));
    this.joints = this.ordered(joints);
  }

  /** Parents before children. */
  ordered(joints) {
    const depth = (joint, most = joints.length) =>
      most && this.carrier.has(joint.parent) ? 1 + depth(this.carrier.get(joint.parent), most - 1) : 0;
    return joints
      .map((joint) => [depth(joint), joint])
      .sort((a, b) => a[0] - b[0])
      .map(([, joint]) => joint);
  }

  /** Link -> its pose in the root link, for joint positions by name (those not named are 0). */
  poses(positions) {
    const found = new Map([[this.root, ORIGIN]]);
    for (const joint of this.joints) {
      const place = compose(joint.origin, moved(joint, this.position(joint, positions)));
      found.set(joint.child, compose(found.get(joint.parent) ?? ORIGIN, place));
    }
    return found;
  }

  /** Where a joint is: as it is told, or as the joint that it mimics is, in rad or m. */
  position(joint, positions, most = this.joints.length) {
    const told = positions.get(joint.name);
    const other = joint.mimic && this.named.get(joint.mimic.joint);
    if (told !== undefined || !other || !most) return told ?? 0;
    return joint.mimic.multiplier * this.position(other, positions, most - 1) + joint.mimic.offset;
  }

  /** The links that end a leg. */
  get feet() {
    return [...this.links.keys()].filter((name) => name.endsWith("_foot"));
  }

  /**
   * The force of the ground on a foot that its three joints' torques stand for, in the root link's axes, N: J' f =
   * -torque, link weights left out.
   */
  footForce(foot, poses, efforts) {
    const at = poses.get(foot).p;
    const rows = [];
    const torques = [];
    for (let joint = this.carrier.get(foot); joint && rows.length < 3; joint = this.carrier.get(joint.parent)) {
      if (joint.kind === "fixed") continue;
      const { p, q } = poses.get(joint.child);
      const axis = turned(q, joint.axis);
      rows.push(joint.kind === "prismatic" ? axis : cross(axis, [at[0] - p[0], at[1] - p[1], at[2] - p[2]]));
      torques.push(-(efforts.get(joint.name) ?? 0));
    }
    return rows.length === 3 ? solve(rows, torques) : null;
  }
}

function unit(axis) {
  const length = Math.hypot(...axis);
  return length > 0 ? axis.map((one) => one / length) : axis;
}

function mimicked(element) {
  const number = (name, otherwise) => Number(element.getAttribute(name) ?? otherwise);
  return (
    element && {
      joint: element.getAttribute("joint"),
      multiplier: number("multiplier", 1),
      offset: number("offset", 0),
    }
  );
}

/** What a joint at this position does to its child. */
function moved({ kind, axis }, position) {
  if (kind === "prismatic") return { p: axis.map((one) => one * position), q: ORIGIN.q };
  if (kind !== "revolute" && kind !== "continuous") return ORIGIN;
  const sine = Math.sin(position / 2);
  return { p: ORIGIN.p, q: [...axis.map((one) => one * sine), Math.cos(position / 2)] };
}

/**
 * The cross product.
 * @param {number[]} u
 * @param {number[]} v
 */
function cross([a, b, c], [x, y, z]) {
  return [b * z - c * y, c * x - a * z, a * y - b * x];
}

/** Three equations by Cramer's rule; null when they are next to dependent, as at a stretched leg. */
/**
 * The vector that three rows take to three values.
 * @param {number[][]} rows
 * @param {number[]} values
 */
function solve([a, b, c], [x, y, z]) {
  const bc = cross(b, c),
    ca = cross(c, a),
    ab = cross(a, b);
  const det = a[0] * bc[0] + a[1] * bc[1] + a[2] * bc[2];
  if (Math.abs(det) < 1e-4) return null;
  return [0, 1, 2].map((i) => (x * bc[i] + y * ca[i] + z * ab[i]) / det);
}
