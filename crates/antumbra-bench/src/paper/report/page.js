"use strict";
// The slider over each picture, and whose decisions are shown.
for (const card of document.querySelectorAll(".card")) {
  const compare = card.querySelector(".compare");
  // Cards of figures alone have none.
  if (compare === null) continue;
  const slider = compare.querySelector("input");
  const cut = () => compare.style.setProperty("--cut", slider.value + "%");
  slider.addEventListener("input", cut);
  cut();
  const buttons = card.querySelectorAll("button[data-over]");
  for (const button of buttons) {
    button.addEventListener("click", () => {
      for (const other of buttons) {
        other.setAttribute("aria-pressed", String(other === button));
        compare.querySelector("." + other.dataset.over).hidden = other !== button;
      }
    });
  }
}
