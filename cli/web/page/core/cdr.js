// Messages from their bytes: CDR as ROS 2 writes it, read by the text of the type's definition ("ros2msg": the
// definition, then those it uses).

const SIZES = {
  bool: 1,
  byte: 1,
  char: 1,
  uint8: 1,
  int8: 1,
  uint16: 2,
  int16: 2,
  uint32: 4,
  int32: 4,
  float32: 4,
  uint64: 8,
  int64: 8,
  float64: 8,
};
const ARRAYS = {
  byte: Uint8Array,
  char: Uint8Array,
  uint8: Uint8Array,
  int8: Int8Array,
  uint16: Uint16Array,
  int16: Int16Array,
  uint32: Uint32Array,
  int32: Int32Array,
  float32: Float32Array,
  uint64: BigUint64Array,
  int64: BigInt64Array,
  float64: Float64Array,
};
const GETTERS = {
  byte: "getUint8",
  char: "getUint8",
  uint8: "getUint8",
  int8: "getInt8",
  uint16: "getUint16",
  int16: "getInt16",
  uint32: "getUint32",
  int32: "getInt32",
  float32: "getFloat32",
  uint64: "getBigUint64",
  int64: "getBigInt64",
  float64: "getFloat64",
};
const FIELD = /^([A-Za-z]\w*(?:\/\w+)*)(?:<=\d+)?(?:\[(<=)?(\d*)\])?\s+([A-Za-z]\w*)(?:\s+(.+))?$/;
const CONSTANT = /^\S+\s+[A-Z][A-Z0-9_]*\s*=/;
const UTF8 = new TextDecoder();

/**
 * The fields of a type and of all that it uses: a map of "pkg/Type" to [{name, type, array, length}]; array is "",
 * "fixed" or "sequence".
 */
export function parse(schema, name) {
  const types = new Map();
  const parts = schema.split(/^=+\s*\n?MSG:\s*/m);
  types.set(short(name), fields(parts[0], short(name)));
  for (const part of parts.slice(1)) {
    const end = part.indexOf("\n");
    const title = short((end < 0 ? part : part.slice(0, end)).trim());
    types.set(title, fields(end < 0 ? "" : part.slice(end + 1), title));
  }
  return types;
}

/** "geometry_msgs/msg/Twist" -> "geometry_msgs/Twist". */
export function short(name) {
  const parts = name.split("/");
  return parts.length > 1 ? `${parts[0]}/${parts[parts.length - 1]}` : name;
}

function fields(text, owner) {
  const found = [];
  for (const raw of text.split("\n")) {
    const line = raw.replace(/#.*$/, "").trim();
    if (!line || CONSTANT.test(line)) continue;
    const match = FIELD.exec(line);
    if (!match) throw new Error(`${owner}: cannot read the line "${raw}"`);
    const [, type, bounded, length, name] = match;
    const array = length === undefined ? "" : length !== "" && !bounded ? "fixed" : "sequence";
    found.push({ name, type: full(type, owner), array, length: array === "fixed" ? Number(length) : 0 });
  }
  return found;
}

function full(type, owner) {
  if (type in SIZES || type === "string" || type === "wstring") return type;
  if (type === "Header") return "std_msgs/Header";
  return type.includes("/") ? short(type) : `${owner.split("/")[0]}/${type}`;
}

/**
 * A function from bytes (Uint8Array, the four of the encapsulation first) to the message: arrays of numbers are typed
 * arrays.
 */
export function decoder(schema, name) {
  const read = structure(parse(schema, name), short(name), new Map());
  return (bytes) => {
    if (bytes.length < 4) throw new Error(`${name}: ${bytes.length} bytes are no message`);
    return read(new Cursor(bytes));
  };
}

class Cursor {
  constructor(bytes) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.bytes = bytes;
    this.little = (bytes[1] & 1) === 1;
    this.at = 4;
  }

  align(size) {
    this.at += (size - ((this.at - 4) % size)) % size;
  }

  number(type) {
    const size = SIZES[type];
    this.align(size);
    const value = this.view[GETTERS[type]](this.at, this.little);
    this.at += size;
    return value;
  }

  string() {
    const length = this.number("uint32");
    const text = UTF8.decode(this.bytes.subarray(this.at, this.at + Math.max(0, length - 1)));
    this.skip(length);
    return text;
  }

  wide() {
    const length = this.number("uint32");
    let text = "";
    for (let i = 0; i < length; i++) text += String.fromCharCode(this.number("uint16"));
    return text;
  }

  numbers(type, length) {
    if (length === 0) return new ARRAYS[type](0);
    const size = SIZES[type];
    this.align(size);
    const start = this.at;
    this.skip(size * length);
    if (this.little || size === 1) return new ARRAYS[type](this.bytes.slice(start, this.at).buffer);
    return ARRAYS[type].from({ length }, (_, i) => this.view[GETTERS[type]](start + size * i, false));
  }

  skip(count) {
    this.at += count;
    if (this.at > this.bytes.length)
      throw new Error(`the message ends after ${this.bytes.length} bytes, but needs ${this.at}`);
  }
}

