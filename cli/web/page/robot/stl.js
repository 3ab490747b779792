// Meshes in STL, as text or binary: the corners of their triangles.

const HEAD = 84; // bytes before the first triangle of a binary file, the last four of them their number
const TRIANGLE = 50; // a normal and three corners in 32-bit floats, and two bytes that mean nothing

/** Three numbers for each corner, three corners for each triangle. Throws if the bytes are no mesh. */
export function readStl(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const count = bytes.length >= HEAD ? view.getUint32(HEAD - 4, true) : NaN;
  if (bytes.length === HEAD + TRIANGLE * count) return binary(view, count); // a binary file may begin with "solid", too
  const text = new TextDecoder().decode(bytes);
  if (!/^\s*solid/.test(text)) throw new Error("this is no STL");
  const corners = [...text.matchAll(/vertex\s+(\S+)\s+(\S+)\s+(\S+)/g)].flatMap(([, ...xyz]) => xyz.map(Number));
  if (corners.length % 9 || corners.some(Number.isNaN)) throw new Error("this STL has triangles without three corners");
  return new Float32Array(corners);
}

function binary(view, count) {
  const corners = new Float32Array(9 * count);
  for (let i = 0; i < corners.length; i++)
    corners[i] = view.getFloat32(HEAD + TRIANGLE * Math.floor(i / 9) + 12 + 4 * (i % 9), true);
  return corners;
}
