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
window.addEventListener("load", () => window.MathJax?.startup?.promise?.then(reach));
