// Lets the keyboard scroll a figure while the page is narrower than its drawing.

{
  const sizes = new ResizeObserver((entries) => {
    for (const { target: figure } of entries) {
      if (figure.scrollWidth > figure.clientWidth) figure.setAttribute("tabindex", "0");
      else figure.removeAttribute("tabindex");
    }
  });
  for (const figure of document.querySelectorAll("figure")) sizes.observe(figure);
}
