// The line to vergence: messages come as a JSON text with JPEG pictures behind it.

const decoder = new TextDecoder();

export class Line {
  constructor(hear, status) {
    this.hear = hear;
    this.status = status;
    this.tries = 0;
    this.open();
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    this.socket = new WebSocket(`${scheme}://${location.host}/live`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => { this.tries = 0; this.status(true); };
    this.socket.onmessage = (message) => {
      this.hear(...unpack(message.data));
      setTimeout(() => this.ask({ do: "more" })); // after what the mouse and the screen wait for
    };
    this.socket.onclose = () => {
      this.status(false);
      setTimeout(() => this.open(), Math.min(500 * 2 ** this.tries++, 5000));
    };
  }

  ask(command) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
  }
}

// Returns the news, and a picture (Blob, or null) for each of its headers.
export function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const news = JSON.parse(decoder.decode(new Uint8Array(buffer, 4, length)));
  let start = 4 + length;
  const blobs = news.pictures.map(({ bytes }) => {
    const part = new Uint8Array(buffer, start, bytes);
    start += bytes;
    return bytes ? new Blob([part], { type: "image/jpeg" }) : null;
  });
  return [news, blobs];
}
