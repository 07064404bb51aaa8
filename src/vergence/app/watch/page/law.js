// The law: which one, and its numbers; a number has a field, and a slider over up to three decades.

import { element, first } from "./dom.js";

/** @import { Ask, KnobAbout, LawStatus } from "./protocol.js" */
/** @typedef {(value: unknown) => void} Turn */
/** @typedef {{ field: HTMLInputElement | HTMLSelectElement, beside?: HTMLElement[], below?: HTMLElement[] }} Made */

const DECADES = 1.5; // to either side of where it was when the law was chosen
const STEP = 0.05; // decades by which an arrow key turns a number
/** @type {Record<string, number>} */
const ARROWS = { ArrowUp: STEP, ArrowDown: -STEP };

export class Law {
  /**
   * @param {HTMLElement} section
   * @param {Ask} ask
   */
  constructor(section, ask) {
    this.section = section;
    this.choice = first(section, "select");
    this.knobs = element("knobs");
    this.settings = element("settings");
    this.changed = element("law-changed");
    this.ask = ask;
    this.text = "";
    /** @type {LawStatus | undefined} */
    this.law = undefined;
    /** @type {string | null} */
    this.shown = null;
    /** @type {Map<string, (value: any, always?: boolean) => void>} */
    this.fields = new Map(); // that show a value: always, or unless somebody is about to change it
    /** @type {Map<string, (value: any) => void>} */
    this.undos = new Map();
    element("own-law").addEventListener("click", () => {
      this.shown = null;
      ask({ do: "own law" });
    });
    this.choice.addEventListener("change", () => {
      this.shown = null;
      ask({ do: "law", name: this.choice.value });
    });
  }

  /** @param {LawStatus} [law] */
  status(law) {
    this.section.hidden = !law?.choices.length; // a task may go by no law
    if (!law) return;
    const text = JSON.stringify(law);
    if (text === this.text) return;
    this.text = text;
    this.law = law;
    const names = [law.choice, ...law.knobs.map(({ key }) => key)].join();
    if (names !== this.shown) this.build(law);
    this.shown = names;
    for (const knob of law.knobs) {
      this.fields.get(knob.key)?.(knob.value);
      this.undos.get(knob.key)?.(knob.value);
    }
    this.changed.hidden = !law.settings.length;
    this.settings.replaceChildren(...command(law.settings));
  }

  /** Shows the law as it is, where what was asked for was not done: refused, or asked while not connected. */
  restore() {
    if (!this.law) return;
    this.choice.value = this.law.choice;
    for (const { key, value } of this.law.knobs) this.fields.get(key)?.(value, true);
  }

  /** @param {LawStatus} law */
  build(law) {
    this.choice.replaceChildren(...law.choices.map((name) => new Option(name, name)));
    this.choice.value = law.choice;
    this.fields = new Map();
    this.knobs.replaceChildren(...law.knobs.map((knob) => this.knob(knob)));
  }

  /** @param {KnobAbout} knob */
  knob(knob) {
    const row = document.createElement("div");
    row.className = `knob ${knob.kind}`;
    row.dataset.key = knob.key;
    const name = document.createElement("label");
    name.textContent = knob.label;
    /** @type {Turn} */
    const turn = (value) => this.ask({ do: "knob", key: knob.key, value });
    const make = { number: this.number, choice: this.choices, switch: this.flag }[knob.kind];
    const { field, beside = [], below = [] } = make.call(this, knob, turn);
    field.id = name.htmlFor = `knob ${knob.key}`.replace(" ", "-");
    field.ariaDescription = [knob.meaning, knob.kind === "number" ? range(knob) : ""].filter(Boolean).join("; ");
    const meaning = text("meaning", knob.meaning);
    meaning.ariaHidden = "true"; // it is in the field's description
    row.append(name, field, ...beside, this.undo(knob, turn), ...below, meaning);
    return row;
  }

  /**
   * A button back to the value that the law has by itself; unseen while it has it.
   * @param {KnobAbout} knob
   * @param {Turn} turn
   */
  undo(knob, turn) {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "undo";
    button.textContent = "↺";
    button.title = `back to ${typeof knob.own === "number" ? short(knob.own) : knob.own}`;
    button.ariaLabel = `${knob.label}: ${button.title}`;
    button.addEventListener("click", () => turn(knob.own));
    this.undos.set(knob.key, (value) => { button.style.visibility = value === knob.own ? "hidden" : "visible"; });
    return button;
  }

