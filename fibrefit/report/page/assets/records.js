// The view of the records: which one, from when to when, which models; readout, places, keyboard, touch, address.
"use strict";

const { element: make, css } = fibrefit;
const MOST = 3;  // samples drawn for each dot across, from which the next level is taken
// Four digits that count, or as many decimals as the noise leaves.
const number = (value) => (Number.isFinite(value) ? String(Number(value.toPrecision(4))) : "–");
const decimalsOf = (noise) => (noise > 0 ? Math.min(Math.max(0, 1 - Math.floor(Math.log10(noise))), 12) : 4);
const rounded = (value, decimals) => (Number.isFinite(value) ? value.toFixed(decimals).replace(/^-(0\.?0*)$/, "$1") : "–");
fibrefit.written = { number, decimalsOf, rounded };

class Records {
  constructor(box) {
    this.box = box;
    this.view = JSON.parse(document.getElementById(`${box.id}-view`).textContent);
    this.kept = [];
    this.at = { record: 0, from: null, to: null, shown: new Set(this.view.models.filter((m) => m.shown).map((m) => m.key)) };
    this.band = true;
    this.brushed = [];
    this.fromAddress();
    this.build();
  }

  get record() { return this.view.records[this.at.record]; }

  // Samples of a record, unpacked once.
  samples(record = this.at.record) {
    this.kept[record] ??= fibrefit.unpack(JSON.parse(document.getElementById(`${this.box.id}-data-${record}`).textContent));
    return this.kept[record];
  }

  build() {
    const names = this.view.records.map((one, i) => make("option", { value: i }, one.says ? `${one.name} (${one.says})` : one.name));
    this.select = make("select", { "aria-label": "record", onchange: () => this.open(+this.select.value) }, ...names);
    const button = (text, does, label) => make("button", { type: "button", onclick: does, "aria-label": label, title: label }, text);
    const tools = make("div", { class: "controls tools" },
      button("◀", () => this.step(-1), "previous record"), this.select, button("▶", () => this.step(1), "next record"),
      button("+", () => this.scale(0.5), "zoom in"), button("−", () => this.scale(2), "zoom out"),
      button("←", () => this.pan(-0.25), "earlier"), button("→", () => this.pan(0.25), "later"),
      button("whole record", () => this.whole(), "the whole record"), button("copy link", () => this.copy(), "copy a link to this view"));
    this.toggles = make("div", { class: "controls models", role: "group", "aria-label": "what is drawn" });
    this.readout = make("div", { class: "readout", "aria-live": "off" });
    this.canvas = make("canvas", { class: "phases", role: "img", "aria-label": "phases of the motion" });
    this.panel = make("div", { class: "panel" });
    this.key = make("div", { class: "phase-key" });
    const help = make("p", { class: "help" }, "Drag to zoom, double click for the whole record. Keys: ← → move, + − zoom, 0 whole, " +
      "n p next and previous place, [ ] records. Touch: one finger moves, two zoom. Residuals: measured minus simulated, in units of the noise; grey: ±2 noise rms.");
    this.box.append(tools, this.toggles, this.readout, this.canvas, this.panel, this.key, help, ...this.places());
    this.box.append(...(fibrefit.overlay?.(this) ?? []), ...(fibrefit.states?.(this) ?? []));
    this.box.addEventListener("keydown", (event) => this.pressed(event));
    new ResizeObserver(() => this.resized()).observe(this.box);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
    addEventListener("hashchange", () => { if (this.fromAddress()) this.redraw(); });
    this.touch();
    this.ready = this.redraw();
  }

  places() {
    if (!this.view.places.length) return [];
    const rows = this.view.places.map((place, i) => make("li", {}, make("button", { type: "button", onclick: () => this.goTo(i) },
      `${place.record}: ${place.channel}, ${place.from.toFixed(3)} to ${place.to.toFixed(3)} s, ${place.phase}: ${(100 * place.share).toFixed(0)} % of the gap`)));
    return [make("h4", {}, "Where the first model goes wrong"), make("ol", { class: "places" }, ...rows)];
  }

  drawToggles() {
    const one = (pressed, does, inside) => make("button", { type: "button", "aria-pressed": pressed, onclick: does }, inside);
    const swatch = (colour, kind = "") => {
      const line = make("i", { class: kind });
      line.style.borderColor = colour;
      return line;
    };
    const key = (text, mark) => make("span", { class: "key" }, mark, text);
    const dashes = (model) => ({ "6,3": "dashes", "2,3": "dots" })[fibrefit.dashOf(model, this.view.models)] ?? "";
    const models = this.view.models.map((model) => one(this.at.shown.has(model.key), () => this.toggle(model.key),
      key(model.label, swatch(fibrefit.colourOf(model, this.view.models), dashes(model)))));
    const band = one(this.band, () => { this.band = !this.band; this.redraw(); }, key(this.view.band.split(":")[0], swatch("", "area")));
    band.title = this.view.band;
    this.toggles.replaceChildren(key("measured", swatch(css("--measured"), "dots")), ...models, band);
  }

