// Points picked in the task camera's image, which the arm is then to keep where they are.

import { element } from "./dom.js";

/** @import { About, Ask, ImageHeader, Place } from "./protocol.js" */

const NEAR_PX = 9; // of a picked point, on the page: a click there takes it away again
const MOST = 64;

export class Picking {
  /**
   * @param {HTMLElement} root
   * @param {Ask} ask
   */
  constructor(root, ask) {
    this.root = root;
    this.ask = ask;
    this.pick = /** @type {HTMLButtonElement} */ (element("pick"));
    this.track = /** @type {HTMLButtonElement} */ (element("track-points"));
    this.words = element("pick-hint");
    this.on = false;
    this.camera = "";
    /** @type {Place[]} */
    this.points = [];
    /** @type {number | null} */
    this.time = null; // of the image that they are in
    /** @type {() => void} */
    this.changed = () => {};
    /** @type {() => void} */
    this.begun = () => {};
    this.pick.addEventListener("click", () => this.set(!this.on));
    this.track.addEventListener("click", () => {
      this.ask({ do: "track", time: this.time, points: this.points });
      this.set(false);
    });
    element("take-goal").addEventListener("click", () => ask({ do: "goal" }));
    document.addEventListener("keydown", (event) => { if (event.key === "Escape") this.set(false); });
  }

  /** @param {About} about */
  begin({ images, mode, task_camera }) {
    this.root.hidden = mode !== "live" || !images;
    this.camera = task_camera ?? "";
    this.set(false);
  }

  /** @param {boolean} on */
  set(on) {
    if (on) this.ask({ do: "pause" });
    this.on = on;
    this.points = [];
    this.tell();
    if (on) this.begun();
  }

  /**
   * Takes a point, or takes back the one that is near.
   * @param {Place} place
   * @param {number} scale  px of the page in one of the image
   * @param {ImageHeader} header
   */
  click(place, scale, header) {
    if (header.time !== this.time) this.points = []; // they were in an earlier image
    this.time = header.time;
    const near = this.points.findIndex(([u, v]) => Math.hypot(u - place[0], v - place[1]) * scale < NEAR_PX);
    if (near >= 0) this.points.splice(near, 1);
    else if (this.points.length < MOST) this.points.push(place);
    this.tell();
  }

  tell() {
    const count = this.points.length;
    this.pick.textContent = this.on ? "Cancel" : "Pick points";
    this.pick.ariaPressed = String(this.on);
    this.track.hidden = !this.on;
    this.track.disabled = !count;
    this.track.textContent = count ? `Track ${count} point${count > 1 ? "s" : ""}` : "Track";
    this.words.textContent = this.on
      ? `Click corners or spots in the image of ${this.camera}, or move the cursor with the arrow keys (with Shift by 10 px) and press Enter; click a point again to remove it. The arm then keeps the points where they are.`
      : "";
    this.changed();
  }
}
