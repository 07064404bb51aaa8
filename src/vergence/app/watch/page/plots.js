// Curves over time, drawn by hand: an axis with round numbers, units in the title, the legend above.

import { context_of } from "./dom.js";

/** @import { About, PlotAbout, Row } from "./protocol.js" */
/** @typedef {(number | null)[]} Values */
/** @typedef {(value: number) => number} Scale */

// Okabe and Ito's hues, told apart by colour-blind readers too; one for light ground, one for dark.
const LIGHT = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#6b4fa0", "#7f8c8d", "#a0522d"];
const DARK = ["#4ea8e8", "#f08a3c", "#2fc79b", "#e59cc4", "#e8c24a", "#8fd3ff", "#a993e0", "#aeb9c4", "#cf8a66"];
const MARGIN = { left: 46, right: 10, top: 6, bottom: 18 };
const dark = window.matchMedia("(prefers-color-scheme: dark)");

export class Plots {
  /**
   * @param {HTMLElement} root
   * @param {(time: number) => void} seek
   */
  constructor(root, seek) {
    this.root = root;
    this.seek = seek;
    /** @type {Plot[]} */
    this.plots = [];
    /** @type {Row[]} */
    this.rows = [];
    /** @type {number | null} */
    this.whole = null; // s, of a recording: all of it is shown, with a cursor
    /** @type {number | null} */
    this.cursor = null;
    this.waiting = false;
    this.span = 20; // s shown while it runs
    const redraw = () => this.draw();
    new ResizeObserver(redraw).observe(root);
    dark.addEventListener("change", () => { this.plots.forEach((plot) => plot.legend()); redraw(); });
  }

  /** @param {About} about */
  begin(about) {
    this.rows = [];
    this.whole = about.duration ?? null;
    this.cursor = null;
    this.root.replaceChildren();
    this.plots = about.plots.map((plot, index) => new Plot(this, plot, index + 1));
  }

  /** @param {Row[]} rows */
  add(rows) {
    if (!rows.length) return;
    this.rows.push(...rows);
    if (this.whole === null) {
      const oldest = rows[rows.length - 1][0] - this.span - 1;
      let first = 0;
      while (this.rows[first][0] < oldest) first++;
      this.rows.splice(0, first);
    }
    this.draw();
  }

  /** @param {number} time */
  at(time) {
    if (this.whole === null || time === this.cursor) return;
    this.cursor = time;
    this.draw();
  }

  get range() {
    if (this.whole !== null) return [0, Math.max(this.whole, 1e-3)];
    const last = this.rows.at(-1)?.[0] ?? 0;
    return [Math.max(0, last - this.span), Math.max(this.span, last)];
  }

  // Draws all, once a frame at most.
  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      for (const plot of this.plots) plot.draw();
    });
  }
}

class Plot {
  /**
   * @param {Plots} plots
   * @param {PlotAbout} about
   * @param {number} column  of its values in a row
   */
  constructor(plots, about, column) {
    this.plots = plots;
    this.about = about;
    this.column = column;
    this.value = document.createElement("output");
    this.value.style.marginLeft = "auto";
    const figure = document.createElement("figure");
    figure.className = "plot";
    figure.dataset.plot = about.key;
    this.caption = document.createElement("figcaption");
    this.canvas = document.createElement("canvas");
    figure.append(this.caption, this.canvas);
    plots.root.append(figure);
    this.legend();
    this.canvas.addEventListener("pointerdown", (event) => {
      if (plots.whole === null) return;
      const [from, to] = plots.range;
      const box = this.canvas.getBoundingClientRect();
      const share = (event.clientX - box.left - MARGIN.left) / (box.width - MARGIN.left - MARGIN.right);
      plots.seek(from + Math.min(Math.max(share, 0), 1) * (to - from));
    });
  }

  /**
   * @param {Row} row
   * @returns {Values}
   */
  values(row) { return /** @type {Values} */ (row[this.column]); }

  /** @param {number} index */
  ink(index) {
    const inks = dark.matches ? DARK : LIGHT;
    return inks[index % inks.length];
  }

  legend() {
    const { title, unit, series } = this.about;
    const name = document.createElement("b");
    name.textContent = title;
    const names = series.length > 1 ? series.map((text, index) => {
      const entry = document.createElement("span");
      const line = document.createElement("i");
      line.style.background = this.ink(index);
      entry.append(line, text);
      return entry;
    }) : [];
    this.caption.replaceChildren(name, ` (${unit}) `, ...names, this.value);
  }

  /**
   * Lowest and highest value to show: as told, else what the curves need, with round ends.
   * @param {Row[]} rows
   */
  bounds(rows) {
    let { low, high } = this.about;
    let [least, most] = [Infinity, -Infinity];
    if (low === null || high === null) {
      for (const row of rows) for (const value of this.values(row)) {
        if (value === null) continue;
        if (value < least) least = value;
        if (value > most) most = value;
      }
      if (least > most) [least, most] = [0, 1];
    }
    low ??= least;
    high ??= most > low ? most + 0.06 * (most - low) : low + 1;
    return [low, high];
  }

