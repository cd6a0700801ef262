// From the text of a packed record to its arrays; the way there is packing.py.
"use strict";

async function inflated(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function summed(values, order) {
  for (let pass = 0; pass < order; pass++) {
    for (let i = 1; i < values.length; i++) values[i] += values[i - 1];
  }
  return values;
}

async function unpack(data) {
  const bytes = await inflated(data.deflated);
  const found = {};
  let at = 0;
  for (const packed of data.series) {
    const values = new Float64Array(data.length);
    for (let plane = 0, weight = 1; plane < packed.planes; plane++, weight *= 256) {
      for (let i = 0; i < data.length; i++) values[i] += weight * bytes[at + i];
      at += data.length;
    }
    // Even numbers were positive, odd ones negative.
    for (let i = 0; i < data.length; i++) values[i] = values[i] % 2 ? -(values[i] + 1) / 2 : values[i] / 2;
    summed(values, packed.order);
    for (let i = 0; i < data.length; i++) values[i] *= packed.step;
    for (const [first, number] of packed.missing) values.fill(NaN, first, first + number);
    found[packed.name] = values;
  }
  return found;
}

fibrefit.unpack = unpack;
