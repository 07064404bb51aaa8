// What every part of the page does with elements.

/**
 * Returns an element of the page by its id.
 * @param {string} id
 */
export function element(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no element ${id}`);
  return found;
}

/**
 * Returns the first element of a kind in another.
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {ParentNode} parent
 * @param {Tag} tag
 */
export function first(parent, tag) {
  const found = parent.querySelector(tag);
  if (!found) throw new Error(`there is no ${tag}`);
  return found;
}

/**
 * Returns what draws on a canvas.
 * @param {HTMLCanvasElement} canvas
 */
export function context_of(canvas) {
  const context = canvas.getContext("2d");
  if (!context) throw new Error("this browser draws on no canvas");
  return context;
}
