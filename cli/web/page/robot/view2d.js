// The robot in its world from above, on a plain canvas: where there is no WebGL.

import { compose, turned } from "./frames.js";
import { goalOf } from "./goal.js";
import { blocks, floorPicture, reliefPicture } from "./grid.js";

const NEAR = 3; // m from the robot to the nearer edge of the picture at the start

export class View2D {
  constructor(host, world, palette) {
    this.world = world;
    this.palette = palette;
    this.element = host.appendChild(document.createElement("canvas"));
    this.pen = this.element.getContext("2d");
    this.follow = true;
    this.steering = false; // whether a drag means a goal
    /** What is drawn already, and in which palette. */
    this.drawnMap = this.drawnIn = this.drawnRelief = this.reliefIn = null;
    this.reach = NEAR;
    this.centre = [0, 0];
    this.element.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.reach = Math.min(40, Math.max(0.7, this.reach * Math.exp(event.deltaY * 0.001)));
    });
    this.element.addEventListener("pointermove", (event) => this.drag(event));
    this.observer = new ResizeObserver(() => this.resize(host));
    this.observer.observe(host);
    this.resize(host);
  }

  get name() {
    return "canvas";
  }

  recolor(palette) {
    this.palette = palette;
  }

  resize(host) {
    this.element.width = host.clientWidth;
    this.element.height = host.clientHeight;
  }

  drag(event) {
    if (!event.buttons || this.steering) return;
    this.follow = false;
    this.centre = [this.centre[0] - event.movementX / this.scale, this.centre[1] + event.movementY / this.scale];
  }

  get scale() {
    return Math.min(this.element.width, this.element.height) / (2 * this.reach);
  }

  floorAt(clientX, clientY) {
    const box = this.element.getBoundingClientRect();
    return {
      x: this.centre[0] + (clientX - box.left - box.width / 2) / this.scale,
      y: this.centre[1] - (clientY - box.top - box.height / 2) / this.scale,
    };
  }

  windowAt(x, y) {
    const box = this.element.getBoundingClientRect();
    return {
      x: box.left + box.width / 2 + (x - this.centre[0]) * this.scale,
      y: box.top + box.height / 2 - (y - this.centre[1]) * this.scale,
    };
  }

  draw(aim) {
    const { pen, world, palette, element } = this;
    if (world.pose && this.follow) this.centre = world.pose.p.slice(0, 2);
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.fillStyle = palette.sky;
    pen.fillRect(0, 0, element.width, element.height);
    const scale = this.scale;
    pen.setTransform(
      scale,
      0,
      0,
      -scale,
      element.width / 2 - this.centre[0] * scale,
      element.height / 2 + this.centre[1] * scale,
    );
    this.drawMap();
    this.drawRelief();
    this.strip(world.trail, palette.trail, 0.02);
    this.strip(world.path, palette.path, 0.04);
    this.drawScan();
    const end = aim ?? (world.path.length ? goalOf(world.path) : null);
    if (end) this.drawGoal(end);
    if (world.pose) this.drawRobot();
  }

  drawMap() {
    const grid = this.world.latest.map;
    if (!grid) return;
    if (this.drawnMap !== this.world.mapVersion || this.drawnIn !== this.palette) this.paintMap(grid);
    this.pen.save();
    this.lay(this.picture, grid);
    this.pen.fillStyle = this.palette.wall;
    for (const { left, right, low, high } of this.walls) this.pen.fillRect(left, low, right - left, high - low);
    this.pen.restore();
  }

  drawRelief() {
    const { relief } = this.world.latest;
    if (!relief) return;
    if (this.drawnRelief !== relief || this.reliefIn !== this.palette) {
      [this.drawnRelief, this.reliefIn] = [relief, this.palette];
      this.relief = reliefPicture(relief, this.palette, this.relief);
    }
    this.pen.save();
    this.lay(this.relief, relief);
    this.pen.restore();
  }

  /** A picture of a grid where the grid is. The pen then counts in cells, from the grid's corner. */
  lay(picture, { info: { height, resolution, origin } }) {
    const { pen } = this;
    pen.imageSmoothingEnabled = false;
    pen.translate(origin.position.x, origin.position.y);
    pen.rotate(2 * Math.atan2(origin.orientation.z, origin.orientation.w));
    pen.scale(resolution, resolution);
    pen.save();
    pen.scale(1, -1);
    pen.drawImage(picture, 0, -height);
    pen.restore();
  }

  paintMap(grid) {
    [this.drawnMap, this.drawnIn] = [this.world.mapVersion, this.palette];
    this.picture = floorPicture(grid, this.palette);
    this.walls = blocks(grid);
  }

  strip(places, color, width) {
    this.pen.strokeStyle = color;
    this.pen.lineWidth = width;
    this.pen.beginPath();
    places.forEach(([x, y], i) => (i ? this.pen.lineTo(x, y) : this.pen.moveTo(x, y)));
    this.pen.stroke();
  }

  drawScan() {
    const { world, pen } = this;
    const hits = world.hits();
    if (!hits.length) return;
    const place = world.placeOf(world.latest.scan.header);
    pen.fillStyle = this.palette.scan;
    for (let i = 0; i < hits.length; i += 2) {
      const [x, y] = turned(place.q, [hits[i], hits[i + 1], 0]);
      pen.fillRect(place.p[0] + x - 0.02, place.p[1] + y - 0.02, 0.04, 0.04);
    }
  }

  drawGoal({ x, y, heading }) {
    const { pen } = this;
    pen.strokeStyle = this.palette.path;
    pen.lineWidth = 0.05;
    pen.beginPath();
    pen.arc(x, y, 0.22, 0, 7);
    pen.moveTo(x, y);
    pen.lineTo(x + 0.5 * Math.cos(heading), y + 0.5 * Math.sin(heading));
    pen.stroke();
  }

  drawRobot() {
    const { world, pen } = this;
    const [x, y] = world.pose.p;
    pen.save();
    pen.translate(x, y);
    pen.rotate(world.heading);
    pen.fillStyle = "#f5ba29";
    pen.fillRect(-0.42, -0.11, 0.84, 0.22);
    pen.fillStyle = "#292e38";
    pen.fillRect(0.3, -0.08, 0.1, 0.16);
    pen.restore();
    if (!world.robot) return;
    const poses = world.robot.poses(world.positions);
    world.robot.feet.forEach((foot, i) => {
      const [fx, fy] = compose(world.pose, poses.get(foot)).p;
      pen.fillStyle = world.latest.contacts?.contact[i] ? this.palette.force : this.palette.wall;
      pen.beginPath();
      pen.arc(fx, fy, 0.05, 0, 7);
      pen.fill();
    });
  }

  dispose() {
    this.observer.disconnect();
    this.element.remove();
  }
}
