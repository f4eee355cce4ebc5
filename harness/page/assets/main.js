// Puts the page together.

document.getElementById("theme").addEventListener("click", () => {
  setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark");
});
setTheme(window.matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
fillAbout();
fillSections();
fillScenes();
fillSummary();
fillEfficiency();
fillPlots();
fillProvenance();
// The viewer's first pictures are read when the section comes near.
new IntersectionObserver((entries, observer) => {
  if (!entries.some((entry) => entry.isIntersecting)) return;
  observer.disconnect();
  fillImages();
}, { rootMargin: "400px" }).observe(section("images"));
window.addEventListener("hashchange", () => { if (location.hash.startsWith("#scene=")) showScene(sceneOfAddress()); });
showScene(sceneOfAddress());
