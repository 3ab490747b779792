// Pictures and shapes of an occupancy grid.

const OCCUPIED = 50;

/** The free cells of a grid on a canvas, with lines a metre apart; all others are left clear. The first row is at the bottom. */
export function floorPicture(grid, { floor, grid: lines }) {
  const { width, height, resolution, origin } = grid.info;
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [width, height];
  const pen = canvas.getContext("2d");
  const whole = (at) => Math.abs(at - Math.round(at)) < resolution / 2;
  for (let i = 0; i < grid.data.length; i++) {
    if (grid.data[i] < 0 || grid.data[i] >= OCCUPIED) continue;
    const [column, row] = [i % width, Math.floor(i / width)];
    const line = whole(origin.position.x + (column + 0.5) * resolution) || whole(origin.position.y + (row + 0.5) * resolution);
    pen.fillStyle = line ? lines : floor;
    pen.fillRect(column, height - 1 - row, 1, 1);
  }
  return canvas;
}

/** Occupied cells as few rectangles, in cells: {left, right, low, high}. Equal runs in rows above each other are one. */
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
