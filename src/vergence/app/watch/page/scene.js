// The view in 3D: MuJoCo Studio's viewer in a frame of its own, and the drag of the target in it.

import { context_of } from "./dom.js";
import { outline } from "./images.js";
import { inside } from "./polygon.js";

/** @import { Mouse } from "./mouse.js" */
/** @import { About, Ask, Place, Status } from "./protocol.js" */

const VIEWER = "/index.html";
const STATE = "/state"; // over which the states come
const LINES = [STATE, "/ui"]; // its connections
const AGAIN_MS = 1000;
const TIMEOUT_MS = 20_000; // for the second after the first: it may wait for the old one to be given up
const LONGEST_TIMEOUT_MS = 160_000; // doubled up to this, where a slow computer needs longer
const FRAMES = 3; // drawn after its connections are open, until it shows what has come over them
const SILENT_MS = 2500; // without a state: half a second later the viewer says that it is disconnected
const BAR = 32; // px of the viewer's own bar, which is left outside
const TURN_DEG = 5; // of a press of an arrow
const ZOOM = 1.1;
/** @type {Record<string, [number, number, number]>} */
const KEYS = {
  ArrowLeft: [TURN_DEG, 0, 1], ArrowRight: [-TURN_DEG, 0, 1],
  ArrowUp: [0, -TURN_DEG, 1], ArrowDown: [0, TURN_DEG, 1],
  "+": [0, 0, ZOOM], "=": [0, 0, ZOOM], "-": [0, 0, 1 / ZOOM],
};