  draw() {
    const { canvas, plots } = this;
    const unit = window.devicePixelRatio;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width) return;
    canvas.width = Math.round(width * unit);
    canvas.height = Math.round(height * unit);
    const context = context_of(canvas);
    context.scale(unit, unit);
    const [from, to] = plots.range;
    const rows = plots.rows.filter((row) => row[0] >= from - 0.5);
    const [low, high] = this.bounds(rows);
    /** @type {Scale} */
    const x = (time) => MARGIN.left + (time - from) / (to - from) * (width - MARGIN.left - MARGIN.right);
    /** @type {Scale} */
    const y = (value) => height - MARGIN.bottom - (value - low) / (high - low) * (height - MARGIN.top - MARGIN.bottom);
    const style = getComputedStyle(document.documentElement);
    /** @param {string} name */
    const colour = (name) => style.getPropertyValue(name).trim();
    context.font = "11px system-ui, sans-serif";
    context.lineWidth = 1;
    grid(context, { x, y, from, to, low, high, width, height, colour });
    context.save();
    context.beginPath();
    context.rect(MARGIN.left, MARGIN.top - 2, width - MARGIN.left - MARGIN.right, height - MARGIN.top - MARGIN.bottom + 4);
    context.clip();
    for (const limit of this.about.limits) line(context, colour("--limit"), [[MARGIN.left, y(limit)], [width, y(limit)]]);
    context.lineWidth = 1.6;
    context.lineJoin = "round";
    this.about.series.forEach((_, index) => this.curve(context, rows, index, x, y));
    if (plots.cursor !== null) line(context, colour("--soft"), [[x(plots.cursor), 0], [x(plots.cursor), height]]);
    context.restore();
    this.tell(rows);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Row[]} rows
   * @param {number} index
   * @param {Scale} x
   * @param {Scale} y
   */
  curve(context, rows, index, x, y) {
    context.strokeStyle = this.ink(index);
    context.beginPath();
    let pen = false;
    for (const row of rows) {
      const value = this.values(row)[index] ?? null;
      if (value === null) { if (this.values(row).length) pen = false; continue; }
      pen ? context.lineTo(x(row[0]), y(value)) : context.moveTo(x(row[0]), y(value));
      pen = true;
    }
    context.stroke();
  }

  /**
   * Writes the value at the cursor, or the newest, and whose it is: of several the largest.
   * @param {Row[]} rows
   */
  tell(rows) {
    const { cursor } = this.plots;
    const known = rows.filter((row) => this.values(row).some((value) => value !== null));
    const row = cursor === null ? known.at(-1) : known.findLast((each) => each[0] <= cursor + 1e-9);
    const values = row ? this.values(row) : [];
    let most = -1;
    values.forEach((value, j) => {
      if (value !== null && (most < 0 || Math.abs(value) > Math.abs(values[most] ?? 0))) most = j;
    });
    const whose = values.length > 1 ? this.about.series[most] : "";
    this.value.textContent = most < 0 ? "" : [whose, values[most]?.toPrecision(3).replace("-", "−")].filter(Boolean).join(": ");
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {string} style
 * @param {number[][]} places
 */
function line(context, style, places) {
  context.strokeStyle = style;
  context.beginPath();
  places.forEach(([x, y]) => context.lineTo(x, y));
  context.stroke();
}

/**
 * @typedef {object} Axes
 * @property {Scale} x
 * @property {Scale} y
 * @property {number} from
 * @property {number} to
 * @property {number} low
 * @property {number} high
 * @property {number} width
 * @property {number} height
 * @property {(name: string) => string} colour
 */

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Axes} axes
 */
function grid(context, { x, y, from, to, low, high, width, height, colour }) {
  context.fillStyle = colour("--soft");
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const value of ticks(low, high, 4)) {
    line(context, colour("--grid"), [[MARGIN.left, y(value)], [width - MARGIN.right, y(value)]]);
    context.fillText(label(value, low, high), MARGIN.left - 6, y(value));
  }
  context.textAlign = "center";
  context.textBaseline = "alphabetic";
  for (const time of ticks(from, to, Math.max(2, Math.floor(width / 90)))) {
    const place = x(time);
    if (place > width - 30) continue;
    context.fillText(label(time, from, to), place, height - 4);
  }
  context.textAlign = "right";
  context.fillText("s", width - MARGIN.right, height - 4);
}

/**
 * Round numbers between two ends.
 * @param {number} low
 * @param {number} high
 * @param {number} count
 */
function ticks(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough * 0.999) ?? 10 * power;
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return found;
}

/**
 * @param {number} value
 * @param {number} low
 * @param {number} high
 */
function label(value, low, high) {
  const size = Math.max(Math.abs(low), Math.abs(high));
  if (value === 0) return "0";
  const plain = size >= 1e-3 && size < 1e5;
  return (plain ? String(Number(value.toPrecision(6))) : value.toExponential(1)).replaceAll("-", "−");
}
