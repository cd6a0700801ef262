// Bring the page to life: views of records when they come near, tables, and what can be saved.
"use strict";

const views = new Map();

function alive(box) {
  if (!views.has(box)) views.set(box, new fibrefit.Records(box));
  return views.get(box);
}

function save(script) {
  const file = new Blob([JSON.stringify(JSON.parse(script.textContent), null, 1)], { type: "application/json" });
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(file), download: `${script.id}.json` });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

const near = new IntersectionObserver((seen) => {
  for (const one of seen) if (one.isIntersecting) { near.unobserve(one.target); alive(one.target); }
}, { rootMargin: "800px" });

for (const box of document.querySelectorAll(".records")) near.observe(box);
const tables = new Map([...document.querySelectorAll(".items")].map((box) => [box, new fibrefit.Items(box)]));
for (const button of document.querySelectorAll(".compare")) {
  const box = button.closest("article").querySelector(".records");
  button.addEventListener("click", () => alive(box).compare(button.dataset.models.split(",")));
}
for (const script of document.querySelectorAll("script.summary")) {
  const button = Object.assign(document.createElement("button"), { type: "button", textContent: "Save the summary as JSON" });
  button.addEventListener("click", () => save(script));
  const row = Object.assign(document.createElement("p"), { className: "controls" });
  row.append(button);
  script.before(row);
}

const target = decodeURIComponent(location.hash.slice(1)).split("?")[0];
const wanted = target && document.getElementById(target);
if (wanted) wanted.scrollIntoView({ block: "start" });

fibrefit.view = (id) => alive(document.getElementById(id));
fibrefit.trend = (box) => tables.get(box).plotted;
