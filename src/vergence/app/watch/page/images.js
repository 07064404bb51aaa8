// The cameras' images, with what was looked for, found, desired and true drawn over them.
// Places are in pixels whose centres are at integers; the canvas has its edges there.

import { context_of, element } from "./dom.js";
import { inside } from "./polygon.js";
import { Steering } from "./steering.js";

/** @import { Mouse } from "./mouse.js" */
/** @import { Picking } from "./picking.js" */
/** @import { About, CameraAbout, ImageHeader, Marks, Place } from "./protocol.js" */

const INK = {
  found: "#14e696", lost: "#ff6e0a", predicted: "#ffffff", windows: "#d6dbe1",
  desired: "#f0e442", true: "#64c8ff", unasked: "#aaaaaa", outline: "#7fd0ff", picked: "#ff7ad9",
};
const OUTLINE = "rgba(15, 18, 22, 0.75)";

export class Images {
  /**
   * @param {HTMLElement} root
   * @param {HTMLElement} legend
   * @param {Mouse} mouse
   * @param {Picking} picking
   */
  constructor(root, legend, mouse, picking) {
    this.root = root;
    this.mouse = mouse;
    this.picking = picking;
    picking.changed = () => { for (const view of this.views.values()) view.draw(); };
    picking.begun = () => this.views.get(picking.camera)?.canvas.focus(); // for the arrow keys
    /** @type {Map<string, View>} */
    this.views = new Map();
    /** @type {Set<string>} */
    this.layers = new Set();
    for (const box of legend.querySelectorAll("input")) {
      const set = () => {
        const layer = box.dataset.layer ?? "";
        box.checked ? this.layers.add(layer) : this.layers.delete(layer);
        for (const view of this.views.values()) view.draw();
      };
      box.addEventListener("change", set);
      set();
    }
    new ResizeObserver(() => this.views.forEach((view) => view.draw())).observe(root);
  }

  /** @param {About} about */
  begin(about) {
    this.root.replaceChildren();
    this.root.classList.toggle("one", about.cameras.length === 1);
    element("truth").hidden = !about.truth;
    this.views = new Map(about.cameras.map((camera) => [camera.name, new View(this, camera, about)]));
  }

  /**
   * Shows an image; of those that come faster than they can be decoded, the last.
   * @param {ImageHeader} header
   * @param {Blob | null} blob
   */
  async show(header, blob) {
    const view = this.views.get(header.camera);
    if (!view) return;
    view.next = [header, blob];
    if (view.busy) return;
    view.busy = true;
    while (view.next) {
      const [shown, jpeg] = view.next;
      view.next = null;
      view.put(shown, jpeg && await createImageBitmap(jpeg));
    }
    view.busy = false;
  }
}

class View {
  /**
   * @param {Images} images
   * @param {CameraAbout} camera
   * @param {About} about
   */
  constructor(images, camera, about) {
    /** @type {[ImageHeader, Blob | null] | null} */
    this.next = null;
    this.busy = false;
    /** @type {ImageHeader | null} */
    this.header = null;
    /** @type {ImageBitmap | null} */
    this.bitmap = null;
    this.images = images;
    this.camera = camera;
    const figure = document.createElement("figure");
    figure.className = "image";
    figure.dataset.camera = camera.name;
    this.canvas = document.createElement("canvas");
    this.canvas.style.aspectRatio = `${camera.width} / ${camera.height}`;
    this.caption = document.createElement("figcaption");
    figure.append(this.canvas, this.caption);
    images.root.append(figure);
    const name = document.createElement("b");
    name.textContent = camera.name;
    this.words = document.createElement("span");
    this.caption.append(name, this.words);
    this.hover = false;
    this.canvas.role = "img";
    this.canvas.ariaLabel = `image of ${camera.name}`;
    const picks = about.images && camera.name === about.task_camera;
    if (about.mode !== "live" || !(about.draggable || picks)) return;
    this.steering = new Steering(this.canvas, camera, images.mouse);
    this.canvas.role = "application"; // arrow keys belong to the image
    if (about.draggable) this.canvas.ariaLabel += ": arrow keys move the target, with Shift nearer or farther, with Alt they turn it";
    this.canvas.addEventListener("keydown", (event) => this.key(event, about.draggable));
    if (about.draggable) this.listen();
    if (picks) this.listen_for_points();
  }

  /**
   * @param {KeyboardEvent} event
   * @param {boolean} draggable
   */
  key(event, draggable) {
    const { steering, images: { picking } } = this;
    if (!steering || event.metaKey) return;
    if (this.picks ? steering.point(event) : draggable && steering.drag(event)) {
      event.preventDefault();
      if (this.picks) this.draw();
    } else if (this.picks && this.header && (event.key === " " || event.key === "Enter")) {
      event.preventDefault();
      picking.click(steering.cursor, this.canvas.clientWidth / this.camera.width, this.header);
    }
  }

