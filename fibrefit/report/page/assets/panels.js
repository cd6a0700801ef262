// Panels one below the other that share their time axis: channels with the band, and residuals in units of the noise.
"use strict";

const LEFT = 64, RIGHT = 14;
const NOISE = 2;  // half of the band of the noise, in its rms: 95 of 100 samples lie inside
// Slack is the paper, light or dark.
const PHASES = ["#9e9e9e", "", "#3f78b5", "#9cc3e6", "#6b6b6b", "#3f78b5", "#9cc3e6", "#d9b25f"];

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

const phaseColour = (phase) => PHASES[phase] || css("--paper");

function colourOf(model, models) {
  if (model.role !== "tried") return css(`--${model.role}`);
  const number = models.filter((one) => one.role === "tried").indexOf(model);
  return css(`--tried-${(number % 3) + 1}`);
}

// Three colours tell the models that were tried apart; beyond, the length of their dashes.
function dashOf(model, models) {
  if (model.role !== "tried") return undefined;
  return models.filter((one) => one.role === "tried").indexOf(model) < 3 ? [6, 3] : [2, 3];
}

// An axis of any chart of the page: short ticks, and as much room as its numbers need.
function axis(label, more = {}) {
  const line = css("--line"), font = "12px system-ui", thin = { stroke: line, width: 0.5 };
  return { stroke: css("--quiet"), grid: thin, ticks: { ...thin, size: 4 }, gap: 3, font, label, labelFont: font, labelSize: 18, ...more };
}

const LETTER = 7;  // width of a digit
const across = (label) => axis(label, { size: 24 });
const upwards = (label, more = {}) => axis(label, {
  size: (u, shown) => Math.max(LEFT - 18, 12 + LETTER * Math.max(...(shown ?? []).map((one) => one?.length ?? 0))), ...more,
});

// Panels keep their left edges in line; those between others have no numbers below.
function axes(label, { last, residual }) {
  return [
    last ? across("time / s") : axis(undefined, { size: 6, values: () => [] }),
    upwards(label, { size: LEFT - 18, space: residual ? 18 : 30 }),
  ];
}

function fillTimes(u, spans, colour) {
  u.ctx.save();
  u.ctx.fillStyle = colour;
  for (const [from, to] of spans) {
    const x = Math.max(u.valToPos(from, "x", true), u.bbox.left);
    const right = Math.min(u.valToPos(to, "x", true), u.bbox.left + u.bbox.width);
    if (right > x) u.ctx.fillRect(x, u.bbox.top, Math.max(right - x, 1), u.bbox.height);
  }
  u.ctx.restore();
}

function fillNoise(u) {
  const top = u.valToPos(NOISE, "y", true), bottom = u.valToPos(-NOISE, "y", true);
  u.ctx.fillStyle = css("--noise");
  u.ctx.fillRect(u.bbox.left, top, u.bbox.width, bottom - top);
}

// Columns of a channel: time, ends of the band, measured, each model. Of a residual: time, each model.
function channelColumns(channel, models, samples) {
  const last = samples[`${models[models.length - 1].key} ${channel.name}`];
  const below = samples[`below ${channel.name}`], above = samples[`above ${channel.name}`];
  const band = below ? [last.map((v, i) => v - below[i]), last.map((v, i) => v + above[i])] : [];
  return [samples.time, ...band, samples[`measured ${channel.name}`], ...models.map((m) => samples[`${m.key} ${channel.name}`])];
}

function residualColumns(channel, models, samples, noise) {
  const measured = samples[`measured ${channel.name}`];
  return [samples.time, ...models.map((m) => samples[`${m.key} ${channel.name}`].map((v, i) => (measured[i] - v) / noise))];
}

function lines(models, shown, width) {
  return models.map((model) => ({
    label: model.label, stroke: colourOf(model, models), width: model.role === "final" ? width : width + 0.3,
    show: shown.has(model.key), points: { show: false }, dash: dashOf(model, models),
  }));
}

function channelSeries(models, shown, banded) {
  const edge = { stroke: "transparent", width: 0, points: { show: false } };
  const measured = css("--measured");
  return [
    {}, ...(banded ? [{ ...edge, label: "low" }, { ...edge, label: "high" }] : []),
    { label: "measured", stroke: measured, width: 1, points: { show: sparse, fill: measured, stroke: measured, size: 4 } },
    ...lines(models, shown, 1.1),
  ];
}

