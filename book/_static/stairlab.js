// Equations that are a little too wide for a small screen are made smaller; what is still too wide scrolls.
const SMALLEST = 70;
const fit = () => document.querySelectorAll("article mjx-container[display=true]").forEach((equation) => {
  for (let percent = 100; percent >= SMALLEST; percent -= 3) {
    equation.style.fontSize = `${percent}%`;
    if (equation.scrollWidth <= equation.clientWidth) break;
  }
});
// What the theme leaves unnamed or out of the keyboard's reach.
const reach = () => document.querySelectorAll("article table, article div.math, article mjx-container").forEach((block) => {
  if (block.scrollWidth > block.clientWidth) block.tabIndex = 0;
});
document.addEventListener("DOMContentLoaded", () => {
  document.querySelectorAll("nav summary:not([aria-label])").forEach((toggle) => {
    const page = toggle.closest("li")?.querySelector("a")?.textContent.trim() ?? "";
    toggle.setAttribute("aria-label", `pages of ${page}`);
  });
  document.querySelectorAll(".citation-list[role=list]").forEach((list) => list.removeAttribute("role"));
  reach();
});
window.addEventListener("load", () => window.MathJax?.startup?.promise?.then(() => { fit(); reach(); }));
window.addEventListener("resize", () => { fit(); reach(); });
