// The drag of the target with the mouse.

/** @import { Ask, Command } from "./protocol.js" */

export class Mouse {
  /** @param {Ask} ask */
  constructor(ask) {
    this.ask = ask;
    /** @type {string | null} */
    this.view = null;
    /** @type {Command | null} */
    this.next = null;
  }

  get holds() { return this.view !== null; }

  /**
   * Takes the target in a view: a camera's image, u and v in px; or in 3D (""), normalized.
   * @param {string} view
   * @param {number} u
   * @param {number} v
   */
  grab(view, u, v) {
    this.view = view;
    this.ask({ do: "grab", view, u, v });
  }

  /**
   * Moves it; at most once a frame, a mouse reports more often than anyone can use.
   * @param {string} view
   * @param {number} u
   * @param {number} v
   * @param {{ shiftKey: boolean, ctrlKey: boolean, altKey: boolean, metaKey: boolean }} keys
   */
  move(view, u, v, { shiftKey, ctrlKey, altKey, metaKey }) {
    if (this.view !== view) return;
    if (!this.next) requestAnimationFrame(() => this.send());
    this.next = { do: "move", view, u, v, along: shiftKey, turn: ctrlKey || altKey || metaKey };
  }

  send() {
    if (this.next && this.holds) this.ask(this.next);
    this.next = null;
  }

  release() {
    if (!this.holds) return;
    this.send();
    this.view = null;
    this.ask({ do: "release" });
  }
}