  /**
   * A field and a slider; the arrow keys turn the field as they turn the slider, by a share.
   * @param {KnobAbout} knob
   * @param {Turn} turn
   * @returns {Made}
   */
  number(knob, turn) {
    const field = document.createElement("input");
    field.type = "number";
    field.step = "any";
    [field.min, field.max] = [knob.low, knob.high].map((end) => String(end ?? ""));
    const unit = text("soft", knob.unit), ends = text("range", range(knob));
    ends.ariaHidden = "true"; // it is in the field's description
    field.addEventListener("change", () => (field.value === "" ? this.restore() : turn(Number(field.value))));
    field.addEventListener("keydown", (event) => {
      if (!(event.key in ARROWS)) return;
      event.preventDefault();
      const next = rounded(Number(field.value) * 10 ** ARROWS[event.key]);
      field.value = short(Math.min(next, highest(knob)));
      turn(Number(field.value));
    });
    /** @type {number} */
    const middle = knob.value;
    if (!(middle > 0)) {
      this.fields.set(knob.key, (value, always) => { if (always || !focused(field)) field.value = short(value); });
      return { field, beside: [unit], below: [ends] };
    }
    const slider = document.createElement("input");
    slider.type = "range";
    slider.min = String(-DECADES);
    slider.max = String(Math.min(DECADES, Math.log10(highest(knob) / middle)));
    slider.step = "0.01";
    slider.ariaLabel = knob.label;
    const chosen = () => rounded(Math.min(middle * 10 ** Number(slider.value), highest(knob)));
    /** @param {number} value */
    const say = (value) => { slider.ariaValueText = `${short(value)} ${knob.unit}`.trim(); };
    slider.addEventListener("input", () => { field.value = short(chosen()); say(chosen()); });
    slider.addEventListener("change", () => turn(chosen()));
    this.fields.set(knob.key, (value, always) => {
      if (always || !focused(field)) field.value = short(value);
      if (!always && focused(slider)) return;
      slider.value = String(Math.log10(Math.max(value, 1e-300) / middle));
      say(value);
    });
    return { field, beside: [unit], below: [slider, ends] };
  }

  /**
   * @param {KnobAbout} knob
   * @param {Turn} turn
   * @returns {Made}
   */
  choices(knob, turn) {
    const field = document.createElement("select");
    field.className = "wide";
    field.append(...(knob.choices ?? []).map((name) => new Option(name.replaceAll("_", " "), name)));
    field.addEventListener("change", () => turn(field.value));
    this.fields.set(knob.key, (value) => { field.value = value; });
    return { field };
  }

  /**
   * @param {KnobAbout} knob
   * @param {Turn} turn
   * @returns {Made}
   */
  flag(knob, turn) {
    const field = document.createElement("input");
    field.type = "checkbox";
    field.addEventListener("change", () => turn(field.checked));
    this.fields.set(knob.key, (value) => { field.checked = value; });
    return { field };
  }
}

/**
 * Says how to run the cell with what was changed.
 * @param {string[]} settings
 */
function command(settings) {
  if (!settings.length) return [];
  const code = document.createElement("code");
  code.textContent = settings.map((setting) => `--set '${setting}'`).join(" ");
  return ["The same from the command line: ", code];
}

/**
 * Says between which values a number may be.
 * @param {KnobAbout} knob
 */
function range({ low, high, low_open, high_open, unit }) {
  const from = low === undefined ? "" : `${low_open ? "above" : "from"} ${short(low)}`;
  const to = high === undefined ? "" : `${high_open ? "below" : "up to"} ${short(high)}`;
  return [[from, to].filter(Boolean).join(", "), unit].filter(Boolean).join(" ");
}

/**
 * The highest value of a number's range that a slider gives.
 * @param {KnobAbout} knob
 */
function highest({ high = Infinity, high_open }) { return high_open ? 0.99 * high : high; }

/**
 * @param {string} kind
 * @param {string} words
 */
function text(kind, words) {
  const span = document.createElement("span");
  span.className = kind;
  span.textContent = words;
  return span;
}

/** @param {HTMLElement} field */
function focused(field) { return document.activeElement === field; }

/**
 * A number with three digits.
 * @param {number} value
 */
function rounded(value) { return Number(value.toPrecision(3)); }

/**
 * A number as briefly as it can be written.
 * @param {number} value
 */
function short(value) {
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential().replace("e+", "e") : String(value);
}
