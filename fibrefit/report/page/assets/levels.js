// Three levels of a long record: all of its samples, and the extremes of every 8 and every 64 of them.
"use strict";

const FACTORS = [1, 8, 64];

function thinned(values, factor) {
  const made = [];
  for (let first = 0; first < values.length; first += factor) {
    let low = Infinity, high = -Infinity, lowAt = first, highAt = first;
    const end = Math.min(first + factor, values.length);
    for (let i = first; i < end; i++) {
      const value = values[i];
      if (value < low) { low = value; lowAt = i; }
      if (value > high) { high = value; highAt = i; }
    }
    if (low === Infinity) made.push(null, null);
    else if (lowAt <= highAt) made.push(low, high);
    else made.push(high, low);
  }
  return made;
}

// The two of a group stand at its ends: a line that rises or falls is drawn where it was.
function thinnedTimes(times, factor) {
  const made = [];
  for (let first = 0; first < times.length; first += factor) {
    const last = Math.min(first + factor, times.length) - 1;
    made.push(times[first], last > first ? times[last] : times[first] + 1e-9);
  }
  return made;
}

const whole = (values) => Array.from(values, (value) => (Number.isFinite(value) ? value : null));

// Columns of a panel at each level, made when they are first asked for.
fibrefit.levels = (columns) => {
  const kept = [];
  return (level) => {
    const factor = FACTORS[level];
    kept[level] ??= columns.map((values, i) =>
      factor === 1 ? whole(values) : i === 0 ? thinnedTimes(values, factor) : thinned(values, factor));
    return kept[level];
  };
};

// The finest level of which no more than so many samples are seen.
fibrefit.levelFor = (samples, most) => {
  const level = FACTORS.findIndex((factor) => (factor === 1 ? samples : (2 * samples) / factor) <= most);
  return level < 0 ? FACTORS.length - 1 : level;
};

fibrefit.indexAt = (times, instant) => {
  let low = 0, high = times.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= instant) low = middle; else high = middle;
  }
  return instant - times[low] <= times[high] - instant ? low : high;
};
