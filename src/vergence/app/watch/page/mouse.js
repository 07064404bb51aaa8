// The mouse's hold on the target.
export class Mouse {
  constructor(ask) {
    this.ask = ask;
    this.view = null;
    this.next = null;
  }

  get holds() { return this.view !== null; }

  // Takes the target in a view: a camera's picture, u and v in px; or space (""), normalized.
  grab(view, u, v) {
    this.view = view;
    this.ask({ do: "grab", view, u, v });
  }

  // Moves it; at most once a frame, a mouse reports more often than anyone can use.
  move(view, u, v, along) {
    if (this.view !== view) return;
    if (!this.next) requestAnimationFrame(() => this.send());
    this.next = { do: "move", view, u, v, along };
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
