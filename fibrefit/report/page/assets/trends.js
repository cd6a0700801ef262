// One column of a table of results against another, with errors; the point that is chosen is shown in the table.
"use strict";

const { element: make, css, axes } = fibrefit;
const STATES = { ok: "--ok", suspect: "--suspect", failed: "--failed", "not possible": "--failed" };
const HEIGHT = 320;
const PLACES = [0, 1, 2, 3, 4, 5].flatMap((zeros) => [1, 2, 5].map((digit) => digit * 10 ** zeros));  // between items: no half of one

const LACKS = ", model lacks something";

// How an item ended, and whether its model explains it.
const stateOf = (row) => row.cells[1].textContent.trim() + (row.dataset.lacks === undefined ? "" : LACKS);

// In the colours of the table; what is doubtful, or not explained, is hollow, too.
function mark(state) {
  const colour = css(STATES[state.replace(LACKS, "")]);
  return { size: 6, width: 1.5, stroke: colour, fill: state === "ok" ? colour : css("--paper") };
}

const value = (row, column) => (column < 0 ? Number(row.dataset.place) + 1 : row.cells[column].dataset.value === undefined ? null : Number(row.cells[column].dataset.value));
const error = (row, column) => Number(row.cells[column]?.dataset.error ?? 0);

function bars(u, rows, column) {
  u.ctx.save();
  u.ctx.lineWidth = devicePixelRatio;
  u.ctx.globalAlpha = 0.45;
  rows.forEach((row, i) => {
    const half = 2 * error(row, column), y = u.data[1][i];
    if (!half || y === null) return;
    const x = u.valToPos(u.data[0][i], "x", true);
    u.ctx.strokeStyle = css(STATES[row.cells[1].textContent.trim()]);
    u.ctx.beginPath();
    u.ctx.moveTo(x, u.valToPos(y - half, "y", true));
    u.ctx.lineTo(x, u.valToPos(y + half, "y", true));
    u.ctx.stroke();
  });
  u.ctx.restore();
}

fibrefit.trends = (items) => {
  const columns = items.heads.map((head, i) => [i, items.names[i]]).filter(([i]) => items.rows.some((row) => value(row, i) !== null));
  if (!columns.length) return;
  const choice = (label, all, chosen) => {
    const made = make("select", { "aria-label": label, onchange: () => draw() }, ...all.map(([i, name]) => make("option", { value: i }, name)));
    made.value = chosen;
    return made;
  };
  const first = columns.find(([i]) => items.rows.some((row) => error(row, i) > 0)) ?? columns[0];
  const up = choice("vertical axis", columns, first[0]), across = choice("horizontal axis", [[-1, "item, in order"], ...columns], -1);
  const place = make("div", { class: "trend panel" }), said = make("p", { class: "help" });
  const key = make("div", { class: "phase-key dots" });
  let plot = null;
  const width = () => Math.max(items.box.clientWidth, 240);

  function draw() {
    const x = Number(across.value), y = Number(up.value);
    const rows = items.shown.filter((row) => value(row, x) !== null && value(row, y) !== null).sort((a, b) => value(a, x) - value(b, x));
    const data = [rows.map((row) => value(row, x)), rows.map((row) => value(row, y))];
    const states = Object.keys(STATES).flatMap((name) => [name, name + LACKS]).filter((name) => rows.some((row) => stateOf(row) === name));
    const split = states.map((name) => rows.map((row, i) => (stateOf(row) === name ? data[1][i] : null)));
    const reach = rows.map((row, i) => [data[1][i] - 2 * error(row, y), data[1][i] + 2 * error(row, y)]).flat();
    const low = Math.min(...reach), high = Math.max(...reach), margin = 0.06 * (high - low) || 1;
    plot?.destroy();
    plot = items.plotted = new uPlot({
      width: width(), height: HEIGHT, legend: { show: false }, padding: [10, 14, 0, 0],
      scales: { x: { time: false, range: (u, a, b) => { const slack = 0.03 * (b - a) || 1; return [a - slack, b + slack]; } }, y: { range: () => [low - margin, high + margin] } },
      axes: [
        { ...axes.across(across.selectedOptions[0].textContent), incrs: x < 0 ? PLACES : undefined },
        axes.upwards(up.selectedOptions[0].textContent),
      ],
      cursor: { drag: { x: false, y: false }, points: { show: false } },
      series: [{}, ...states.map((name) => ({ label: name, paths: () => null, points: { show: true, ...mark(name) } }))],
      hooks: {
        drawAxes: [(u) => bars({ ctx: u.ctx, data, valToPos: u.valToPos }, rows, y)],
        setCursor: [(u) => point(u, rows, data)],
        ready: [(u) => u.over.addEventListener("click", () => items.choose(nearest(u, rows, data)))],
      },
    }, [data[0], ...split], place);
    key.replaceChildren(...states.map((name) => {
      const dot = make("i");
      Object.assign(dot.style, { background: mark(name).fill, borderColor: mark(name).stroke });
      return make("span", {}, dot, name);
    }));
    said.textContent = `${rows.length} items; bars: twice the standard error. Click a point to find its row.`;
  }

  function nearest(u, rows, data) {
    let best = null, least = 400;
    rows.forEach((row, i) => {
      const apart = (u.valToPos(data[0][i], "x") - u.cursor.left) ** 2 + (u.valToPos(data[1][i], "y") - u.cursor.top) ** 2;
      if (apart < least) { least = apart; best = row; }
    });
    return best;
  }

  function point(u, rows, data) {
    const row = u.cursor.left >= 0 ? nearest(u, rows, data) : null;
    if (row) said.textContent = `${row.cells[0].textContent}: ${row.cells[Number(up.value)].textContent}, ${row.cells[1].textContent}`;
  }

  items.box.prepend(make("div", { class: "controls" }, up, "against", across), key, place, said);
  items.box.addEventListener("filtered", draw);
  new ResizeObserver(() => { if (plot) plot.setSize({ width: width(), height: HEIGHT }); }).observe(items.box);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  draw();
};
