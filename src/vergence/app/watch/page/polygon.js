/** @import { Place } from "./protocol.js" */

/**
 * Whether a place lies inside a polygon.
 * @param {Place} place
 * @param {Place[]} corners
 */
export function inside([x, y], corners) {
  let odd = false;
  corners.forEach(([ax, ay], i) => {
    const [bx, by] = corners[(i + 1) % corners.length];
    if ((ay > y) !== (by > y) && x < ax + (y - ay) * (bx - ax) / (by - ay)) odd = !odd;
  });
  return odd;
}
