// The page of `vergence watch`: shows what comes over the line, asks for what is clicked.

import { Law } from "./law.js";
import { Line } from "./line.js";
import { Log } from "./log.js";
import { Mouse } from "./mouse.js";
import { Pictures } from "./pictures.js";
import { Plots } from "./plots.js";
import { Scene } from "./scene.js";
import { Transport } from "./transport.js";

const element = (id) => document.getElementById(id);
const ask = (command) => line.ask(command);

const mouse = new Mouse(ask);
const transport = new Transport(ask);
const pictures = new Pictures(element("pictures"), element("legend"), mouse);
const plots = new Plots(element("plots"), { seek: (value) => ask({ do: "seek", value }) });
const scene = new Scene(element("stage"), element("scene-hint"), mouse);
const law = new Law(element("law"), ask);
const log = new Log(element("log"));
const line = new Line(hear, (open) => transport.connected(open));

function hear({ about, status, rows, events, pictures: headers }, blobs) {
  if (about) for (const part of [transport, pictures, plots, scene, log]) part.begin(about);
  if (about) hint(about);
  transport.status(status);
  scene.status(status);
  law.status(status.law);
  loose(status);
  plots.add(rows);
  plots.at(status.time);
  log.add(events);
  headers.forEach((header, i) => pictures.show(header, blobs[i]));
}

function hint({ draggable, carried_by, mode }) {
  if (mode === "recording") return;
  element("drag-hint").textContent = draggable
    ? "Drag the target with the mouse, in a picture or in space; with Shift it comes nearer or goes away. "
    : `The target is in the hand of ${carried_by}: the mouse cannot move it.`;
}

// While the mouse has stopped the target's own motion, offers to let it go on.
function loose({ held }) {
  const button = element("let-go");
  if (!held) { button?.remove(); return; }
  if (button) return;
  const fresh = document.createElement("button");
  fresh.id = "let-go";
  fresh.type = "button";
  fresh.textContent = "Let it move by itself again";
  fresh.addEventListener("click", () => ask({ do: "let go" }));
  element("drag-hint").append(fresh);
}

window.watch = { scene, pictures, plots, law, mouse }; // for those who script the page
