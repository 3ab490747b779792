// What the robot pane shows, as it is known from the robot's topics. Both views, with WebGL and without, draw from
// here.

import { FrameTree, seconds, yawOf } from "./frames.js";
import { Robot } from "./urdf.js";

/** What is shown: the topic by the name that the robot gives it, or else the first one of the type. */
const SOURCES = {
  description: ["/robot_description", "std_msgs/msg/String", false],
  joints: ["/joint_states", "sensor_msgs/msg/JointState", true],
  scan: ["/lidar/scan", "sensor_msgs/msg/LaserScan", true],
  map: ["/map", "nav_msgs/msg/OccupancyGrid", true],
  path: ["/plan", "nav_msgs/msg/Path", true],
  relief: ["/elevation", "nav_msgs/msg/OccupancyGrid", false],
  localization: ["/localization", "std_msgs/msg/String", false],
  odom: ["/odom", "nav_msgs/msg/Odometry", true],
  battery: ["/battery_state", "sensor_msgs/msg/BatteryState", true],
  gait: ["/gait_status", "robactor_msgs/msg/GaitStatus", false],
  drive: ["/drive_status", "robactor_msgs/msg/DriveStatus", false],
  safety: ["/safety/state", "robactor_msgs/msg/SafetyState", false],
  contacts: ["/foot_contacts", "robactor_msgs/msg/FootContacts", false],
  power: ["/motor_power", "robactor_msgs/msg/MotorPower", false],
};
const NAMED = new Set(Object.values(SOURCES).map(([topic]) => topic)); // an elevation grid is no map
const ARM = "/arm/joint_states";
const TRAIL = 600; // places that the trail remembers
const STEP = 0.05; // m between them

/** Whether anything tells of a robot. */
export function hasRobot({ channels }) {
  return [...channels.values()].some(
    ({ topic, schemaName }) =>
      topic === "/tf" ||
      Object.values(SOURCES).some(([name, type, any]) => schemaName === type && (any || topic === name)),
  );
}

export class World {
  constructor(link) {
    this.link = link;
    this.frames = new FrameTree();
    this.latest = {}; // name -> the newest message
    this.robot = null;
    this.positions = new Map();
    this.efforts = new Map();
    this.trail = [];
    this.mapVersion = 0;
    this.withRelief = true;
    this.feeds = {};
    this.stops = [];
    link.addEventListener("seek", () => this.forget());
  }

  /**
   * A recording is shown at another time: what was known is of no use, but the robot's shape and the map, which may
   * come again as they were.
   */
  forget() {
    this.mapBefore = this.latest.map ?? this.mapBefore;
    this.latest = {};
    this.frames = new FrameTree();
    this.positions.clear();
    this.efforts.clear();
    this.trail = [];
  }

  get base() {
    return this.robot?.root ?? "base_link";
  }

  /** Listen to everything that is there by now; call again when topics appear. */
  start() {
    for (const [name, [topic, type, any]] of Object.entries(SOURCES))
      if (name !== "relief" || this.withRelief) this.follow(name, this.topicOf(topic, type, any));
    this.follow("arm", this.link.channels.has(ARM) ? ARM : undefined);
    if (this.stops.length) return;
    for (const topic of ["/tf", "/tf_static"])
      this.stops.push(this.link.subscribe(topic, (message) => this.frames.insert(message)));
  }

  follow(name, topic) {
    const feed = this.feeds[name];
    if (!topic || feed?.topic === topic) return;
    feed?.stop();
    this.feeds[name] = { topic, ...this.link.latest(topic) };
  }

  /** Whether there is an elevation grid to be shown. */
  get hasRelief() {
    return this.topicOf(...SOURCES.relief) !== undefined;
  }

  /** Show the elevation grid, or do without it and its messages. */
  showRelief(on) {
    this.withRelief = on;
    if (on) return this.start();
    this.feeds.relief?.stop();
    delete this.feeds.relief;
    delete this.latest.relief;
  }

  topicOf(topic, type, any) {
    if (this.link.channels.get(topic)?.schemaName === type) return topic;
    return any
      ? [...this.link.channels.values()].find((channel) => channel.schemaName === type && !NAMED.has(channel.topic))
          ?.topic
      : undefined;
  }

  stop() {
    for (const feed of Object.values(this.feeds)) feed.stop();
    for (const stop of this.stops) stop();
    this.feeds = {};
    this.stops = [];
  }

  /** Take what has come since the last picture. */
  update() {
    for (const [name, feed] of Object.entries(this.feeds)) {
      const message = feed.take();
      if (message === null) continue;
      this.latest[name] = message;
      if (name === "description") this.describe(message.data);
      else if (name === "map") this.survey(message);
      else if (name === "joints" || name === "arm") this.move(message);
    }
    const pose = this.pose;
    const last = this.trail[this.trail.length - 1];
    if (pose && (!last || Math.hypot(pose.p[0] - last[0], pose.p[1] - last[1]) > STEP)) {
      this.trail.push([pose.p[0], pose.p[1]]);
      if (this.trail.length > TRAIL) this.trail.shift();
    }
  }

  describe(text) {
    if (text === this.described) return;
    this.described = text;
    this.robot = new Robot(text);
  }

  survey(map) {
    const before = this.mapBefore;
    this.mapBefore = undefined;
    if (before && seconds(before.header.stamp) === seconds(map.header.stamp) && before.data.length === map.data.length)
      this.latest.map = before;
    else this.mapVersion++;
  }

  move(state) {
    state.name.forEach((name, i) => {
      this.positions.set(name, state.position[i]);
      this.efforts.set(name, state.effort[i] ?? 0);
    });
  }

  get fixed() {
    return this.frames.parents.size ? this.frames.root(this.base) : (this.latest.map?.header.frame_id ?? "map");
  }

  /** Where the body is in the fixed frame; null before it is known. */
  get pose() {
    return this.frames.parents.has(this.base) ? this.frames.inRoot(this.base) : null;
  }

  get heading() {
    return this.pose ? yawOf(this.pose.q) : 0;
  }

  /** Where a message was measured, in the fixed frame; the place of that frame itself where nothing is known. */
  placeOf({ frame_id: frame, stamp }) {
    return this.frames.lookup(this.fixed, frame, seconds(stamp)) ?? { p: [0, 0, 0], q: [0, 0, 0, 1] };
  }

  /** The returns of the newest scan, in its own frame: a flat array of x, y pairs. */
  hits() {
    const scan = this.latest.scan;
    if (!scan) return [];
    const found = [];
    scan.ranges.forEach((range, i) => {
      if (!(range >= scan.range_min && range < scan.range_max)) return;
      const angle = scan.angle_min + i * scan.angle_increment;
      found.push(range * Math.cos(angle), range * Math.sin(angle));
    });
    return found;
  }

  /** Points of the path that is followed, as [x, y]. */
  get path() {
    return (this.latest.path?.poses ?? []).map(({ pose }) => [
      pose.position.x,
      pose.position.y,
      yawOf(quad(pose.orientation)),
    ]);
  }
}

function quad({ x, y, z, w }) {
  return [x, y, z, w];
}
