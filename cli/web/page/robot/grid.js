// Pictures and shapes of an occupancy grid.

const OCCUPIED = 50;
const IMPASSABLE = 90; // of an elevation grid, in which what is lower can be crossed slowly

const pixels = new Map(); // colour -> what `pixel` has found

/**
 * The free cells of a grid on a canvas, with lines a metre apart; all others are left clear. The first row is at the
 * bottom.
 */
export function floorPicture(grid, palette) {
  const { width, height, resolution, origin } = grid.info;
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [width, height];
  const pen = canvas.getContext("2d");
  const [floor, line] = [palette.floor, palette.grid].map(pixel);
  const picture = pen.createImageData(width, height);
  const cells = new Uint32Array(picture.data.buffer); // a large map has a million cells: one write for each
  const whole = (at) => Math.abs(at - Math.round(at)) < resolution / 2;
  const lines = Array.from({ length: width }, (_, column) => whole(origin.position.x + (column + 0.5) * resolution));
  for (let row = 0; row < height; row++) {
    const across = whole(origin.position.y + (row + 0.5) * resolution);
    for (let column = 0; column < width; column++) {
      const value = grid.data[row * width + column];
      if (value >= 0 && value < OCCUPIED)
        cells[(height - 1 - row) * width + column] = across || lines[column] ? line : floor;
    }
  }
  pen.putImageData(picture, 0, 0);
  return canvas;
}

/**
 * What an elevation grid says of the floor, over the map: free, a step that can be crossed, and what cannot; what was
 * not seen is clear.
 */
export function reliefPicture(grid, palette, canvas = document.createElement("canvas")) {
  const { width, height } = grid.info;
  [canvas.width, canvas.height] = [width, height];
  const pen = canvas.getContext("2d");
  const [free, step, wall] = [
    [palette.good, 40],
    [palette.warn, 150],
    [palette.bad, 170],
  ].map(([color, opacity]) => (pixel(color) & 0xffffff) | (opacity << 24));
  const picture = pen.createImageData(width, height);
  const cells = new Uint32Array(picture.data.buffer);
  grid.data.forEach((value, i) => {
    if (value < 0) return;
    const row = Math.floor(i / width);
    cells[(height - 1 - row) * width + (i - row * width)] = value < OCCUPIED ? free : value < IMPASSABLE ? step : wall;
  });
  pen.putImageData(picture, 0, 0);
  return canvas;
}

/** A colour as the four bytes of a pixel. */
function pixel(color) {
  if (!pixels.has(color)) {
    const pen = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
    pen.fillStyle = color;
    pen.fillRect(0, 0, 1, 1);
    pixels.set(color, new Uint32Array(pen.getImageData(0, 0, 1, 1).data.buffer)[0]);
  }
  return pixels.get(color);
}

/**
 * Occupied cells as few rectangles, in cells: {left, right, low, high}. Equal runs in rows above each other are one.
 */
export function blocks(grid) {
  const { width, height } = grid.info;
  const done = [];
  let open = new Map(); // "left right" -> the block that the row before has there
  for (let row = 0; row < height; row++) {
    const next = new Map();
    for (let column = 0, left = -1; column <= width; column++) {
      const full = column < width && grid.data[row * width + column] >= OCCUPIED;
      if (full && left < 0) left = column;
      if (full || left < 0) continue;
      const key = `${left} ${column}`;
      const block = open.get(key) ?? { left, right: column, low: row, high: row };
      if (!open.has(key)) done.push(block);
      block.high = row + 1;
      next.set(key, block);
      left = -1;
    }
    open = next;
  }
  return done;
}
