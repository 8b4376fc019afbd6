"use strict";
// A surface is unpacked when it is asked for: twelve WebGL scenes at once would be refused by the browser.
for (const button of document.querySelectorAll("button[data-surface]")) {
  button.addEventListener("click", () => {
    const frame = document.createElement("iframe");
    frame.title = button.dataset.title;
    frame.srcdoc = JSON.parse(document.getElementById(button.dataset.surface).textContent);
    button.replaceWith(frame);
    frame.focus();
  });
}
// What is folded away on the screen belongs on paper.
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((d) => { d.open = true; }));