  async redraw() {
    const samples = await this.samples(), mine = this.record;
    this.times = samples.time;
    this.last = samples;
    this.select.value = this.at.record;
    this.drawToggles();
    this.drawn?.forEach((one) => one.u.destroy());
    this.panel.replaceChildren();
    this.drawn = fibrefit.panels(this.panel, this.view, mine, samples, {
      key: this.box.id, shown: this.at.shown, band: this.band, width: () => this.width, whole: () => this.whole(),
      exact: () => this.level === 0, zoom: (from, to) => this.zoom(from, to), hover: (instant) => this.hover(instant), marks: (channel) => this.marks(channel),
    });
    const there = [...new Set(samples.phase ?? [])].sort();
    this.key.replaceChildren(...there.map((phase) => {
      const mark = make("i");
      mark.style.background = fibrefit.phaseColour(phase);
      return make("span", {}, mark, this.view.phases[phase]);
    }));
    this.canvas.hidden = !samples.phase;
    this.show();
    this.hover(this.instant ?? this.range[0]);
    this.box.dispatchEvent(new CustomEvent("redrawn"));
  }

  get width() { return Math.max(this.box.clientWidth, 240); }

  get range() {
    return this.at.from === null ? [this.times[0], this.times[this.times.length - 1]] : [this.at.from, this.at.to];
  }

  // Draw what is asked for, at the level that suits it.
  show() {
    const [from, to] = this.range;
    const seen = fibrefit.indexAt(this.times, to) - fibrefit.indexAt(this.times, from) + 1;
    this.level = fibrefit.levelFor(seen, MOST * this.width);
    for (const { u, levels } of this.drawn) {
      u.batch(() => {
        u.setData(levels(this.level), false);
        u.setScale("x", { min: from, max: to });
      });
    }
    if (this.last.phase) fibrefit.strip(this.canvas, this.times, this.last.phase, from, to);
    this.toAddress();
  }

  marks(channel) {
    const own = this.view.places.filter((one) => one.record === this.record.name && one.channel === channel);
    return [...own.map((one) => [one.from, one.to]), ...this.brushed];
  }

  // What is known of the sample under the cursor: the motion in a line, then a row each for what was measured and each model.
  hover(instant) {
    this.instant = instant;
    const i = fibrefit.indexAt(this.times, instant), samples = this.last;
    const say = (name, text, unit = "") => make("span", {}, `${name} `, make("b", {}, text), unit ? ` ${unit}` : "");
    const state = [say("time", this.times[i].toFixed(4), "s")];
    if (samples.phase) state.push(say("", this.view.phases[samples.phase[i]]));
    for (const { name, unit } of this.view.states) state.push(say(name, number(samples[`state ${name}`][i]), unit));
    const { channels } = this.view, measured = channels.map(({ name }) => samples[`measured ${name}`][i]);
    const { noise } = this.record, decimals = channels.map(({ name }) => decimalsOf(noise[name]));
    const rows = [["measured", measured.map((value, c) => rounded(value, decimals[c]))]];
    for (const model of this.view.models.filter((one) => this.at.shown.has(one.key))) {
      rows.push([model.label, channels.map(({ name }, c) => {
        const value = samples[`${model.key} ${name}`][i];
        return `${rounded(value, decimals[c])} (${rounded((measured[c] - value) / noise[name], 2)})`;
      })]);
    }
    const cells = (kind, texts) => texts.map((text) => make(kind, { class: "number" }, text));
    this.readout.replaceChildren(make("div", { class: "state" }, ...state), make("table", {},
      make("thead", {}, make("tr", {}, make("td", {}, "value (residual)"), ...cells("th", channels.map(({ name, unit }) => `${name} / ${unit}`)))),
      make("tbody", {}, ...rows.map(([name, texts]) => make("tr", {}, make("th", { scope: "row" }, name), ...cells("td", texts))))));
  }

  zoom(from, to) {
    const [first, last] = [this.times[0], this.times[this.times.length - 1]];
    const least = 4 * (this.times[1] - this.times[0]);
    if (to - from < least) [from, to] = [0.5 * (from + to - least), 0.5 * (from + to + least)];
    [from, to] = [Math.max(from, first), Math.min(to, last)];
    [this.at.from, this.at.to] = from <= first && to >= last ? [null, null] : [from, to];
    this.show();
  }

  scale(factor) {
    const [from, to] = this.range, middle = 0.5 * (from + to), half = 0.5 * factor * (to - from);
    this.zoom(middle - half, middle + half);
  }

  pan(share) {
    const [from, to] = this.range, [first, last] = [this.times[0], this.times[this.times.length - 1]];
    const by = Math.min(Math.max(share * (to - from), first - from), last - to);
    this.zoom(from + by, to + by);
  }

