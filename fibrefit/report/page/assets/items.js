// A table of many results: sorts, filters, opens what there is to say of each.
"use strict";

const { element: make } = fibrefit;
const NUMERIC = /^(.+?)\s*(<=|>=|<|>|=)\s*(-?[\d.]+(?:e-?\d+)?)$/i;

// A unit in a heading has spaces that do not break, which nobody types.
const text = (cell) => cell.textContent.replaceAll("\u00a0", " ").trim();
const numeric = (cell) => (cell.dataset.value === undefined ? null : Number(cell.dataset.value));

class Items {
  constructor(box) {
    this.box = box;
    this.table = box.querySelector("table");
    this.body = this.table.tBodies[0];
    this.rows = [...this.body.rows];
    this.heads = [...this.table.tHead.rows[0].cells];
    this.names = this.heads.map(text);
    this.details = JSON.parse(document.getElementById(`${box.id}-rows`).textContent);
    this.links = JSON.parse(document.getElementById(`${box.id}-links`).textContent);
    this.heads.forEach((head, i) => head.replaceChildren(make("button", { type: "button", onclick: () => this.sort(i) }, head.textContent.trim())));
    this.rows.forEach((row, i) => {
      row.dataset.place = i;
      const name = row.cells[0];
      name.replaceChildren(make("button", { type: "button", "aria-expanded": "false", onclick: () => this.open(row) }, text(name)));
    });
    this.controls();
    fibrefit.trends?.(this);
  }

  controls() {
    this.words = make("input", { type: "search", placeholder: "words, or gap > 1.2", "aria-label": "filter", oninput: () => this.filter() });
    const states = [...new Set(this.rows.map((row) => text(row.cells[1])))];
    this.status = make("select", { "aria-label": "status", onchange: () => this.filter() }, make("option", { value: "" }, "any status"),
      ...states.map((one) => make("option", {}, one)));
    this.said = make("span", { "aria-live": "polite" });
    this.box.prepend(make("div", { class: "controls" }, this.words, this.status, this.said));
    this.filter();
  }

  sort(column, descending) {
    const head = this.heads[column], down = descending ?? head.getAttribute("aria-sort") === "ascending";
    this.heads.forEach((one) => one.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const key = (row) => numeric(row.cells[column]) ?? text(row.cells[column]);
    const known = (value) => value !== "";
    this.rows.sort((one, other) => {
      const [a, b] = [key(one), key(other)];
      // What has no value comes last, whichever way it is sorted.
      if (known(a) !== known(b)) return known(a) ? -1 : 1;
      const order = typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b), undefined, { numeric: true });
      return down ? -order : order;
    });
    this.body.querySelectorAll(".opened").forEach((row) => row.remove());
    this.body.append(...this.rows);
  }

  matches(row) {
    if (this.status.value && text(row.cells[1]) !== this.status.value) return false;
    return this.words.value.split(/[,;]/).map((one) => one.trim()).filter(Boolean).every((asked) => {
      const found = NUMERIC.exec(asked), column = found ? this.column(found[1]) : -1;
      if (column < 0) return text(row).toLowerCase().includes(asked.toLowerCase());
      const value = numeric(row.cells[column]), limit = Number(found[3]);
      if (value === null) return false;
      return { "<": value < limit, ">": value > limit, "<=": value <= limit, ">=": value >= limit, "=": value === limit }[found[2]];
    });
  }

  column(name) {
    const asked = name.trim().toLowerCase(), exact = this.names.findIndex((one) => one.toLowerCase() === asked);
    return exact >= 0 ? exact : this.names.findIndex((one) => one.toLowerCase().startsWith(asked));
  }

  filter() {
    this.body.querySelectorAll(".opened").forEach((row) => row.remove());
    this.rows.forEach((row) => { row.hidden = !this.matches(row); });
    this.shown = this.rows.filter((row) => !row.hidden);
    this.said.textContent = `${this.shown.length} of ${this.rows.length} items`;
    // What was asked for is printed whole.
    this.box.classList.toggle("asked", this.shown.length < this.rows.length);
    this.box.dispatchEvent(new CustomEvent("filtered"));
  }

  open(row) {
    const button = row.querySelector("button"), next = row.nextElementSibling;
    if (next?.classList.contains("opened")) {
      button.setAttribute("aria-expanded", "false");
      next.remove();
      return;
    }
    const place = Number(row.dataset.place), lines = this.details[place];
    const inside = lines.length ? lines.map((line) => make("p", {}, line)) : [make("p", {}, "Nothing to add.")];
    if (this.links[place]) inside.push(make("p", {}, make("a", { href: this.links[place] }, "its own result")));
    button.setAttribute("aria-expanded", "true");
    row.after(make("tr", { class: "opened" }, make("td", { colspan: this.heads.length }, ...inside)));
  }

  choose(row) {
    this.rows.forEach((one) => one.classList.toggle("chosen", one === row));
    row?.scrollIntoView({ block: "nearest" });
  }
}

fibrefit.Items = Items;
