// The cameras' pictures, with what was looked for, found, wanted and true drawn over them.
// Places are in pixels whose centres are at integers; the canvas has its edges there.

import { inside } from "./polygon.js";

const INK = {
  found: "#14e696", lost: "#ff6e0a", predicted: "#ffffff", windows: "#d6dbe1",
  desired: "#f0e442", true: "#64c8ff", unasked: "#aaaaaa", outline: "#7fd0ff",
};
const OUTLINE = "rgba(15, 18, 22, 0.75)";

export class Pictures {
  constructor(root, legend, mouse) {
    this.root = root;
    this.mouse = mouse;
    this.views = new Map();
    this.layers = new Set();
    for (const box of legend.querySelectorAll("input")) {
      const set = () => {
        box.checked ? this.layers.add(box.dataset.layer) : this.layers.delete(box.dataset.layer);
        for (const view of this.views.values()) view.draw();
      };
      box.addEventListener("change", set);
      set();
    }
    new ResizeObserver(() => this.views.forEach((view) => view.draw())).observe(root);
  }

  begin(about) {
    this.root.replaceChildren();
    this.root.classList.toggle("one", about.cameras.length === 1);
    this.views = new Map(about.cameras.map((camera) => [camera.name, new View(this, camera, about)]));
  }

  // Shows a picture; of those that come faster than they can be decoded, the last.
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
  constructor(pictures, camera, about) {
    this.pictures = pictures;
    this.camera = camera;
    const figure = document.createElement("figure");
    figure.className = "picture";
    figure.dataset.camera = camera.name;
    this.canvas = document.createElement("canvas");
    this.canvas.style.aspectRatio = `${camera.width} / ${camera.height}`;
    this.caption = document.createElement("figcaption");
    figure.append(this.canvas, this.caption);
    pictures.root.append(figure);
    this.caption.innerHTML = "<b></b><span></span>";
    this.caption.firstChild.textContent = camera.name;
    this.hover = false;
    if (about.draggable) this.listen();
  }

  // A place in the picture, px, from one in the window.
  place(event) {
    const box = this.canvas.getBoundingClientRect();
    return [
      (event.clientX - box.left) / box.width * this.camera.width - 0.5,
      (event.clientY - box.top) / box.height * this.camera.height - 0.5,
    ];
  }

  listen() {
    const { canvas } = this;
    const on = (event) => this.header?.outline && inside(this.place(event), this.header.outline);
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || !on(event)) return;
      canvas.setPointerCapture(event.pointerId);
      this.pictures.mouse.grab(this.camera.name, ...this.place(event));
      event.preventDefault();
    });
    canvas.addEventListener("pointermove", (event) => {
      this.pictures.mouse.move(this.camera.name, ...this.place(event), event.shiftKey);
      const hover = Boolean(on(event)) || this.pictures.mouse.holds;
      canvas.style.cursor = this.pictures.mouse.holds ? "grabbing" : hover ? "grab" : "";
      if (hover !== this.hover) { this.hover = hover; this.draw(); }
    });
    const let_go = () => this.pictures.mouse.release();
    canvas.addEventListener("pointerup", let_go);
    canvas.addEventListener("pointercancel", let_go);
    canvas.addEventListener("pointerleave", () => { this.hover = false; this.draw(); });
  }

  put(header, bitmap) {
    this.bitmap?.close();
    [this.header, this.bitmap] = [header, bitmap];
    this.caption.lastChild.textContent = this.words(header);
    this.draw();
  }

  words({ found, asked, time, reasons }) {
    const at = `${time.toFixed(2)} s`;
    const wanted = asked?.filter(Boolean).length;
    if (!wanted) return `nothing looked for · ${at}`;
    const seen = found.filter(Boolean).length;
    const why = reasons.find((reason, j) => asked[j] && reason);
    return `${seen} of ${wanted} found${why ? ` (${why})` : ""} · ${at}`;
  }

  draw() {
    const { canvas, camera, header } = this;
    if (!header) return;
    const scale = window.devicePixelRatio * canvas.clientWidth / camera.width;
    if (!scale) return;
    canvas.width = Math.round(camera.width * scale);
    canvas.height = Math.round(camera.height * scale);
    const context = canvas.getContext("2d");
    context.imageSmoothingQuality = "high";
    if (this.bitmap) context.drawImage(this.bitmap, 0, 0, canvas.width, canvas.height);
    const kx = canvas.width / camera.width, ky = canvas.height / camera.height;
    const at = ([u, v]) => [(u + 0.5) * kx, (v + 0.5) * ky];
    marks(context, header, at, this.pictures.layers, window.devicePixelRatio);
    if (this.hover && header.outline) outline(context, header.outline.map(at));
  }
}

function marks(context, header, at, layers, unit) {
  const pen = new Pen(context, unit);
  const each = (places, draw) => places?.forEach((place, j) => place[0] !== null && draw(at(place), j));
  const asked = (j) => header.asked?.[j];
  if (layers.has("windows") && header.half) {
    each(header.predicted, (_, j) => {
      const [u, v] = header.predicted[j], [hu, hv] = header.half[j];
      pen.box(at([u - hu, v - hv]), at([u + hu, v + hv]), INK.windows);
    });
  }
  if (layers.has("desired")) each(header.desired, (place) => pen.plus(place, 8, INK.desired));
  if (layers.has("true")) each(header.true, (place) => pen.ring(place, 2.5, INK.true));
  if (layers.has("predicted")) each(header.predicted, (place) => pen.diamond(place, 3.5, INK.predicted));
  if (layers.has("found")) each(header.points, (place, j) => header.found[j] && pen.ring(place, 6, INK.found));
  if (layers.has("lost")) {
    each(header.points, (place, j) => !header.found[j] && asked(j) && pen.cross(place, 6, INK.lost));
  }
}

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
  constructor(context, unit) {
    this.context = context;
    this.unit = unit;
  }

  stroke(path, ink, width = 1.8) {
    for (const [style, extra] of [[OUTLINE, 1.6], [ink, 0]]) {
      this.context.strokeStyle = style;
      this.context.lineWidth = (width + extra) * this.unit;
      this.context.stroke(path);
    }
  }

  ring([x, y], r, ink) {
    const path = new Path2D();
    path.arc(x, y, r * this.unit, 0, 2 * Math.PI);
    this.stroke(path, ink);
  }

  lines([x, y], r, ink, ends, width) {
    const path = new Path2D();
    for (const [a, b, c, d] of ends) {
      path.moveTo(x + a * r * this.unit, y + b * r * this.unit);
      path.lineTo(x + c * r * this.unit, y + d * r * this.unit);
    }
    this.stroke(path, ink, width);
  }

  plus(place, r, ink) { this.lines(place, r, ink, [[-1, 0, 1, 0], [0, -1, 0, 1]]); }

  cross(place, r, ink) { this.lines(place, r * 0.75, ink, [[-1, -1, 1, 1], [1, -1, -1, 1]]); }

  diamond(place, r, ink) {
    this.lines(place, r, ink, [[0, -1, 1, 0], [1, 0, 0, 1], [0, 1, -1, 0], [-1, 0, 0, -1]], 1);
  }

  box([left, top], [right, bottom], ink) {
    const path = new Path2D();
    path.rect(left, top, right - left, bottom - top);
    this.stroke(path, ink, 1);
  }
}
