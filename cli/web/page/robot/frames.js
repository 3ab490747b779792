// Poses {p: [x, y, z], q: [x, y, z, w]}, and the tree of frames of /tf and /tf_static: of each the newest, and those of
// the last seconds.

export const ORIGIN = { p: [0, 0, 0], q: [0, 0, 0, 1] };

/**
 * A vector turned by a quaternion.
 * @param {number[]} q x, y, z, w
 * @param {number[]} v
 */
export function turned([x, y, z, w], [a, b, c]) {
  const tx = 2 * (y * c - z * b),
    ty = 2 * (z * a - x * c),
    tz = 2 * (x * b - y * a);
  return [a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx];
}

/**
 * The product of two quaternions.
 * @param {number[]} q x, y, z, w
 * @param {number[]} p
 */
export function times([ax, ay, az, aw], [bx, by, bz, bw]) {
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

/** First the inner pose, then the outer one. */
export function compose(outer, inner) {
  const [x, y, z] = turned(outer.q, inner.p);
  return { p: [outer.p[0] + x, outer.p[1] + y, outer.p[2] + z], q: times(outer.q, inner.q) };
}

export function inverse({ p, q }) {
  const back = [-q[0], -q[1], -q[2], q[3]];
  const [x, y, z] = turned(back, p);
  return { p: [-x, -y, -z], q: back };
}

/**
 * The heading of a quaternion, rad.
 * @param {number[]} q x, y, z, w
 */
export function yawOf([x, y, z, w]) {
  return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}

/** The rotation of roll, pitch and yaw about fixed axes, as URDF means them. */
export function fromRpy([roll, pitch, yaw]) {
  const about = (axis, angle) => axis.map((one) => one * Math.sin(angle / 2)).concat(Math.cos(angle / 2));
  return times(about([0, 0, 1], yaw), times(about([0, 1, 0], pitch), about([1, 0, 0], roll)));
}

const KEPT = 100; // so many poses of a frame are remembered: 2 s at 50 Hz

export function seconds({ sec, nanosec }) {
  return sec + nanosec * 1e-9;
}

export class FrameTree {
  constructor() {
    this.parents = new Map(); // child -> {parent, pose, stamp}, the newest
    this.before = new Map(); // child -> the same of the last seconds, oldest first
  }

  insert(message) {
    for (const { header, child_frame_id: child, transform } of message.transforms) {
      const { translation: t, rotation: r } = transform;
      const pose = { p: [t.x, t.y, t.z], q: [r.x, r.y, r.z, r.w] };
      const edge = { parent: header.frame_id, pose, stamp: seconds(header.stamp) };
      this.parents.set(child, edge);
      const edges = this.before.get(child) ?? [];
      edges.push(edge);
      if (edges.length > KEPT) edges.shift();
      this.before.set(child, edges);
    }
  }

  /** The edge above a frame: the newest, or with a stamp (s) the one nearest to it. */
  above(child, stamp) {
    if (stamp === undefined) return this.parents.get(child);
    const apart = (edge) => Math.abs(edge.stamp - stamp);
    return this.before.get(child).reduce((best, edge) => (apart(edge) <= apart(best) ? edge : best));
  }

  /** The frame at the top of the chain that `frame` hangs from. */
  root(frame) {
    let here = frame;
    for (let steps = 0; steps < 100 && this.parents.has(here); steps++) here = this.parents.get(here).parent;
    return here;
  }

  /** The pose of `frame` in the root of its tree. */
  inRoot(frame, stamp) {
    let pose = ORIGIN;
    let here = frame;
    for (let steps = 0; steps < 100 && this.parents.has(here); steps++) {
      const up = this.above(here, stamp);
      pose = compose(up.pose, pose);
      here = up.parent;
    }
    return pose;
  }

  /** The pose of `frame` in `target`, now or at a stamp (s); null when nothing connects them. */
  lookup(target, frame, stamp) {
    if (target === frame) return ORIGIN;
    if (this.root(target) !== this.root(frame)) return null;
    return compose(inverse(this.inRoot(target, stamp)), this.inRoot(frame, stamp));
  }
}
