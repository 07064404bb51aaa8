// The view in 3D: MuJoCo Studio's viewer in a frame of its own, and the drag of the target in it.

import { context_of } from "./dom.js";
import { outline } from "./images.js";
import { inside } from "./polygon.js";

/** @import { Mouse } from "./mouse.js" */
/** @import { About, Place, Status } from "./protocol.js" */

const BAR = 32; // px of the viewer's own bar, which is left outside

export class Scene {
  /**
   * @param {HTMLElement} stage
   * @param {HTMLElement} hint
   * @param {Mouse} mouse
   */
  constructor(stage, hint, mouse) {
    this.stage = stage;
    this.hint = hint;
    this.mouse = mouse;
    /** @type {Place[] | null} */
    this.outline = null;
    this.fovy = 45;
    this.draggable = this.hover = false;
    /** @type {HTMLIFrameElement | null} */
    this.frame = null;
    this.over = document.createElement("canvas");
  }

  /** @param {About} about */
  begin(about) {
    this.draggable = about.draggable;
    this.hint.textContent = about.scene
      ? `drag turns, right drag shifts, wheel zooms${about.draggable ? "; the target can be dragged" : ""}`
      : "";
    if (!about.scene) return this.say(about.no_scene ?? "");
    if (this.frame) return;
    this.stage.replaceChildren();
    const frame = document.createElement("iframe");
    frame.title = "the cell in three dimensions";
    frame.style.height = `calc(100% + ${BAR}px)`;
    this.stage.append(frame, this.over);
    frame.addEventListener("load", () => this.listen(frame));
    frame.src = "/index.html";
    this.frame = frame;
  }

  /** @param {string} text */
  say(text) {
    const words = document.createElement("p");
    words.textContent = text;
    this.stage.replaceChildren(words);
    this.frame = null;
  }

  /** @param {Status} status */
  status({ outline: around, fovy }) {
    this.outline = around ?? null;
    this.fovy = fovy ?? this.fovy;
    this.draw();
  }

  /**
   * What the viewer needs of the mouse it gets, except while the target is under it or dragged.
   * @param {HTMLIFrameElement} frame
   */
  listen(frame) {
    const page = frame.contentWindow;
    if (!page) return;
    const kinds = /** @type {const} */ (
      ["pointerdown", "mousedown", "pointermove", "mousemove", "pointerup", "mouseup"]
    );
    for (const kind of kinds) page.addEventListener(kind, (event) => this.hear(kind, event), true);
    page.addEventListener("mouseleave", () => this.mouse.holds || this.over_target(false));
  }

  /**
   * @param {string} kind
   * @param {MouseEvent | PointerEvent} event
   */
  hear(kind, event) {
    if (!this.draggable) return;
    const place = this.place(event);
    const hit = this.outline !== null && inside(place, this.outline);
    const ours = this.mouse.holds || (hit && event.buttons === 1 && kind.endsWith("down"));
    if (!event.buttons || this.mouse.holds) this.over_target(hit || this.mouse.holds);
    if (!ours) return;
    event.stopImmediatePropagation();
    if (kind === "pointerdown" && !this.mouse.holds) {
      if ("pointerId" in event) /** @type {Element} */ (event.target).setPointerCapture?.(event.pointerId);
      this.mouse.grab("", ...place);
    }
    if (kind === "pointermove") this.mouse.move("", ...place, event.shiftKey);
    if (kind === "pointerup") this.mouse.release();
  }

  /**
   * A place in the view, in normalized image coordinates.
   * @param {MouseEvent} event
   * @returns {Place}
   */
  place({ clientX, clientY }) {
    const [width, height] = [this.stage.clientWidth, this.stage.clientHeight];
    const focal = this.focal(height);
    return [(clientX - width / 2) / focal, (clientY - height / 2) / focal];
  }

  /** @param {number} height */
  focal(height) { return height / 2 / Math.tan(this.fovy * Math.PI / 360); }

  /** @param {boolean} hover */
  over_target(hover) {
    if (hover === this.hover) return;
    this.hover = hover;
    this.draw();
  }

  draw() {
    if (!this.frame) return;
    const unit = window.devicePixelRatio;
    const [width, height] = [this.stage.clientWidth, this.stage.clientHeight];
    this.over.width = Math.round(width * unit);
    this.over.height = Math.round(height * unit);
    if (!this.hover || !this.outline) return;
    const focal = this.focal(height);
    outline(context_of(this.over), this.outline.map(
      ([x, y]) => [unit * (width / 2 + focal * x), unit * (height / 2 + focal * y)],
    ));
  }
}
