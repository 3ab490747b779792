// The robot in its world, by three.js. Loaded only where there is WebGL.

import * as THREE from "../vendor/three.js";
import { blocks, floorPicture, reliefPicture } from "./grid.js";
import { goalOf } from "./goal.js";
import { readStl } from "./stl.js";

const FOLLOW = 0.12; // share of the way to the robot that the camera goes in one picture
const NEWTON = 0.0015; // m of an arrow for each newton
const PLACES = 2048; // of a path, at most
const RELIEF = 0.006; // m over the floor, so that neither hides the other
const WALL = 0.5; // m, how high a cell of the map is drawn that something stands on
THREE.Object3D.DEFAULT_UP.set(0, 0, 1);

export class View3D {
  constructor(host, world, palette) {
    this.world = world;
    this.renderer = new THREE.WebGLRenderer({ antialias: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.element = host.appendChild(this.renderer.domElement);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.05, 200);
    this.camera.position.set(1.7, -1.9, 1.1);
    this.controls = new THREE.OrbitControls(this.camera, this.element);
    this.controls.maxPolarAngle = 1.54;
    this.controls.minDistance = 0.7;
    this.controls.maxDistance = 60;
    this.follow = true;
    this.palette = palette;
    this.build();
    this.observer = new ResizeObserver(() => this.resize(host));
    this.observer.observe(host);
    this.resize(host);
  }

  get name() {
    const gl = this.renderer.getContext();
    const info = gl.getExtension("WEBGL_debug_renderer_info");
    return info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : "WebGL";
  }

  build() {
    const { scene } = this;
    this.sky = new THREE.HemisphereLight(0xffffff, 0x8890a0, 2.2);
    const sun = new THREE.DirectionalLight(0xffffff, 1.8);
    sun.position.set(-4, -6, 10);
    scene.add(this.sky, sun);
    this.body = new THREE.Group();
    this.links = new Map();
    this.shadow = flat(new THREE.CircleGeometry(0.5, 32), { color: 0x000000, transparent: true, opacity: 0.22 });
    this.shadow.scale.set(1, 0.5, 1);
    this.map = new THREE.Group();
    this.relief = new THREE.Group();
    this.hits = points(0.05, 1024);
    this.scan = new THREE.Group();
    this.scan.add(this.hits);
    this.path = band(0.05, 0.012);
    this.trail = band(0.03, 0.008);
    this.goal = arrow();
    this.arrows = [0, 1, 2, 3].map(() => {
      const shaft = new THREE.Mesh(new THREE.CylinderGeometry(0.012, 0.012, 1), new THREE.MeshBasicMaterial());
      shaft.visible = false;
      return shaft;
    });
    scene.add(
      this.body,
      this.shadow,
      this.map,
      this.relief,
      this.scan,
      this.path,
      this.trail,
      this.goal,
      ...this.arrows,
    );
    this.recolor(this.palette);
  }

  recolor(palette) {
    this.palette = palette;
    this.scene.background = new THREE.Color(palette.sky);
    this.scene.fog = new THREE.Fog(palette.sky, 18, 60);
    this.hits.material.color.set(palette.scan);
    this.path.material.color.set(palette.path);
    this.trail.material.color.set(palette.trail);
    /** @type {any[]} */ (this.goal.children).forEach((part) => part.material.color.set(palette.path));
    this.arrows.forEach((shaft) => shaft.material.color.set(palette.force));
    this.floor?.removeFromParent();
    this.floor = new THREE.GridHelper(60, 60, palette.grid, palette.grid);
    this.floor.rotation.x = Math.PI / 2;
    this.scene.add(this.floor);
    this.drawnMap = this.drawnRelief = undefined;
  }

  resize(host) {
    const { clientWidth: width, clientHeight: height } = host;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  /** Where a place of the window is on the floor: {x, y}, or null above the horizon. */
  floorAt(clientX, clientY) {
    const box = this.element.getBoundingClientRect();
    const at = new THREE.Vector2(
      ((clientX - box.left) / box.width) * 2 - 1,
      1 - ((clientY - box.top) / box.height) * 2,
    );
    const ray = new THREE.Raycaster();
    ray.setFromCamera(at, this.camera);
    const hit = ray.ray.intersectPlane(new THREE.Plane(new THREE.Vector3(0, 0, 1), 0), new THREE.Vector3());
    return hit && { x: hit.x, y: hit.y };
  }

  /** Where a place of the floor is in the window. */
  windowAt(x, y) {
    const box = this.element.getBoundingClientRect();
    const at = new THREE.Vector3(x, y, 0).project(this.camera);
    return { x: box.left + ((at.x + 1) / 2) * box.width, y: box.top + ((1 - at.y) / 2) * box.height };
  }

  set steering(on) {
    this.controls.enabled = !on;
  }

  draw(aim) {
    const { world } = this;
    if (world.robot && this.drawn !== world.robot) this.buildRobot();
    if (world.mapVersion !== this.drawnMap) this.buildMap();
    this.map.visible = Boolean(world.latest.map);
    this.floor.visible = !world.latest.map; // the map has lines of its own
    this.relief.visible = Boolean(world.latest.relief);
    if (world.latest.relief && world.latest.relief !== this.drawnRelief) this.buildRelief(world.latest.relief);
    this.body.visible = this.shadow.visible = Boolean(world.pose);
    if (world.pose) this.placeRobot();
    const scan = world.latest.scan;
    this.scan.visible = Boolean(scan);
    if (scan && scan !== this.drawnScan) {
      this.drawnScan = scan;
      fill(this.hits, world.hits(), 2);
      put(this.scan, world.placeOf(scan.header));
    }
    strip(this.path, world.path);
    strip(this.trail, world.trail);
    const end = aim ?? (world.path.length ? goalOf(world.path) : null);
    this.goal.visible = end !== null;
    if (end) {
      this.goal.position.set(end.x, end.y, 0);
      this.goal.rotation.z = end.heading;
    }
    this.chase();
    this.controls.update();
    this.renderer.render(this.scene, this.camera);
  }

  chase() {
    const pose = this.world.pose;
    if (!pose || !this.follow) return;
    const way = new THREE.Vector3(...pose.p).sub(this.controls.target);
    if (this.seen) way.multiplyScalar(FOLLOW);
    this.seen = true;
    this.controls.target.add(way);
    this.camera.position.add(way);
  }

  buildRobot() {
    this.drawn = this.world.robot;
    for (const link of this.links.values()) discard(link);
    this.body.clear();
    this.links.clear();
    for (const [name, shapes] of this.drawn.links) {
      const link = new THREE.Group();
      for (const one of shapes) {
        if (one.kind === "mesh") this.fetchMesh(one, link);
        else link.add(solid(one));
      }
      this.links.set(name, link);
      this.body.add(link);
    }
  }

  /** A mesh is drawn as soon as the server has given it out; one that cannot be had is left out. */
  async fetchMesh(one, link) {
    try {
      const corners = readStl(await this.world.link.asset(one.file));
      const triangles = new THREE.BufferGeometry();
      triangles.setAttribute("position", new THREE.BufferAttribute(corners, 3));
      triangles.computeVertexNormals();
      const mesh = painted(triangles, one);
      mesh.scale.fromArray(one.scale);
      link.add(mesh);
    } catch (error) {
      console.warn(`${one.file}: ${error.message}`);
    }
  }

  placeRobot() {
    const { world } = this;
    put(this.body, world.pose);
    this.shadow.position.set(world.pose.p[0], world.pose.p[1], 0.004);
    this.shadow.rotation.z = world.heading;
    if (!world.robot) return;
    const poses = world.robot.poses(world.positions);
    for (const [name, link] of this.links) put(link, poses.get(name));
    this.body.updateMatrixWorld();
    world.robot.feet.slice(0, 4).forEach((foot, i) => this.showForce(this.arrows[i], i, foot, poses));
  }

  showForce(shaft, index, foot, poses) {
    const stands = this.world.latest.contacts?.contact[index];
    const force = stands ? this.world.robot.footForce(foot, poses, this.world.efforts) : null;
    const size = force ? Math.hypot(...force) * NEWTON : 0;
    shaft.visible = size > 0.01 && size < 3;
    if (!shaft.visible) return;
    const up = new THREE.Vector3(...force).applyQuaternion(this.body.quaternion).normalize();
    const at = new THREE.Vector3(...poses.get(foot).p).applyMatrix4(this.body.matrixWorld);
    shaft.scale.y = size;
    shaft.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), up);
    shaft.position.copy(at.addScaledVector(up, size / 2));
  }

