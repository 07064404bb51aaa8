// The law: which one, and its numbers; a number has a field, and a slider over three decades.

import { element, first } from "./dom.js";

/** @import { Ask, KnobAbout, LawStatus } from "./protocol.js" */
/** @typedef {(value: unknown) => void} Turn */

const DECADES = 1.5; // to either side of where it was when the law was chosen

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
    this.ask = ask;
    this.text = "";
    /** @type {string | null} */
    this.shown = null;
    /** @type {Map<string, (value: any) => void>} */
    this.fields = new Map();
    /** @type {Map<string, (value: any) => void>} */
    this.undos = new Map();
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
    const names = [law.choice, ...law.knobs.map(({ key }) => key)].join();
    if (names !== this.shown) this.build(law);
    this.shown = names;
    for (const knob of law.knobs) {
      this.fields.get(knob.key)?.(knob.value);
      this.undos.get(knob.key)?.(knob.value);
    }
    this.settings.replaceChildren(...command(law.settings));
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
    const row = document.createElement("label");
    row.className = `knob ${knob.kind}`;
    row.dataset.key = knob.key;
    const name = document.createElement("span");
    name.textContent = knob.label;
    /** @type {Turn} */
    const turn = (value) => this.ask({ do: "knob", key: knob.key, value });
    const make = { number: this.number, choice: this.choices, switch: this.flag }[knob.kind];
    const [field, ...rest] = make.call(this, knob, turn);
    const slider = rest.at(-1)?.matches("[type=range]") ? rest.splice(-1) : [];
    row.append(name, field, ...rest, this.undo(knob, turn), ...slider);
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
    button.addEventListener("click", (event) => { event.preventDefault(); turn(knob.own); });
    this.undos.set(knob.key, (value) => { button.style.visibility = value === knob.own ? "hidden" : "visible"; });
    return button;
  }

  /**
   * @param {KnobAbout} knob
   * @param {Turn} turn
   * @returns {HTMLElement[]}
   */
  number(knob, turn) {
    const field = document.createElement("input");
    field.type = "number";
    field.step = "any";
    field.title = range(knob);
    const unit = document.createElement("span");
    unit.className = "soft";
    unit.textContent = knob.unit;
    field.addEventListener("change", () => field.value !== "" && turn(Number(field.value)));
    const slider = document.createElement("input");
    slider.type = "range";
    slider.min = String(-DECADES);
    slider.max = String(DECADES);
    slider.step = "0.01";
    slider.ariaLabel = knob.label;
    /** @type {number} */
    const middle = knob.value;
    slider.disabled = middle <= 0;
    const chosen = () => Number((middle * 10 ** Number(slider.value)).toPrecision(3));
    slider.addEventListener("input", () => { field.value = short(chosen()); });
    slider.addEventListener("change", () => turn(chosen()));
    this.fields.set(knob.key, (value) => {
      if (document.activeElement !== field) field.value = short(value);
      if (middle > 0 && document.activeElement !== slider) slider.value = String(Math.log10(Math.max(value, 1e-300) / middle));
    });
    return middle > 0 ? [field, unit, slider] : [field, unit];
  }

  /**
   * @param {KnobAbout} knob
   * @param {Turn} turn
   * @returns {HTMLElement[]}
   */
  choices(knob, turn) {
    const field = document.createElement("select");
    field.className = "wide";
    field.append(...(knob.choices ?? []).map((name) => new Option(name.replaceAll("_", " "), name)));
    field.addEventListener("change", () => turn(field.value));
    this.fields.set(knob.key, (value) => { field.value = value; });
    return [field];
  }

  /**
   * @param {KnobAbout} knob
   * @param {Turn} turn
   * @returns {HTMLElement[]}
   */
  flag(knob, turn) {
    const field = document.createElement("input");
    field.type = "checkbox";
    field.addEventListener("change", () => turn(field.checked));
    this.fields.set(knob.key, (value) => { field.checked = value; });
    return [field];
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
function range({ low, high, unit }) {
  const ends = [low !== undefined ? `from ${short(low)}` : "", high !== undefined ? `up to ${short(high)}` : ""];
  return [...ends, unit].filter(Boolean).join(" ");
}

/**
 * A number as briefly as it can be written.
 * @param {number} value
 */
function short(value) {
  return value !== 0 && Math.abs(value) < 1e-3 ? value.toExponential() : String(value);
}
