// What happened, with its time.
export class Log {
  constructor(list) { this.list = list; }

  begin() { this.list.replaceChildren(); }

  add(events) {
    const near = this.list.scrollTop + this.list.clientHeight > this.list.scrollHeight - 30;
    for (const { time, name, text } of events) {
      const line = document.createElement("li");
      const when = document.createElement("time");
      const what = document.createElement("span");
      const kind = document.createElement("b");
      when.textContent = `${time.toFixed(2)} s`;
      kind.textContent = name;
      what.append(kind, ` · ${text}`);
      line.append(when, what);
      this.list.append(line);
    }
    if (events.length && near) this.list.scrollTop = this.list.scrollHeight;
  }
}
