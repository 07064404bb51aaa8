// The connection to vergence: news come as binary messages, refusals of what was asked as text.

import { unpack } from "./protocol.js";

/** @import { Command, News } from "./protocol.js" */

export class Connection {
  /**
   * @param {(news: News, blobs: (Blob | null)[]) => void} hear
   * @param {(reason: string) => void} refused
   * @param {(open: boolean) => void} status
   */
  constructor(hear, refused, status) {
    this.hear = hear;
    this.refused = refused;
    this.status = status;
    this.tries = 0;
    this.heard_ms = 0; // when something came last
    this.socket = this.open();
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/live`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { this.tries = 0; this.status(true); };
    socket.onmessage = ({ data }) => {
      this.heard_ms = performance.now();
      if (typeof data === "string") return this.refused(JSON.parse(data).refused);
      this.hear(...unpack(data));
      setTimeout(() => this.ask({ do: "more" })); // after what the mouse and the screen wait for
    };
    socket.onclose = () => {
      this.status(false);
      setTimeout(() => { this.socket = this.open(); }, Math.min(500 * 2 ** this.tries++, 5000));
    };
    return socket;
  }

  /** @param {Command} command */
  ask(command) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
  }
}
