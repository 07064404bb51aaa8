// Lets the keyboard scroll what is wider than a narrow page, and shows that there is more of it.

{
  /** @param {Element} part */
  const look = (part) => {
    const hidden = part.scrollWidth - part.clientWidth;
    if (hidden > 0) part.setAttribute("tabindex", "0");
    else part.removeAttribute("tabindex");
    part.classList.toggle("more", part.scrollLeft < hidden - 1);
  };
  const sizes = new ResizeObserver((entries) => {
    for (const { target } of entries) look(target);
  });
  for (const part of document.querySelectorAll("figure, section")) {
    sizes.observe(part);
    part.addEventListener("scroll", () => look(part));
  }
}