  /** What the elevation grid says, over the floor of the map. */
  buildRelief(grid) {
    this.drawnRelief = grid;
    const { width, height, resolution } = grid.info;
    const size = [width, height, resolution].join();
    if (size !== this.reliefSize) {
      this.reliefSize = size;
      discard(this.relief); // neither a texture nor its carpet can be given another size
      this.relief.add(carpet(reliefPicture(grid, this.palette), grid, RELIEF));
    } else {
      const texture = /** @type {any} */ (this.relief.children[0]).material.map;
      reliefPicture(grid, this.palette, texture.image);
      texture.needsUpdate = true;
    }
    place(this.relief, grid);
  }

  /** The map: its free cells as a floor, a box for each block of occupied cells. */
  buildMap() {
    this.drawnMap = this.world.mapVersion;
    discard(this.map);
    const grid = this.world.latest.map;
    if (!grid) return;
    const { resolution } = grid.info;
    const floor = carpet(floorPicture(grid, this.palette), grid, 0);
    floor.material.map.anisotropy = 4;
    floor.renderOrder = -1;
    const found = blocks(grid);
    const walls = new THREE.InstancedMesh(
      new THREE.BoxGeometry(1, 1, 1),
      new THREE.MeshLambertMaterial({ color: this.palette.wall }),
      Math.max(1, found.length),
    );
    walls.count = found.length;
    const matrix = new THREE.Matrix4();
    found.forEach(({ left, right, low, high }, i) => {
      matrix.makeScale((right - left) * resolution, (high - low) * resolution, WALL);
      matrix.setPosition(((left + right) / 2) * resolution, ((low + high) / 2) * resolution, WALL / 2);
      walls.setMatrixAt(i, matrix);
    });
    this.map.add(floor, walls);
    place(this.map, grid);
  }

