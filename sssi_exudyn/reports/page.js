"use strict";
// Opens and closes the details of all sections at once; the button is there only where this runs.
(() => {
  const box = document.querySelector("p.all"), folded = [...document.querySelectorAll("section > details")];
  if (folded.length === 0) return;
  const button = box.querySelector("button");
  button.addEventListener("click", () => {
    const open = folded.some((details) => !details.open);
    for (const details of folded) details.open = open;
    button.textContent = open ? "Close all details" : "Open all details";
  });
  box.hidden = false;
})();
