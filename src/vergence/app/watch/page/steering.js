// The keyboard on a camera's image: arrows move the target as the mouse does, or the cursor with which points are picked.

/** @import { Mouse } from "./mouse.js" */
/** @import { Place } from "./protocol.js" */

const STEPS = 100; // across the image: how many presses of an arrow it takes
/** @type {Record<string, Place>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

export class Steering {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{ name: string, width: number, height: number }} camera
   * @param {Mouse} mouse
   */
  constructor(canvas, camera, mouse) {
    this.camera = camera;
    this.mouse = mouse;
    /** @type {Set<string>} */
    this.down = new Set(); // arrows that are held
    /** @type {Place} */
    this.place = this.middle;
    /** @type {Place} */
    this.cursor = this.middle;
    this.points = false; // whether the cursor was used last, not the mouse
    canvas.tabIndex = 0;
    canvas.addEventListener("keyup", ({ key }) => this.up(key));
    canvas.addEventListener("blur", () => this.release());
  }

  /** @returns {Place} */
  get middle() { return [(this.camera.width - 1) / 2, (this.camera.height - 1) / 2]; }

  /**
   * Moves the target by one step, in the image; with Shift nearer or farther, with Alt it turns.
   * @param {KeyboardEvent} event
   */
  drag(event) {
    const arrow = ARROWS[event.key];
    if (!arrow) return false;
    const step = this.camera.width / STEPS;
    const next = this.stepped(this.place, arrow, step);
    if (!this.down.size || !this.holds(next)) this.grab();
    this.down.add(event.key);
    this.place = this.stepped(this.place, arrow, step);
    this.mouse.move(this.camera.name, ...this.place, event);
    return true;
  }

  /**
   * Moves the cursor by one pixel, with Shift by ten.
   * @param {KeyboardEvent} event
   */
  point(event) {
    const arrow = ARROWS[event.key];
    if (!arrow) return false;
    this.points = true;
    const next = this.stepped(this.cursor, arrow, event.shiftKey ? 10 : 1);
    this.cursor = [
      Math.min(Math.max(next[0], 0), this.camera.width - 1),
      Math.min(Math.max(next[1], 0), this.camera.height - 1),
    ];
    return true;
  }

  /** @param {string} key */
  up(key) {
    if (this.down.delete(key) && !this.down.size) this.mouse.release();
  }

  release() {
    if (!this.down.size) return;
    this.down.clear();
    this.mouse.release();
  }

  grab() { // in the middle of the image, where every lens is known
    this.mouse.release();
    this.place = this.middle;
    this.mouse.grab(this.camera.name, ...this.place);
  }

  /**
   * @param {Place} place
   * @param {Place} arrow
   * @param {number} step
   * @returns {Place}
   */
  stepped([u, v], [du, dv], step) { return [u + step * du, v + step * dv]; }

  /** @param {Place} place */
  holds([u, v]) { return u >= 0 && v >= 0 && u < this.camera.width && v < this.camera.height; }
}