export class Scene {
  /**
   * @param {HTMLElement} stage
   * @param {HTMLElement} hint
   * @param {Mouse} mouse
   * @param {Ask} ask
   */
  constructor(stage, hint, mouse, ask) {
    this.stage = stage;
    this.hint = hint;
    this.mouse = mouse;
    /** @type {Place[] | null} */
    this.outline = null;
    this.fovy = 45;
    this.draggable = this.hover = false;
    /** @type {HTMLIFrameElement | null} */
    this.frame = null;
    this.open = false; // the page's own connection
    /** @type {Set<string>} */
    this.lines = new Set(); // the viewer's connections over which something has come
    this.heard_ms = 0; // when the last state came
    this.silent = false; // or was so a few frames ago
    this.waiting = 0; // a timer
    this.timeout = TIMEOUT_MS;
    this.over = document.createElement("canvas");
    stage.addEventListener("keydown", (event) => {
      const turn = KEYS[event.key];
      if (!turn || !this.frame || event.altKey || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      ask({ do: "look", azimuth_deg: turn[0], elevation_deg: turn[1], zoom: turn[2] });
    });
  }

  /** @param {About} about */
  begin(about) {
    this.draggable = about.draggable;
    this.hint.textContent = about.scene
      ? `Drag or arrow keys: turn. Right-drag: shift. Wheel, + and −: zoom.${about.draggable ? " The target can be dragged." : ""}`
      : "";
    if (!about.scene) return this.say(about.no_scene ?? "");
    if (this.frame) return;
    this.stage.replaceChildren();
    const frame = document.createElement("iframe");
    frame.title = "the cell in three dimensions";
    frame.tabIndex = -1; // the keys are the stage's
    this.stage.tabIndex = 0;
    this.stage.role = "application";
    this.stage.ariaLabel = "View in 3D: arrow keys turn it, plus and minus zoom";
    frame.style.height = `calc(100% + ${BAR}px)`;
    this.stage.append(frame, this.over);
    frame.addEventListener("load", () => this.loaded(frame));
    this.frame = frame;
    this.load();
  }

  /** @param {boolean} open  whether the page itself is connected */
  connected(open) {
    this.open = open;
    if (open && this.lost) this.load();
    this.show();
  }

  get lost() { return !this.open || !LINES.every((path) => this.lines.has(path)); }

  /** Shows the viewer only while it is connected: it would say that it is not, over whatever it showed last. */
  show() { this.stage.classList.toggle("lost", this.frame !== null && (this.lost || this.silent)); }

  /** Loads the viewer, again if it has lost its connection. */
  load() {
    if (!this.frame) return;
    clearTimeout(this.waiting);
    this.lines = new Set();
    this.show();
    this.frame.src = VIEWER;
  }

  /**
   * Follows a viewer that has just come, before its script connects.
   * @param {HTMLIFrameElement} frame
   */
  loaded(frame) {
    const page = frame.contentDocument && frame.contentWindow; // null for the browser's page of an error
    if (page?.location.pathname !== VIEWER) return this.wait(AGAIN_MS);
    this.follow(page);
    this.look(page, this.lines);
    this.listen(page);
    this.wait(LONGEST_TIMEOUT_MS);
  }

  /**
   * Hears whether the viewer is connected; loads it again when it is not, sooner than it would try by itself.
   * @param {Window} page
   */
  follow(page) {
    const scene = this, { WebSocket: Own } = /** @type {typeof globalThis} */ (/** @type {unknown} */ (page));
    /** @type {Set<string>} */
    const open = this.lines = new Set();
    Object.assign(page, { WebSocket: class extends Own {
      /** @param {string} address */
      constructor(address) {
        super(address);
        const path = new URL(address, location.href).pathname;
        this.addEventListener("message", () => scene.heard(page, open.add(path)), { once: true });
        if (path === STATE) this.addEventListener("message", () => { scene.heard_ms = performance.now(); });
        this.addEventListener("close", () => { open.delete(path); scene.heard(page, open, AGAIN_MS); });
      }
    } });
  }

  /**
   * Looks in every frame of a viewer, before it is seen, whether states come.
   * @param {Window} page
   * @param {Set<string>} open  its connections
   * @param {number} unsure  frames to be drawn before it is believed to show what has come
   */
  look(page, open, unsure = 0) {
    if (open !== this.lines) return;
    const quiet = performance.now() - this.heard_ms > SILENT_MS;
    const silent = quiet || unsure > 0;
    if (silent !== this.silent) { this.silent = silent; this.show(); }
    page.requestAnimationFrame(() => this.look(page, open, quiet ? FRAMES : unsure - 1));
  }

  /**
   * @param {Window} page
   * @param {Set<string>} open  connections of a viewer over which something has come
   * @param {number} wait_ms  until it is loaded again, unless all are open by then
   */
  heard(page, open, wait_ms = this.timeout) {
    if (open !== this.lines) return; // of a viewer that is no longer there
    if (this.lost) {
      this.show();
      return this.wait(wait_ms);
    }
    clearTimeout(this.waiting);
    this.timeout = TIMEOUT_MS;
    after(FRAMES, page, () => this.show()); // what it has drawn so far says that it is not connected
  }

  /** @param {number} wait_ms  until the viewer is loaded again */
  wait(wait_ms) {
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.again(wait_ms), wait_ms);
  }

  /** @param {number} waited_ms */
  again(waited_ms) {
    if (waited_ms > AGAIN_MS) this.timeout = Math.min(2 * waited_ms, LONGEST_TIMEOUT_MS);
    if (this.open) this.load();
  }

  /** @param {string} text */
  say(text) {
    const words = document.createElement("p");
    words.textContent = text;
    this.stage.replaceChildren(words);
    this.stage.tabIndex = -1;
    this.frame = null;
    this.show();
  }

  /** @param {Status} status */
  status({ outline: around, fovy, preparing }) {
    this.stage.classList.toggle("preparing", preparing ?? false);
    this.outline = around ?? null;
    this.fovy = fovy ?? this.fovy;
    this.draw();
  }

  /**
   * What the viewer needs of the mouse it gets, except while the target is under it or dragged.
   * @param {Window} page
   */
  listen(page) {
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
    if (!this.draggable || this.lost) return;
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
    if (kind === "pointermove") this.mouse.move("", ...place, event);
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

/**
 * Calls back when a window has drawn so many frames.
 * @param {number} frames
 * @param {Window} page
 * @param {() => void} then
 */
function after(frames, page, then) {
  page.requestAnimationFrame(() => (frames > 1 ? after(frames - 1, page, then) : then()));
}
