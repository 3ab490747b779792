// The end of a path, as the views mark it.

export function goalOf(path) {
  const [x, y, heading] = path[path.length - 1];
  return { x, y, heading };
}
