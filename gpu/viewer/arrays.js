// Arrays as they are packed into the page; gpu/viewer.py packs them.

const KINDS = { u4: Uint32Array, i2: Uint16Array, f4: Uint32Array };
const VIEWS = { u4: Uint32Array, i2: Int16Array, f4: Float32Array };

// An array {kind, width, count, data}: base64 of deflated byte planes of the differences between rows.
async function unpack(packed) {
  const deflated = Uint8Array.from(atob(packed.data), (letter) => letter.charCodeAt(0));
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const numbers = new KINDS[packed.kind](packed.count * packed.width);
  const bytes = new Uint8Array(numbers.buffer), size = numbers.BYTES_PER_ELEMENT;
  for (let plane = 0; plane < size; ++plane)
    for (let k = 0; k < numbers.length; ++k) bytes[k * size + plane] = planes[plane * numbers.length + k];
  for (let k = packed.width; k < numbers.length; ++k) numbers[k] += numbers[k - packed.width];
  return new VIEWS[packed.kind](numbers.buffer);
}

// Ends of lines (n,2,3) between points (n,3): those that pairs name, or with no pairs a dot for each of the places.
function lineEnds(points, pairs) {
  const ends = new Float32Array(3 * pairs.length);
  for (let k = 0; k < pairs.length; ++k)
    for (let axis = 0; axis < 3; ++axis) ends[3 * k + axis] = points[3 * pairs[k] + axis];
  return ends;
}
