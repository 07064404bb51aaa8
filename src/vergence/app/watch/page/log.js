// What happened, with its time.

/** @import { Event } from "./protocol.js" */

const MOST = 1000; // lines

export class Log {
  /** @param {HTMLElement} list */
  constructor(list) { this.list = list; }

  begin() { this.list.replaceChildren(); }

  /** @param {Event[]} events */
  add(events) {
    const near = this.list.scrollTop + this.list.clientHeight > this.list.scrollHeight - 30;
    for (const { time, name, text } of events) this.line(`${time.toFixed(2)} s`, name, text);
    if (events.length && near) this.list.scrollTop = this.list.scrollHeight;
  }

  /** @param {string} reason  why vergence did not do what this page asked */
  refused(reason) {
    this.line("", "refused", reason);
    this.list.scrollTop = this.list.scrollHeight;
  }

  /**
   * @param {string} time
   * @param {string} name
   * @param {string} text
   */
  line(time, name, text) {
    const line = document.createElement("li");
    const when = document.createElement("time");
    const what = document.createElement("span");
    const kind = document.createElement("b");
    when.textContent = time;
    kind.textContent = name;
    what.append(kind, ` · ${text}`);
    line.append(when, what);
    this.list.append(line);
    if (this.list.children.length > MOST) this.list.children[0].remove();
  }
}
