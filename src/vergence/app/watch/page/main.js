// The page of `vergence watch`: shows what comes over the connection, asks for what is clicked.

import { Connection } from "./connection.js";
import { element } from "./dom.js";
import { Images } from "./images.js";
import { Law } from "./law.js";
import { Log } from "./log.js";
import { Mouse } from "./mouse.js";
import { Picking } from "./picking.js";
import { Plots } from "./plots.js";
import { Scene } from "./scene.js";
import { Transport } from "./transport.js";

/** @import { About, Ask, News, Status } from "./protocol.js" */

/** @type {Ask} */
const ask = (command) => connection.ask(command);

const mouse = new Mouse(ask);
const transport = new Transport(ask);
const picking = new Picking(element("picking"), ask);
const images = new Images(element("images"), element("legend"), mouse, picking);
const plots = new Plots(element("plots"), (value) => ask({ do: "seek", value }));
const scene = new Scene(element("stage"), element("scene-hint"), mouse, ask);
const law = new Law(element("law"), ask);
const log = new Log(element("log"));
const connection = new Connection(
  hear,
  (reason) => { log.refused(reason); law.restore(); },
  connected,
);

const LOOK_MS = 1000;
let looked_ms = 0;
setInterval(() => {
  const now = performance.now(), busy = now - looked_ms > 2 * LOOK_MS; // the page itself: what came meanwhile is not heard yet
  looked_ms = now;
  if (!busy && connection.socket.readyState === WebSocket.OPEN) transport.waits(now - connection.heard_ms);
}, LOOK_MS);

/** @param {boolean} open */
function connected(open) {
  for (const part of [transport, scene]) part.connected(open);
  for (const part of [element("transport"), element("slider"), element("parts")]) part.inert = !open;
  if (open) law.restore();
}

/**
 * @param {News} news
 * @param {(Blob | null)[]} blobs
 */
function hear({ about, status, rows, events, images: headers }, blobs) {
  if (about) for (const part of [transport, picking, images, plots, scene, log]) part.begin(about);
  if (about) hint(about);
  transport.status(status);
  scene.status(status);
  law.status(status.law);
  limits(status);
  loose(status);
  plots.add(rows);
  plots.at(status.time ?? 0);
  log.add(events);
  headers.forEach((header, i) => images.show(header, blobs[i]));
}

/** @param {About} about */
function hint({ draggable, carried_by, mode }) {
  if (mode === "recording") return;
  if (mode === "robot") {
    element("drag-hint").textContent = "A real arm: the space bar stops it. The 3D view shows the arm at its measured joints and everything else as placed in the cell file.";
    return;
  }
  element("drag-hint").textContent = draggable
    ? "Drag the target in an image or in 3D, or select an image and use the arrow keys. Shift changes its distance, Alt turns it. "
    : `${carried_by} holds the target: the mouse cannot move it.`;
}

/**
 * Says which limits shape the motion at the moment.
 * @param {Status} status
 */
function limits({ limits: now }) {
  const names = (now ?? []).map(({ name, relaxed }) => (relaxed ? `${name} (relaxed)` : name));
  const words = `Limits that shape the motion now: ${names.join(", ") || "none"}`;
  const line = element("limits");
  if (line.textContent !== words) line.textContent = words;
}

/**
 * While the mouse has stopped the target's own motion, offers to let it go on; after the run nothing moves.
 * @param {Status} status
 */
function loose({ held, outcome }) {
  element("drag-hint").hidden = Boolean(outcome);
  const button = document.getElementById("let-go");
  if (!held) { button?.remove(); return; }
  if (button) return;
  const fresh = document.createElement("button");
  fresh.id = "let-go";
  fresh.type = "button";
  fresh.textContent = "Let it move by itself again";
  fresh.addEventListener("click", () => ask({ do: "let go" }));
  element("drag-hint").append(fresh);
}

Object.assign(window, { watch: { scene, images, picking, plots, law, mouse } }); // for those who script the page
