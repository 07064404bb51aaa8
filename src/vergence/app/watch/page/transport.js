// Time: pause, step, reset, speed, and in a recording the slider.

import { element } from "./dom.js";

/** @import { About, Ask, Status } from "./protocol.js" */

const SILENT_MS = 2500; // without news of a run

export class Transport {
  /** @param {Ask} ask */
  constructor(ask) {
    this.ask = ask;
    this.time = element("time");
    this.pause = /** @type {HTMLButtonElement} */ (element("pause"));
    this.step = /** @type {HTMLButtonElement} */ (element("step"));
    this.reset = element("reset");
    this.stop = /** @type {HTMLButtonElement} */ (element("stop"));
    this.speed = /** @type {HTMLSelectElement} */ (element("speed"));
    this.measured = element("measured");
    this.badge = element("badge");
    this.reason = element("reason");
    this.slider = element("slider");
    this.seek = /** @type {HTMLInputElement} */ (element("seek"));
    this.cell = element("cell");
    this.paused = this.recording = this.robot = this.sliding = this.runs = false;
    this.stop.addEventListener("click", () => ask({ do: "stop" }));
    this.pause.addEventListener("click", () => this.toggle());
    this.step.addEventListener("click", () => ask({ do: "step" }));
    this.reset.addEventListener("click", () => ask({ do: "reset" }));
    this.speed.addEventListener("change", () => ask({ do: "speed", value: Number(this.speed.value) }));
    this.seek.addEventListener("input", () => ask({ do: "seek", value: Number(this.seek.value) }));
    this.seek.addEventListener("pointerdown", () => { this.sliding = true; });
    this.seek.addEventListener("pointerup", () => { this.sliding = false; });
    document.addEventListener("keydown", (event) => {
      if (event.key !== " " || event.defaultPrevented || (event.target instanceof Element && event.target.matches("input, select, button"))) return;
      event.preventDefault();
      const button = this.robot ? this.stop : this.pause;
      if (!button.disabled) this.toggle();
    });
  }

  /** @param {About} about */
  begin(about) {
    this.cell.textContent = about.cell;
    document.title = `${about.cell} · vergence`;
    this.recording = about.mode === "recording";
    this.slider.hidden = !this.recording;
    if (this.recording) this.seek.max = String(about.duration);
    this.robot = about.mode === "robot";
    this.stop.hidden = !this.robot;
    this.pause.hidden = this.step.hidden = this.reset.hidden = this.robot;
    element("speed-choice").hidden = this.robot;
    this.reset.textContent = this.recording ? "To the start" : "Restart";
  }

  toggle() { this.ask({ do: this.robot ? "stop" : this.paused ? "resume" : "pause" }); }

  /** @param {boolean} open */
  connected(open) {
    if (!open) this.mark("not connected", "plain", "vergence has ended or does not answer; this page connects again by itself");
  }

  /** @param {number} waited_ms  since something came from vergence */
  waits(waited_ms) {
    if (waited_ms > SILENT_MS && this.runs) this.mark("no answer", "plain", `nothing has come from vergence for ${(waited_ms / 1000).toFixed(0)} s`);
  }

  /** @param {Status} status */
  status({ time, paused, speed, measured, outcome, preparing }) {
    this.paused = paused ?? false;
    this.runs = !paused && !outcome && !preparing && !this.recording;
    this.time.textContent = time === undefined ? "" : `${time.toFixed(2)} s`;
    this.pause.textContent = paused ? "Resume" : "Pause";
    if (document.activeElement !== this.speed) this.speed.value = String(speed);
    this.measured.textContent = paused || measured === undefined ? "" : `${measured.toFixed(2)} × real time`;
    if (this.recording && !this.sliding) this.seek.value = String(time ?? 0);
    const over = outcome && !this.recording;
    this.pause.disabled = this.step.disabled = this.stop.disabled = Boolean(over);
    if (over) this.measured.textContent = "";
    if (outcome) this.mark(outcome.kind, outcome.succeeded ? "good" : "bad", `after ${outcome.time.toFixed(2)} s: ${outcome.reason}${over && !this.robot ? ". Restart begins again." : ""}`);
    else if (preparing) this.mark("preparing", "plain", "Loading kernels. The first time on a computer they are compiled, which takes a minute or two.");
    else this.mark(paused ? "paused" : "running", paused ? "plain" : "good", "");
  }

  /**
   * @param {string} word
   * @param {string} kind
   * @param {string} reason
   */
  mark(word, kind, reason) {
    this.badge.textContent = word;
    this.badge.className = `badge ${kind}`;
    this.reason.textContent = reason;
  }
}