  whole() { this.at.from = this.at.to = null; this.show(); }

  toggle(key) {
    if (!this.at.shown.delete(key)) this.at.shown.add(key);
    return this.redraw();
  }

  compare(keys) {
    this.at.shown = new Set(keys);
    this.box.scrollIntoView({ block: "start" });
    return this.redraw();
  }

  open(record, from = null, to = null) {
    Object.assign(this.at, { record, from, to });
    this.brushed = [];
    return this.redraw();
  }

  step(by) {
    const count = this.view.records.length;
    return this.open((this.at.record + by + count) % count);
  }

  goTo(index) {
    const place = this.view.places[index], margin = 1.5 * (place.to - place.from);
    this.place = index;
    this.panel.scrollIntoView({ block: "nearest" });
    return this.open(this.view.records.findIndex((one) => one.name === place.record), place.from - margin, place.to + margin)
      .then(() => { this.zoom(place.from - margin, place.to + margin); this.hover(0.5 * (place.from + place.to)); });
  }

  nextPlace(by) {
    const count = this.view.places.length;
    if (count) this.goTo(((this.place ?? (by > 0 ? -1 : 0)) + by + count) % count);
  }

  pressed(event) {
    if (event.target.matches("select, input") || event.ctrlKey || event.metaKey || event.altKey) return;
    const does = {
      ArrowLeft: () => this.pan(-0.2), ArrowRight: () => this.pan(0.2), "+": () => this.scale(0.5), "=": () => this.scale(0.5),
      "-": () => this.scale(2), 0: () => this.whole(), Home: () => this.whole(), n: () => this.nextPlace(1), p: () => this.nextPlace(-1),
      "[": () => this.step(-1), "]": () => this.step(1),
    }[event.key];
    if (does) { event.preventDefault(); does(); }
  }

  touch() {
    const down = new Map();
    let begun = null;
    const begin = () => {
      const xs = [...down.values()];
      begun = { range: this.range, middle: xs.reduce((a, b) => a + b, 0) / xs.length, apart: Math.abs(xs[0] - (xs[1] ?? xs[0])) };
    };
    const end = (event) => { if (down.delete(event.pointerId) && down.size) begin(); };
    this.panel.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "mouse") return;
      down.set(event.pointerId, event.clientX);
      begin();
    });
    this.panel.addEventListener("pointermove", (event) => {
      if (!down.has(event.pointerId)) return;
      down.set(event.pointerId, event.clientX);
      const xs = [...down.values()], { range: [from, to], middle, apart } = begun;
      const dots = this.width - 78, now = xs.reduce((a, b) => a + b, 0) / xs.length;
      const factor = xs.length > 1 ? apart / Math.max(Math.abs(xs[0] - xs[1]), 8) : 1;
      const by = ((middle - now) / dots) * (to - from), centre = 0.5 * (from + to) + by, half = 0.5 * factor * (to - from);
      this.zoom(centre - half, centre + half);
    });
    for (const name of ["pointerup", "pointercancel", "pointerleave"]) this.panel.addEventListener(name, end);
  }

  resized() {
    if (!this.drawn || this.width === this.drawnAt) return;
    this.drawnAt = this.width;
    for (const { u, options } of this.drawn) u.setSize({ width: this.width, height: options.height });
    this.show();
  }

  // #id?record=2&t=0.41-0.47&show=first,final
  fromAddress() {
    const [id, query] = decodeURIComponent(location.hash.slice(1)).split("?");
    if (id !== this.box.id || !query) return false;
    const given = new URLSearchParams(query), record = Number(given.get("record") ?? 1) - 1;
    if (this.view.records[record]) this.at.record = record;
    const ends = (given.get("t") ?? "").split("~").map(Number);
    const known = ends.length === 2 && ends.every(Number.isFinite) && ends[1] > ends[0];
    [this.at.from, this.at.to] = known ? ends : [null, null];
    const shown = (given.get("show") ?? "").split(",").filter((key) => this.view.models.some((model) => model.key === key));
    if (shown.length || given.get("show") === "") this.at.shown = new Set(shown);  // none is a view too
    return true;
  }

  get address() {
    const parts = [`record=${this.at.record + 1}`, `show=${[...this.at.shown].join(",")}`];
    if (this.at.from !== null) parts.push(`t=${this.at.from.toFixed(5)}~${this.at.to.toFixed(5)}`);
    return `#${this.box.id}?${parts.join("&")}`;
  }

  toAddress() {
    if (!this.touched && this.at.from === null) return;
    this.touched = true;
    history.replaceState(null, "", this.address);
  }

  copy() {
    this.touched = true;
    this.toAddress();
    navigator.clipboard?.writeText(location.href).catch(() => {});
  }
}

fibrefit.Records = Records;
