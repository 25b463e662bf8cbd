// What the theme leaves unnamed or out of the keyboard's reach.
document.addEventListener("DOMContentLoaded", () => {
  document.querySelectorAll("nav summary:not([aria-label])").forEach((toggle) => {
    const page = toggle.closest("li")?.querySelector("a")?.textContent.trim() ?? "";
    toggle.setAttribute("aria-label", `pages of ${page}`);
  });
  document.querySelectorAll("article table, article div.math").forEach((block) => {
    if (block.scrollWidth > block.clientWidth) block.tabIndex = 0;
  });
});
