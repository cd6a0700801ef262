// Moments that records have in common, laid over one another: time is counted from the moment in each record.
"use strict";

const { element: make, axes: { across, upwards } } = fibrefit;
const MOST = 8;  // records that can be distinguished
const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f", "#b8860b"];

function window_of(view, kind) {
  const apart = [];
  for (const record of view.records) {
    const at = record.moments.findIndex((one) => one.kind === kind);
    if (at >= 0 && record.moments[at + 1]) apart.push(record.moments[at + 1].at - record.moments[at].at);
  }
  apart.sort((a, b) => a - b);
  return Math.min(Math.max(apart[apart.length >> 1] ?? 0.1, 0.005), 0.5);
}

function cut(samples, channel, model, at, half) {
  const from = fibrefit.indexAt(samples.time, at - half), to = fibrefit.indexAt(samples.time, at + half) + 1;
  const part = (name) => Array.from(samples[name].subarray(from, to), (v) => (Number.isFinite(v) ? v : null));
  return [part("time").map((t) => 1e3 * (t - at)), part(`measured ${channel}`), part(`${model} ${channel}`)];
}

fibrefit.overlay = (records) => {
  const { view } = records, kinds = [...new Set(view.records.flatMap((one) => one.moments.map((moment) => moment.kind)))];
  if (!kinds.length) return [];
  const model = view.models[view.models.length - 1];
  const channel = make("select", { "aria-label": "channel", onchange: () => draw() }, ...view.channels.map((one) => make("option", {}, one.name)));
  const place = make("div", { class: "panel overlay" }), legend = make("div", { class: "phase-key" });
  let chosen = null, half = 0, plot = null;
  const buttons = kinds.map((kind) => make("button", { type: "button", "aria-pressed": "false", onclick: () => choose(kind) }, kind));
  const width = make("span", {}, make("button", { type: "button", onclick: () => { half /= 2; draw(); } }, "narrower"), " ",
    make("button", { type: "button", onclick: () => { half *= 2; draw(); } }, "wider"));
  width.hidden = channel.hidden = true;

  function choose(kind) {
    chosen = kind;
    half = window_of(view, kind);
    width.hidden = channel.hidden = false;
    buttons.forEach((button, i) => button.setAttribute("aria-pressed", kinds[i] === kind));
    return draw();
  }

  async function draw() {
    if (!chosen) return;
    const moments = view.records.map((one, i) => ({ i, name: one.name, at: one.moments.find((moment) => moment.kind === chosen)?.at }))
      .filter((one) => one.at !== undefined).slice(0, MOST);
    const unit = view.channels.find((one) => one.name === channel.value).unit;
    const tables = await Promise.all(moments.map(async (one) => cut(await records.samples(one.i), channel.value, model.key, one.at, half)));
    const series = moments.flatMap((one, i) => {
      const colour = COLOURS[i];
      return [
        { label: one.name, stroke: colour, width: 0, paths: () => null, points: { show: true, size: 4, fill: colour, stroke: colour } },
        { stroke: colour, width: 1.4, spanGaps: true, points: { show: false } },
      ];
    });
    plot?.destroy();
    plot = new uPlot({
      width: records.width, height: 260, legend: { show: false }, padding: [8, 14, 0, 0],
      scales: { x: { time: false } }, cursor: { drag: { x: true, y: false } },
      axes: [across(`time after ${chosen} / ms`), upwards(`${channel.value} / ${unit}`)],
      series: [{}, ...series],
    }, uPlot.join(tables), place);
    legend.replaceChildren(...moments.map((one, i) => {
      const mark = make("i");
      mark.style.background = COLOURS[i];
      return make("span", {}, mark, one.name);
    }));
  }

  records.box.addEventListener("redrawn", () => draw());
  const several = view.records.length > 1;
  const some = view.records.length > MOST ? ` The first ${MOST} records that have it.` : "";
  return [make("h4", {}, several ? "The same moment of every record, one over the other" : "A moment of the record, enlarged"),
    make("div", { class: "controls moments", role: "group", "aria-label": "moments" }, ...buttons, channel, width), place, legend,
    make("p", { class: "help" }, `Points: measured; lines: ${model.label}. Time counts from the moment${several ? " in each record" : ""}.${some}`)];
};