  dispose() {
    this.observer.disconnect();
    this.controls.dispose();
    this.renderer.dispose();
    this.element.remove();
  }
}

function put(object, { p, q }) {
  object.position.set(...p);
  object.quaternion.set(...q);
}

/** Where a grid begins. */
function place(object, { info: { origin } }) {
  const { position: p, orientation: q } = origin;
  put(object, { p: [p.x, p.y, p.z], q: [q.x, q.y, q.z, q.w] });
}

/** The picture of a grid, lying on the floor. */
function carpet(picture, { info: { width, height, resolution } }, z) {
  const texture = new THREE.CanvasTexture(picture);
  texture.colorSpace = THREE.SRGBColorSpace;
  const drawn = flat(new THREE.PlaneGeometry(width * resolution, height * resolution), {
    map: texture,
    transparent: true,
  });
  drawn.position.set((width * resolution) / 2, (height * resolution) / 2, z);
  return drawn;
}

/** Empty a group, and give back what the graphics card holds of it. */
function discard(group) {
  for (const drawn of group.children) {
    drawn.geometry.dispose();
    drawn.material.map?.dispose();
    drawn.material.dispose();
    drawn.dispose?.(); // the places of the walls
  }
  group.clear();
}

function flat(geometry, options) {
  return new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ depthWrite: false, ...options }));
}

function solid(one) {
  const mesh = painted(geometry(one), one);
  if (one.kind === "cylinder") mesh.rotateX(Math.PI / 2); // three.js lays cylinders along y, URDF along z
  return mesh;
}

/** A shape of the robot in its colour and at its place in the link. */
function painted(shape, { color: [r, g, b], pose }) {
  const color = new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace);
  const mesh = new THREE.Mesh(shape, new THREE.MeshStandardMaterial({ color, roughness: 0.55, metalness: 0.1 }));
  put(mesh, pose);
  return mesh;
}

function geometry({ kind, size, radius, length }) {
  if (kind === "box") return new THREE.RoundedBoxGeometry(...size, 4, Math.min(...size) / 4);
  if (kind === "sphere") return new THREE.SphereGeometry(radius, 20, 14);
  return new THREE.CapsuleGeometry(radius, length, 6, 16);
}

function points(size, capacity) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * capacity), 3));
  geometry.setDrawRange(0, 0);
  const cloud = new THREE.Points(geometry, new THREE.PointsMaterial({ size }));
  cloud.frustumCulled = false;
  return cloud;
}

/** A band on the floor along places that are set later: two corners for each place. */
function band(width, height) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(6 * PLACES), 3));
  const corners = [];
  for (let i = 0; i + 1 < PLACES; i++) corners.push(2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 1, 2 * i + 3, 2 * i + 2);
  geometry.setIndex(corners);
  const drawn = flat(geometry, { transparent: true, side: THREE.DoubleSide });
  drawn.position.z = height;
  drawn.frustumCulled = false;
  drawn.userData.half = width / 2;
  return drawn;
}

function arrow() {
  const group = new THREE.Group();
  const ring = flat(new THREE.RingGeometry(0.2, 0.25, 40), { transparent: true });
  const tip = new THREE.Mesh(new THREE.ConeGeometry(0.09, 0.26, 20), new THREE.MeshBasicMaterial());
  tip.rotation.z = -Math.PI / 2;
  tip.position.set(0.38, 0, 0.02);
  ring.position.z = 0.02;
  group.add(ring, tip);
  return group;
}

/** Numbers into the positions of a drawn object: `step` of them for each point. */
function fill(object, flatNumbers, step) {
  const attribute = object.geometry.getAttribute("position");
  const count = Math.min(flatNumbers.length / step, attribute.count);
  for (let i = 0; i < count; i++) attribute.setXYZ(i, flatNumbers[step * i], flatNumbers[step * i + 1], 0);
  attribute.needsUpdate = true;
  object.geometry.setDrawRange(0, count);
}

function strip(object, places) {
  const attribute = object.geometry.getAttribute("position");
  const count = Math.min(places.length, PLACES);
  for (let i = 0; i < count; i++) {
    const [x, y] = places[i];
    const [fromX, fromY] = places[Math.max(0, i - 1)];
    const [toX, toY] = places[Math.min(count - 1, i + 1)];
    const length = Math.hypot(toX - fromX, toY - fromY) || 1;
    const aside = [(-(toY - fromY) / length) * object.userData.half, ((toX - fromX) / length) * object.userData.half];
    attribute.setXYZ(2 * i, x + aside[0], y + aside[1], 0);
    attribute.setXYZ(2 * i + 1, x - aside[0], y - aside[1], 0);
  }
  attribute.needsUpdate = true;
  object.geometry.setDrawRange(0, Math.max(0, 6 * (count - 1)));
}
