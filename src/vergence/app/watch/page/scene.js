// The view in space: MuJoCo Studio's viewer in a frame of its own, and the mouse's hold on the target.

import { inside } from "./polygon.js";
import { outline } from "./pictures.js";

const BAR = 32; // px of the viewer's own bar, which is left outside

export class Scene {
  constructor(stage, hint, mouse) {
    Object.assign(this, { stage, hint, mouse });
    this.outline = null;
    this.fovy = 45;
  }

  begin(about) {
    this.draggable = about.draggable;
    this.hint.textContent = about.scene
      ? `drag turns, right drag shifts, wheel zooms${about.draggable ? "; the target can be dragged" : ""}`
      : "";
    if (!about.scene) return this.say(about.no_scene);
    if (this.frame) return;
    this.stage.replaceChildren();
    this.frame = document.createElement("iframe");
    this.frame.title = "the cell in three dimensions";
    this.frame.style.height = `calc(100% + ${BAR}px)`;
    this.over = document.createElement("canvas");
    this.stage.append(this.frame, this.over);
    this.frame.addEventListener("load", () => this.listen());
    this.frame.src = "/index.html";
  }

  say(text) {
    const words = document.createElement("p");
    words.textContent = text;
    this.stage.replaceChildren(words);
    this.frame = null;
  }

  status({ outline: around, fovy }) {
    this.outline = around ?? null;
    this.fovy = fovy ?? this.fovy;
    this.draw();
  }

  // What the viewer needs of the mouse it gets, except while the target is under it or in hand.
  listen() {
    const page = this.frame.contentWindow;
    for (const kind of ["pointerdown", "mousedown", "pointermove", "mousemove", "pointerup", "mouseup"]) {
      page.addEventListener(kind, (event) => this.hear(kind, event), true);
    }
    page.addEventListener("mouseleave", () => this.mouse.holds || this.over_target(false));
  }

  hear(kind, event) {
    if (!this.draggable) return;
    const place = this.place(event);
    const hit = this.outline !== null && inside(place, this.outline);
    const ours = this.mouse.holds || (hit && event.buttons === 1 && kind.endsWith("down"));
    if (!event.buttons || this.mouse.holds) this.over_target(hit || this.mouse.holds);
    if (!ours) return;
    event.stopImmediatePropagation();
    if (kind === "pointerdown" && !this.mouse.holds) {
      event.target.setPointerCapture?.(event.pointerId);
      this.mouse.grab("", ...place);
    }
    if (kind === "pointermove") this.mouse.move("", ...place, event.shiftKey);
    if (kind === "pointerup") this.mouse.release();
  }

  // A place in the view, in normalized image coordinates.
  place({ clientX, clientY }) {
    const [width, height] = [this.stage.clientWidth, this.stage.clientHeight];
    const focal = this.focal(height);
    return [(clientX - width / 2) / focal, (clientY - height / 2) / focal];
  }

  focal(height) { return height / 2 / Math.tan(this.fovy * Math.PI / 360); }

  over_target(hover) {
    if (hover === this.hover) return;
    this.hover = hover;
    this.draw();
  }

  draw() {
    if (!this.over) return;
    const unit = window.devicePixelRatio;
    const [width, height] = [this.stage.clientWidth, this.stage.clientHeight];
    this.over.width = Math.round(width * unit);
    this.over.height = Math.round(height * unit);
    if (!this.hover || !this.outline) return;
    const focal = this.focal(height);
    outline(this.over.getContext("2d"), this.outline.map(
      ([x, y]) => [unit * (width / 2 + focal * x), unit * (height / 2 + focal * y)],
    ));
  }
}
