// A message as text, field by field, as `topic echo` prints it; long texts and arrays are cut.

const ITEMS = 16; // of an array
const LETTERS = 300; // of a text

/** The lines of a decoded message. */
export function messageText(message) {
  return [...lines(message, "")].join("\n");
}

function* lines(message, indent) {
  for (const [name, value] of Object.entries(message)) yield* field(`${indent}${name}:`, value, indent);
}

function* field(head, value, indent) {
  const numbers = ArrayBuffer.isView(value);
  if (numbers || Array.isArray(value)) {
    const items = [.../** @type {any} */ (value).slice(0, ITEMS)];
    const rest = /** @type {any} */ (value).length - items.length;
    if (!items.length || numbers || typeof items[0] !== "object") {
      yield `${head} [${items.map(scalar).join(", ")}${rest ? `, ... ${rest} more` : ""}]`;
      return;
    }
    yield head;
    for (const item of items) {
      const [first, ...others] = lines(item, `${indent}  `);
      yield `${indent}- ${first.trimStart()}`;
      yield* others;
    }
    if (rest) yield `${indent}... ${rest} more`;
  } else if (value !== null && typeof value === "object") {
    yield head;
    yield* lines(value, `${indent}  `);
  } else yield `${head} ${scalar(value)}`;
}

function scalar(value) {
  if (typeof value !== "string") return String(value);
  return value.length > LETTERS ? `${value.slice(0, LETTERS)}... (${value.length} letters)` : value || "''";
}