// Samples are drawn as points from where each has room.
const sparse = (u, series, first, last) => last - first < u.bbox.width / devicePixelRatio / 2;

const symmetric = (u, low, high) => {
  const reach = 1.06 * Math.max(1.6 * NOISE, Math.abs(low ?? 0), Math.abs(high ?? 0));
  return [-reach, reach];
};

// One panel in an element; `own` has what it calls back: zoom, hover, whole, marks.
function panel(element, options, levels, own) {
  const u = new uPlot({
    width: own.width(), height: options.height, padding: [options.top ?? 6, RIGHT, 0, 0], legend: { show: false },
    scales: { x: { time: false, auto: false, range: (_, low, high) => [low, high] }, y: { range: options.range } },
    axes: axes(options.label, options), series: options.series, bands: options.bands ?? [],
    cursor: {
      // The others follow the cursor; only the panel that was dragged over zooms.
      sync: { key: own.key, filters: { sub: (what) => what === "mousemove" || what === "mouseleave" } }, drag: { x: true, y: false, setScale: false }, y: false,
      // Of a thinned line the point at hand is an extreme near by, not the sample that the readout tells.
      points: { size: () => (own.exact() ? 6 : 0) }, bind: { dblclick: () => () => own.whole() },
    },
    hooks: {
      drawClear: [(u) => { if (options.residual) fillNoise(u); fillTimes(u, own.marks(options.channel), css("--place")); }],
      setSelect: [(u) => {
        if (u.select.width < 5) return;
        const from = u.posToVal(u.select.left, "x"), to = u.posToVal(u.select.left + u.select.width, "x");
        u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
        own.zoom(from, to);
      }],
      setCursor: [(u) => { if (u.cursor.left >= 0) own.hover(u.posToVal(u.cursor.left, "x")); }],
    },
  }, levels(2), element);
  return { u, levels, options };
}

// All panels of a record in an element.
fibrefit.panels = (element, view, record, samples, own) => {
  const made = [], count = view.channels.length;
  view.channels.forEach((channel, i) => {
    const columns = channelColumns(channel, view.models, samples), banded = `below ${channel.name}` in samples;
    made.push(panel(element, {
      height: 190, label: `${channel.name} / ${channel.unit}`, channel: channel.name,
      series: channelSeries(view.models, own.shown, banded && own.band),
      bands: banded && own.band ? [{ series: [2, 1], fill: css("--band") }] : [],
    }, fibrefit.levels(banded && own.band ? columns : [columns[0], ...columns.slice(banded ? 3 : 1)]), own));
    made.push(panel(element, {
      height: i === count - 1 ? 150 : 112, label: "residual / noise", channel: channel.name, residual: true, top: 2,
      last: i === count - 1, range: symmetric, series: [{}, ...lines(view.models, own.shown, 0.8)],
    }, fibrefit.levels(residualColumns(channel, view.models, samples, record.noise[channel.name])), own));
  });
  return made;
};

fibrefit.strip = (canvas, times, phase, from, to) => {
  const ratio = devicePixelRatio || 1, width = canvas.clientWidth, height = 16;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const ctx = canvas.getContext("2d"), inner = width - LEFT - RIGHT;
  ctx.scale(ratio, ratio);
  const x = (t) => LEFT + Math.min(Math.max((t - from) / (to - from), 0), 1) * inner;
  for (let i = 0, begin = 0; i < times.length; i++) {
    if (i + 1 < times.length && phase[i + 1] === phase[begin]) continue;
    ctx.fillStyle = phaseColour(phase[begin]);
    const left = x(times[begin]), right = x(times[Math.min(i + 1, times.length - 1)]);
    if (right > left) ctx.fillRect(left, 2, right - left, height - 4);
    begin = i + 1;
  }
  ctx.strokeStyle = css("--line");
  ctx.strokeRect(LEFT, 2, inner, height - 4);
};

fibrefit.phaseColour = phaseColour;
fibrefit.css = css;
fibrefit.axes = { across, upwards };
fibrefit.colourOf = colourOf;
fibrefit.dashOf = dashOf;
fibrefit.element = (tag, attributes = {}, ...inside) => {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value !== undefined) made.setAttribute(name, value);
  }
  made.append(...inside);
  return made;
};
