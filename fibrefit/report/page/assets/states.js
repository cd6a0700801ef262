// Residuals against a state of the rig; a stretch of the state that is brushed shows when the rig was there.
"use strict";

const { element: make, css, axes: { across, upwards } } = fibrefit;
const MOST = 4000;  // points drawn
const BINS = 40;

function sorted(states, residuals) {
  const order = Array.from(states.keys()).filter((i) => Number.isFinite(states[i]) && Number.isFinite(residuals[i]));
  const step = Math.max(1, Math.ceil(order.length / MOST));
  const kept = order.filter((_, i) => i % step === 0).sort((a, b) => states[a] - states[b]);
  return [kept.map((i) => states[i]), kept.map((i) => residuals[i])];
}

function averaged([states, residuals]) {
  const low = states[0], width = (states[states.length - 1] - low) / BINS || 1;
  const sums = new Float64Array(BINS), counts = new Float64Array(BINS);
  states.forEach((state, i) => {
    const bin = Math.min(Math.floor((state - low) / width), BINS - 1);
    sums[bin] += residuals[i];
    counts[bin] += 1;
  });
  const means = states.map(() => null);
  let at = 0;
  for (let bin = 0; bin < BINS; bin++) {
    const middle = low + (bin + 0.5) * width;
    while (at < states.length - 1 && states[at] < middle) at += 1;
    if (counts[bin] > 5) means[at] = sums[bin] / counts[bin];
  }
  return means;
}

function spans(times, inside) {
  const found = [];
  let begun = -1;
  for (let i = 0; i <= times.length; i++) {
    const here = i < times.length && inside(i);
    if (here && begun < 0) begun = i;
    if (!here && begun >= 0) { found.push([times[begun], times[i - 1]]); begun = -1; }
  }
  return found;
}

fibrefit.states = (records) => {
  const { view } = records;
  if (!view.states.length) return [];
  const choice = (label, names) => make("select", { "aria-label": label, onchange: () => draw() }, ...names.map(([value, text]) => make("option", { value }, text)));
  const channel = choice("channel", view.channels.map((one) => [one.name, `residual of the ${one.name}`]));
  const state = choice("state", view.states.map((one) => [one.name, `against ${one.name}`]));
  const model = choice("model", view.models.map((one) => [one.key, one.label]));
  const place = make("div", { class: "panel states" }), said = make("p", { class: "help", "aria-live": "polite" });
  const clear = make("button", { type: "button", onclick: () => brush(null) }, "clear");
  let plot = null, residuals = null, states = null;

  function brush(ends) {
    const times = records.times;
    records.brushed = ends ? spans(times, (i) => states[i] >= ends[0] && states[i] <= ends[1]) : [];
    const inside = ends ? Array.from(residuals).filter((r, i) => Number.isFinite(r) && states[i] >= ends[0] && states[i] <= ends[1]) : [];
    if (inside.length) {
      const mean = inside.reduce((a, b) => a + b, 0) / inside.length, rms = Math.sqrt(inside.reduce((a, b) => a + b * b, 0) / inside.length);
      said.textContent = `${inside.length} samples with ${state.value} from ${ends[0].toPrecision(3)} to ${ends[1].toPrecision(3)}: ` +
        `mean residual ${mean.toFixed(2)}, RMS ${rms.toFixed(2)} times the noise; their times are shaded above.`;
    } else said.textContent = "Drag over a stretch of the state: its times are shaded in the record above.";
    records.show();
  }

  async function draw() {
    const samples = await records.samples(), shown = view.states.find((one) => one.name === state.value);
    const measured = samples[`measured ${channel.value}`], noise = records.record.noise[channel.value];
    states = samples[`state ${state.value}`];
    residuals = samples[`${model.value} ${channel.value}`].map((v, i) => (measured[i] - v) / noise);
    const data = sorted(states, residuals), colour = fibrefit.colourOf(view.models.find((one) => one.key === model.value), view.models);
    plot?.destroy();
    plot = new uPlot({
      width: records.width, height: 240, legend: { show: false }, padding: [8, 14, 0, 0], scales: { x: { time: false } },
      cursor: { drag: { x: true, y: false, setScale: false }, points: { show: false } },
      axes: [across(`${shown.name} / ${shown.unit}`), upwards("residual / noise")],
      series: [{}, { paths: () => null, points: { show: true, size: 2.5, width: 0, fill: css("--measured"), stroke: css("--measured") } },
        { stroke: colour, width: 2, spanGaps: true, points: { show: false } }],
      hooks: { setSelect: [(u) => { if (u.select.width > 3) brush([u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x")]); }] },
    }, [...data, averaged(data)], place);
  }

  records.box.addEventListener("redrawn", () => { said.textContent = "Drag over a stretch of the state: its times are shaded in the record above."; draw(); });
  return [make("h4", {}, "Residual against a state of the rig"), make("div", { class: "controls" }, channel, state, model, clear), place, said];
};