  /**
   * A place in the image, px, from one in the window.
   * @param {MouseEvent} event
   * @returns {Place}
   */
  place(event) {
    const box = this.canvas.getBoundingClientRect();
    return [
      (event.clientX - box.left) / box.width * this.camera.width - 0.5,
      (event.clientY - box.top) / box.height * this.camera.height - 0.5,
    ];
  }

  get picks() { return this.images.picking.on && this.camera.name === this.images.picking.camera; }

  listen_for_points() {
    this.canvas.addEventListener("pointerdown", () => { if (this.steering) this.steering.points = false; });
    this.canvas.addEventListener("click", (event) => {
      if (!this.picks || !this.header) return;
      const place = this.place(event), { width, height } = this.camera;
      if (place[0] < 0 || place[1] < 0 || place[0] > width - 1 || place[1] > height - 1) return;
      this.images.picking.click(place, this.canvas.clientWidth / width, this.header);
    });
  }

  listen() {
    const { canvas } = this;
    /** @param {PointerEvent} event */
    const on = (event) => !this.picks && this.header?.outline && inside(this.place(event), this.header.outline);
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || !on(event)) return;
      canvas.setPointerCapture(event.pointerId);
      this.images.mouse.grab(this.camera.name, ...this.place(event));
      event.preventDefault();
    });
    canvas.addEventListener("pointermove", (event) => {
      this.images.mouse.move(this.camera.name, ...this.place(event), event);
      const hover = Boolean(on(event)) || this.images.mouse.holds;
      canvas.style.cursor = this.picks ? "crosshair" : this.images.mouse.holds ? "grabbing" : hover ? "grab" : "";
      if (hover !== this.hover) { this.hover = hover; this.draw(); }
    });
    const release = () => this.images.mouse.release();
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("pointerleave", () => { this.hover = false; this.draw(); });
  }

  /**
   * @param {ImageHeader} header
   * @param {ImageBitmap | null} bitmap
   */
  put(header, bitmap) {
    this.bitmap?.close();
    [this.header, this.bitmap] = [header, bitmap];
    this.words.textContent = described(header);
    this.draw();
  }

  draw() {
    const { canvas, camera, header } = this;
    if (!header) return;
    const scale = window.devicePixelRatio * canvas.clientWidth / camera.width;
    if (!scale) return;
    canvas.width = Math.round(camera.width * scale);
    canvas.height = Math.round(camera.height * scale);
    const context = context_of(canvas);
    context.imageSmoothingQuality = "high";
    if (this.bitmap) context.drawImage(this.bitmap, 0, 0, canvas.width, canvas.height);
    const kx = canvas.width / camera.width, ky = canvas.height / camera.height;
    /** @type {(place: Place) => Place} */
    const at = ([u, v]) => [(u + 0.5) * kx, (v + 0.5) * ky];
    for (const target of [header, ...header.others ?? []]) {
      marks(context, target, at, this.images.layers, window.devicePixelRatio);
    }
    if (this.picks) picked(context, this.images.picking.points.map(at), window.devicePixelRatio);
    if (this.picks && this.steering?.points) {
      new Pen(context, window.devicePixelRatio).sight(at(this.steering.cursor), INK.picked);
    }
    if (this.hover && header.outline) outline(context, header.outline.map(at));
  }
}

/**
 * Says in words what an image showed.
 * @param {ImageHeader} header
 */
function described({ found = [], asked = [], time, reasons = [] }) {
  const at = `${time.toFixed(2)}\u00a0s`;
  const sought = asked.filter(Boolean).length;
  if (!sought) return `nothing looked for · ${at}`;
  const seen = found.filter(Boolean).length;
  const why = reasons.find((reason, j) => asked[j] && reason);
  return `${seen} of ${sought} found${why ? ` (${why})` : ""} · ${at}`;
}

/**
 * Draws what was measured of one target.
 * @param {CanvasRenderingContext2D} context
 * @param {Marks} target
 * @param {(place: Place) => Place} at
 * @param {Set<string>} layers
 * @param {number} unit
 */
function marks(context, target, at, layers, unit) {
  const pen = new Pen(context, unit);
  const { points, predicted, half, found = [], asked = [] } = target;
  /** @type {(places: Place[] | undefined, draw: (place: Place, j: number) => void) => void} */
  const each = (places, draw) => places?.forEach((place, j) => { if (place[0] !== null) draw(at(place), j); });
  if (layers.has("windows") && predicted && half) {
    each(predicted, (_, j) => {
      const [u, v] = predicted[j], [hu, hv] = half[j];
      pen.box(at([u - hu, v - hv]), at([u + hu, v + hv]), INK.windows);
    });
  }
  if (target.curves?.length) {
    for (const { points: numbers, closed } of target.curves) {
      /** @type {(name: "true" | "desired" | "found", places: Place[] | undefined) => void} */
      const curve = (name, places) => {
        if (!places || !layers.has(name)) return;
        const known = numbers.map((j) => places[j]);
        if (known.every((place) => place && place[0] !== null)) pen.curve(known.map(at), closed, INK[name]);
      };
      curve("true", target.true);
      curve("desired", target.desired);
      if (numbers.every((j) => found[j])) curve("found", points);
    }
    return;
  }
  if (layers.has("desired")) each(target.desired, (place) => pen.plus(place, 8, INK.desired));
  if (layers.has("true")) each(target.true, (place) => pen.ring(place, 2.5, INK.true));
  if (layers.has("predicted")) each(predicted, (place) => pen.diamond(place, 3.5, INK.predicted));
  if (layers.has("found")) each(points, (place, j) => { if (found[j]) pen.ring(place, 6, INK.found); });
  if (layers.has("lost")) {
    each(points, (place, j) => { if (!found[j] && asked[j]) pen.cross(place, 6, INK.lost); });
  }
}

