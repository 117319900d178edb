// Open the folded parts around the target of a link, and all parts for printing.
const open = element => { for (let e = element; e; e = e.parentElement) if (e.tagName === "DETAILS") e.open = true; };
const show = () => {
  const target = location.hash.length > 1 && document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (target) { open(target); target.scrollIntoView(); }
};
addEventListener("hashchange", show);
document.addEventListener("click", event => {
  const link = event.target.closest('a[href^="#"]');
  if (link && link.hash === location.hash) show();
});
let opened = [];
addEventListener("beforeprint", () => {
  opened = [...document.querySelectorAll("details:not([open])")];
  for (const e of opened) e.open = true;
});
addEventListener("afterprint", () => { for (const e of opened) e.open = false; });
const contents = document.querySelector("details.contents"), wide = matchMedia("(min-width: 1100px)");
if (contents) {
  const fit = () => { contents.open = wide.matches; };
  wide.addEventListener("change", fit);
  contents.addEventListener("click", event => { if (event.target.closest("a")) fit(); });
  fit();
}
for (const box of document.querySelectorAll(".wide, .map")) box.tabIndex = 0;
show();
