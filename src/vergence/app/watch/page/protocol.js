// What goes over the connection to vergence, and its types.

/**
 * @typedef {[number, number]} Place  u, v in pixels whose centres are at integers; or x, y
 * @typedef {[number, ...(number | null)[][]]} Row  time, s, then the values of each plot
 *
 * @typedef {object} PlotAbout
 * @property {string} key
 * @property {string} title
 * @property {string} unit
 * @property {string[]} series
 * @property {number | null} low  of the axis; null where the curves decide
 * @property {number | null} high
 * @property {number[]} limits
 *
 * @typedef {{ name: string, width: number, height: number }} CameraAbout
 *
 * @typedef {object} About  what runs
 * @property {"live" | "robot" | "recording"} mode
 * @property {string} cell
 * @property {CameraAbout[]} cameras
 * @property {PlotAbout[]} plots
 * @property {boolean} scene
 * @property {boolean} draggable
 * @property {boolean} truth  whether it is known where the points truly are
 * @property {number} [duration]  of a recording, s
 * @property {string} [no_scene]
 * @property {string | null} [carried_by]
 * @property {boolean} [images]  whether cameras deliver any
 * @property {string} [task_camera]
 *
 * @typedef {object} KnobAbout
 * @property {string} key
 * @property {string} label
 * @property {string} unit
 * @property {string} meaning
 * @property {"number" | "choice" | "switch"} kind
 * @property {any} value
 * @property {any} own  what the law has by itself
 * @property {number} [low]  of a number's range
 * @property {number} [high]
 * @property {boolean} [low_open]  whether the end itself is outside the range
 * @property {boolean} [high_open]
 * @property {string[]} [choices]
 *
 * @typedef {{ choices: string[], choice: string, knobs: KnobAbout[], settings: string[] }} LawStatus
 *
 * @typedef {object} Status
 * @property {number} [time]  s
 * @property {boolean} [paused]
 * @property {number} [speed]
 * @property {number} [measured]
 * @property {boolean} [held]
 * @property {LawStatus} [law]
 * @property {boolean} [preparing]  kernels are loaded or compiled; nothing moves yet
 * @property {{ name: string, relaxed: boolean }[]} [limits]  that shape the motion now
 * @property {Place[] | null} [outline]  of the target in the view in three dimensions, normalized
 * @property {number} [fovy]
 * @property {{ kind: string, reason: string, time: number, succeeded: boolean } | null} [outcome]
 *
 * @typedef {object} Marks  what was measured of one target
 * @property {Place[]} [desired]
 * @property {Place[]} [true]
 * @property {Place[]} [points]
 * @property {Place[]} [predicted]
 * @property {Place[]} [half]
 * @property {{ points: number[], closed: boolean }[]} [curves]  which points make one
 * @property {boolean[]} [found]
 * @property {boolean[]} [asked]
 * @property {string[]} [reasons]
 *
 * @typedef {object} ImageAbout
 * @property {string} camera
 * @property {number} time
 * @property {number} bytes
 * @property {Place[]} [outline]
 * @property {Marks[]} [others]  of the targets that the task is not about
 *
 * @typedef {ImageAbout & Marks} ImageHeader
 *
 * @typedef {{ time: number, name: string, text: string }} Event
 *
 * @typedef {object} News
 * @property {Status} status
 * @property {Row[]} rows
 * @property {Event[]} events
 * @property {ImageHeader[]} images
 * @property {About} [about]
 *
 * @typedef {{ do: string, [key: string]: unknown }} Command
 * @typedef {(command: Command) => void} Ask
 */

const decoder = new TextDecoder();

/**
 * Returns the news, and an image for each of its headers; null where there is none.
 * @param {ArrayBuffer} buffer
 * @returns {[News, (Blob | null)[]]}
 */
export function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  /** @type {News} */
  const news = JSON.parse(decoder.decode(new Uint8Array(buffer, 4, length)));
  let start = 4 + length;
  const blobs = news.images.map(({ bytes }) => {
    const part = new Uint8Array(buffer, start, bytes);
    start += bytes;
    return bytes ? new Blob([part], { type: "image/jpeg" }) : null;
  });
  return [news, blobs];
}