/**
 * Draws numbered crosses where points are picked.
 * @param {CanvasRenderingContext2D} context
 * @param {Place[]} places
 * @param {number} unit
 */
function picked(context, places, unit) {
  const pen = new Pen(context, unit);
  context.font = `600 ${11 * unit}px system-ui, sans-serif`;
  places.forEach((place, j) => {
    pen.plus(place, 7, INK.picked);
    const [x, y] = [place[0] + 6 * unit, place[1] - 6 * unit];
    context.lineWidth = 3 * unit;
    context.strokeStyle = OUTLINE;
    context.strokeText(String(j + 1), x, y);
    context.fillStyle = INK.picked;
    context.fillText(String(j + 1), x, y);
  });
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Place[]} places
 */
export function outline(context, places) {
  context.beginPath();
  places.forEach(([x, y]) => context.lineTo(x, y));
  context.closePath();
  context.fillStyle = "rgba(127, 208, 255, 0.18)";
  context.strokeStyle = INK.outline;
  context.lineWidth = 1.5 * window.devicePixelRatio;
  context.fill();
  context.stroke();
}

// Draws each mark twice: a dark rim, then its ink.
class Pen {
  /**
   * @param {CanvasRenderingContext2D} context
   * @param {number} unit  px of the canvas in one of the page
   */
  constructor(context, unit) {
    this.context = context;
    this.unit = unit;
  }

  /**
   * @param {Path2D} path
   * @param {string} ink
   */
  stroke(path, ink, width = 1.8) {
    for (const { style, extra } of [{ style: OUTLINE, extra: 1.6 }, { style: ink, extra: 0 }]) {
      this.context.strokeStyle = style;
      this.context.lineWidth = (width + extra) * this.unit;
      this.context.stroke(path);
    }
  }

  /**
   * @param {Place} place
   * @param {number} r
   * @param {string} ink
   */
  ring([x, y], r, ink) {
    const path = new Path2D();
    path.arc(x, y, r * this.unit, 0, 2 * Math.PI);
    this.stroke(path, ink);
  }

  /**
   * @param {Place} place
   * @param {number} r
   * @param {string} ink
   * @param {number[][]} ends
   * @param {number} [width]
   */
  lines([x, y], r, ink, ends, width) {
    const path = new Path2D();
    for (const [a, b, c, d] of ends) {
      path.moveTo(x + a * r * this.unit, y + b * r * this.unit);
      path.lineTo(x + c * r * this.unit, y + d * r * this.unit);
    }
    this.stroke(path, ink, width);
  }

  /**
   * @param {Place[]} places
   * @param {boolean} closed
   * @param {string} ink
   */
  curve(places, closed, ink) {
    const path = new Path2D();
    places.forEach(([x, y]) => path.lineTo(x, y));
    if (closed) path.closePath();
    this.stroke(path, ink);
  }

  /**
   * @param {Place} place
   * @param {number} r
   * @param {string} ink
   */
  plus(place, r, ink) { this.lines(place, r, ink, [[-1, 0, 1, 0], [0, -1, 0, 1]]); }

  /**
   * @param {Place} place
   * @param {number} r
   * @param {string} ink
   */
  cross(place, r, ink) { this.lines(place, r * 0.75, ink, [[-1, -1, 1, 1], [1, -1, -1, 1]]); }

  /**
   * @param {Place} place
   * @param {number} r
   * @param {string} ink
   */
  diamond(place, r, ink) {
    this.lines(place, r, ink, [[0, -1, 1, 0], [1, 0, 0, 1], [0, 1, -1, 0], [-1, 0, 0, -1]], 1);
  }

  /**
   * The cursor of the keyboard: four lines that leave the middle free.
   * @param {Place} place
   * @param {string} ink
   */
  sight(place, ink) {
    this.lines(place, 12, ink, [[-1, 0, -0.3, 0], [0.3, 0, 1, 0], [0, -1, 0, -0.3], [0, 0.3, 0, 1]], 1.2);
  }

  /**
   * @param {Place} corner
   * @param {Place} opposite
   * @param {string} ink
   */
  box([left, top], [right, bottom], ink) {
    const path = new Path2D();
    path.rect(left, top, right - left, bottom - top);
    this.stroke(path, ink, 1);
  }
}
