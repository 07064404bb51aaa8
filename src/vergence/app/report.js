// One instant of the run, shown everywhere: a line in every chart over time, an image in every film.

/** @typedef {(time: number) => void} Show shows an instant, s */

/** @type {Show[]} */
const shown = [];

/** @type {Show} */
function show(time) {
  for (const one of shown) one(time);
}

/**
 * Returns the first element of a kind in another.
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Element} parent
 * @param {Tag} tag
 */
function part(parent, tag) {
  const found = parent.querySelector(tag);
  if (!found) throw new Error(`there is no ${tag}`);
  return found;
}

/**
 * Moves a chart's line to the instant that is shown, and shows the instant under the pointer.
 * @param {SVGSVGElement} chart
 */
function follow(chart) {
  const [end, left, right] = ["time", "left", "right"].map((key) => Number(chart.dataset[key]));
  const cursor = chart.querySelector(".cursor");
  const width = chart.viewBox.baseVal.width;
  shown.push((time) => {
    const x = left + (time / end) * (right - left);
    cursor?.setAttribute("transform", `translate(${x} 0)`);
    cursor?.classList.add("on");
  });
  chart.addEventListener("pointermove", (event) => {
    const box = chart.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * width;
    const time = ((x - left) / (right - left)) * end;
    if (time >= 0 && time <= end) show(time);
  });
}

/**
 * Plays a film in the run's own time; its slider shows any instant of it.
 * @param {Element} film
 */
function play(film) {
  /** @type {{times: number[], jpegs: string[]}} */
  const { times, jpegs } = JSON.parse(part(film, "script").textContent ?? "");
  const [image, button] = [part(film, "img"), part(film, "button")];
  const [slider, clock] = [part(film, "input"), part(film, "output")];
  let now = -1;
  let playing = 0; // number of the animation frame that is asked for; 0 while it is halted

  shown.push((time) => {
    const next = times.findIndex((one) => one > time);
    const number = next < 0 ? times.length - 1 : Math.max(next - 1, 0);
    if (number === now) return;
    now = number;
    image.src = `data:image/jpeg;base64,${jpegs[number]}`;
    slider.value = String(number);
    clock.textContent = `${times[number].toFixed(2)} s`;
  });

  function halt() {
    cancelAnimationFrame(playing);
    playing = 0;
    button.textContent = "Play";
  }

  slider.addEventListener("input", () => {
    halt();
    show(times[Number(slider.value)]);
  });
  button.addEventListener("click", () => {
    if (playing) {
      halt();
      return;
    }
    const from = now < 0 || now === times.length - 1 ? times[0] : times[now];
    const began = performance.now();
    const step = (/** @type {number} */ instant) => {
      const time = from + Math.max(instant - began, 0) / 1000;
      show(Math.min(time, times[times.length - 1]));
      if (time < times[times.length - 1]) playing = requestAnimationFrame(step);
      else halt();
    };
    button.textContent = "Pause";
    playing = requestAnimationFrame(step);
  });
}

for (const chart of document.querySelectorAll("svg.chart[data-time]")) {
  if (chart instanceof SVGSVGElement) follow(chart);
}
for (const film of document.querySelectorAll(".film")) play(film);
