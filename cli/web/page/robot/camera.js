// The camera's picture, while it is wanted: compressed images, shown as they come.

import { h } from "../core/dom.js";

const TOPIC = "/camera/rgb/compressed";

export class Camera {
  constructor(link) {
    this.link = link;
    this.picture = h("img", { alt: "What the robot's camera sees" });
    this.element = h("figure.camera", { hidden: true }, this.picture);
    this.wanted = false;
  }

  show(on) {
    this.wanted = on;
    this.element.hidden = !on;
    if (on) this.resume();
    else this.pause();
  }

  resume() {
    if (this.wanted && !this.stop) this.stop = this.link.subscribe(TOPIC, (image) => this.draw(image));
  }

  pause() {
    this.stop?.();
    this.stop = undefined;
  }

  draw(image) {
    if (this.busy) return; // the next one is newer
    this.busy = true;
    const type = /jpe?g/.test(image.format) ? "image/jpeg" : "image/png";
    const url = URL.createObjectURL(new Blob([image.data], { type }));
    this.picture.onload = this.picture.onerror = () => {
      URL.revokeObjectURL(url);
      this.busy = false;
    };
    this.picture.src = url;
  }
}