function structure(types, name, made) {
  if (made.has(name)) return made.get(name);
  const list = types.get(name);
  if (!list) throw new Error(`there is no definition of ${name}`);
  const readers = list.map((field) => [field.name, reader(types, field, made)]);
  const read = (cursor) => {
    const message = {};
    for (const [key, next] of readers) message[key] = next(cursor);
    if (!readers.length) cursor.skip(1); // C has no empty structures: one byte stands there
    return message;
  };
  made.set(name, read);
  return read;
}

function reader(types, field, made) {
  const one = single(types, field.type, made);
  if (!field.array) return one;
  const count = field.array === "fixed" ? () => field.length : (cursor) => cursor.number("uint32");
  if (field.type in ARRAYS) return (cursor) => cursor.numbers(field.type, count(cursor));
  return (cursor) => {
    const length = count(cursor);
    if (length > cursor.bytes.length)
      throw new Error(`a sequence of ${length} does not fit into ${cursor.bytes.length} bytes`);
    const values = new Array(length);
    for (let i = 0; i < length; i++) values[i] = one(cursor);
    return values;
  };
}

function single(types, type, made) {
  if (type === "string") return (cursor) => cursor.string();
  if (type === "wstring") return (cursor) => cursor.wide();
  if (type === "bool") return (cursor) => cursor.view.getUint8(cursor.at++) !== 0;
  if (type === "int64" || type === "uint64") return (cursor) => exact(cursor.number(type));
  if (type in SIZES) return (cursor) => cursor.number(type);
  return structure(types, type, made);
}

/** A 64-bit integer as a number where that is exact. */
function exact(value) {
  return value >= -9007199254740991n && value <= 9007199254740991n ? Number(value) : value;
}

/**
 * The paths of all numeric fields of a type: "pose.position.x"; "position[]" is an array of numbers, whose index is to
 * be chosen.
 */
export function numericPaths(schema, name, limit = 200) {
  const types = parse(schema, name);
  const found = [];
  const walk = (type, prefix, depth) => {
    for (const field of types.get(type) ?? []) {
      if (found.length >= limit) return;
      const path = prefix ? `${prefix}.${field.name}` : field.name;
      if (field.type in SIZES) found.push(field.array ? `${path}[]` : path);
      else if (types.has(field.type) && depth < 6) walk(field.type, field.array ? `${path}[]` : path, depth + 1);
    }
  };
  walk(short(name), "", 0);
  return found;
}

/** The number at "a.b[2].c" of a message; NaN where there is none. */
export function valueAt(message, path) {
  let here = message;
  for (const part of path.match(/[^.[\]]+/g) ?? []) {
    if (here === null || typeof here !== "object") return NaN;
    here = here[part];
  }
  return typeof here === "number"
    ? here
    : typeof here === "boolean"
      ? Number(here)
      : typeof here === "bigint"
        ? Number(here)
        : NaN;
}
