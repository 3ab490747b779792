// A form for a message of any type, made from rosapi's description: [{type, fieldnames, fieldtypes, fieldarraylen,
// examples}], its own type first.

import { h, note } from "./dom.js";

const EXACT = Number.MAX_SAFE_INTEGER;
const WHOLE = {
  int8: [-128, 127],
  uint8: [0, 255],
  byte: [0, 255],
  char: [0, 255],
  int16: [-32768, 32767],
  uint16: [0, 65535],
  int32: [-(2 ** 31), 2 ** 31 - 1],
  uint32: [0, 2 ** 32 - 1],
  int64: [-EXACT, EXACT],
  uint64: [0, EXACT],
};
const TEXTS = ["string", "wstring"];
const FLAGS = ["bool", "boolean"];

/** `read()` gives the message; each field that cannot be read says why, and then there is none. */
export class Form {
  constructor(typedefs) {
    this.types = new Map(typedefs.map((one) => [short(one.type), one]));
    this.leaves = []; // {path, say(reason), input}, in the order of the form
    this.root = this.group(short(typedefs[0].type), "", []);
    this.element = h("div.stack.form", {}, ...this.root.children);
  }

  read() {
    for (const leaf of this.shown()) leaf.say("");
    const value = this.root.read();
    const wrong = this.shown().find((leaf) => leaf.wrong);
    wrong?.input.focus();
    return wrong ? undefined : value;
  }

  /** Throws the reason if the value does not fit the type. */
  fill(value) {
    this.root.fill(value);
  }

  /**
   * Put a refusal beside the field that it names: "Type.a.b: why", or any text with the name in it. Returns whether
   * there is one.
   */
  blame(text) {
    const named = /^\w+\.([\w.[\]]+): (.*)$/s.exec(text);
    const leaf = named
      ? this.shown().find(({ path }) => path === named[1] || named[1].startsWith(`${path}[`))
      : this.shown().find(({ path }) => new RegExp(`\\b${path.split(".").pop()}\\b`).test(text));
    leaf?.say(named ? named[2] : text);
    return Boolean(leaf);
  }

  shown() {
    return this.leaves.filter(({ input }) => this.element.contains(input));
  }

  /**
   * The fields of a type within those of the types `around`: {children, read, fill}. One that would hold a message of
   * such a type again, and so
   * on without an end, is left out, and so out of the message; an array of them begins empty.
   */
  group(type, path, around) {
    const { fieldnames, fieldtypes, fieldarraylen, examples } = this.types.get(type);
    const within = [...around, type];
    const fields = fieldnames
      .flatMap((name, i) => {
        const of = short(fieldtypes[i]);
        if (within.includes(of) && fieldarraylen[i] !== 0) return [];
        return [[name, this.field(of, fieldarraylen[i], examples[i], path ? `${path}.${name}` : name, within)]];
      })
      // that of the goal's own header is given when it arrives; any other stays zero, unless the goal is written as
      // JSON
      .filter(([name]) => !(type === "std_msgs/Header" && name === "stamp"));
    return {
      children: fields.map(([, field]) => field.element),
      read: () => Object.fromEntries(fields.map(([name, field]) => [name, field.read()])),
      fill: (value) => fields.forEach(([name, field]) => value?.[name] !== undefined && field.fill(value[name])),
    };
  }

  field(type, length, example, path, around) {
    const kind = length === -1 ? type : `${type}[${length || ""}]`;
    if (this.types.has(type))
      return length === -1 ? this.nested(type, kind, path, around) : this.list(type, kind, length, path, around);
    if (length === -1 && FLAGS.includes(type)) return this.flag(kind, example, path);
    const start = path.endsWith("frame_id") && !example ? "map" : length === -1 || example !== "[]" ? example : "";
    return length === -1
      ? this.text(
          kind,
          start,
          path,
          (text) => single(type, text),
          (value) => String(value ?? NaN),
        )
      : this.text(
          kind,
          plain(start),
          path,
          (text) => several(type, length, text),
          (value) => plain(array(path, value)),
        );
  }

  /** A field with one input. `read` throws the reason why there is no value, which is then beside the input. */
  leaf(kind, path, input, read, fill) {
    const why = note("span.note.reason");
    input.id = `f-${path.replace(/\W/g, "-")}-${this.leaves.length}`;
    const leaf = { path, input, wrong: false };
    leaf.say = (reason) => {
      leaf.wrong = Boolean(reason);
      why.say(reason, true);
      if (reason) input.setAttribute("aria-invalid", "true");
      else input.removeAttribute("aria-invalid");
    };
    const tried = () => {
      try {
        return read();
      } catch (error) {
        leaf.say(error.message);
      }
    };
    input.onchange = () => {
      leaf.say("");
      tried();
    };
    this.leaves.push(leaf);
    return { element: row(path, kind, input, why.element), read: tried, fill };
  }

  /** A field that is written as a text; `parse` throws the reason why a text is none, `show` is its inverse. */
  text(kind, start, path, parse, show) {
    const input = h("input.mono", { type: "text", value: start, autocomplete: "off", spellcheck: false });
    return this.leaf(
      kind,
      path,
      input,
      () => parse(input.value.trim()),
      (value) => (input.value = show(value)),
    );
  }

  flag(kind, example, path) {
    const input = h("input", { type: "checkbox", checked: example === "True" });
    return this.leaf(
      kind,
      path,
      input,
      () => input.checked,
      (value) => (input.checked = value),
    );
  }

  nested(type, kind, path, around) {
    const { children, read, fill } = this.group(type, path, around);
    return {
      element: h(
        "fieldset",
        {},
        h("legend.mono", {}, path.split(".").pop(), h("span.muted", {}, ` ${kind}`)),
        ...children,
      ),
      read,
      fill,
    };
  }

  /** Messages in an array: one may be added, and each taken out, unless their number is fixed. */
  list(type, kind, length, path, around) {
    const rows = h("div.stack");
    const items = [];
    const add = () => {
      const at = items.length;
      const item = this.nested(type, type, `${path}[${at}]`, around);
      if (!length)
        item.element.append(
          h(
            "button",
            { type: "button", onclick: () => (items.splice(items.indexOf(item), 1), item.element.remove()) },
            "Take out",
          ),
        );
      items.push(item);
      rows.append(item.element);
      return item;
    };
    for (let i = 0; i < length; i++) add();
    const element = h(
      "fieldset",
      {},
      h("legend.mono", {}, path.split(".").pop(), h("span.muted", {}, ` ${kind}`)),
      rows,
      length ? "" : h("button", { type: "button", onclick: add }, "Add one"),
    );
    const fill = (values) => {
      if (!length) {
        items.length = 0;
        rows.replaceChildren();
      }
      array(path, values).forEach((value, i) => (items[i] ?? add()).fill(value));
    };
    return { element, read: () => items.map((item) => item.read()), fill };
  }
}

function row(path, kind, input, why) {
  return h(
    "div.field",
    {},
    h("label.mono", { htmlFor: input.id }, path.split(".").pop(), h("span.muted", {}, ` ${kind}`)),
    input,
    why,
  );
}

function array(path, value) {
  if (!Array.isArray(value)) throw new Error(`${path}: an array is wanted`);
  return value;
}

function short(type) {
  return type.replace("/msg/", "/");
}

/** An array as one writes it: "1, 2, 3". */
function plain(value) {
  return typeof value === "string" ? value.replace(/^\[|\]$/g, "") : value.map((one) => one ?? NaN).join(", ");
}

function several(type, length, text) {
  const parts =
    text === ""
      ? []
      : text
          .replace(/^\[|\]$/g, "")
          .split(",")
          .map((part) => part.trim());
  if (length && parts.length !== length) throw new Error(`${length} values are wanted, these are ${parts.length}`);
  // rosapi quotes texts
  return parts.map((part) => single(type, TEXTS.includes(type) ? part.replace(/^(["'])(.*)\1$/, "$2") : part));
}

/** The value that a text stands for. Throws the reason if it is none. */
function single(type, text) {
  if (TEXTS.includes(type)) return text;
  if (FLAGS.includes(type)) {
    if (!/^(true|false|0|1)$/i.test(text)) throw new Error(`"${text}" is neither true nor false`);
    return /^(true|1)$/i.test(text);
  }
  const number = text === "" ? NaN : Number(text);
  if (!(type in WHOLE)) {
    if (/^nan$/i.test(text)) return null; // as JSON has it here
    if (!Number.isFinite(number)) throw new Error(`"${text}" is no number`);
    return number;
  }
  const [least, most] = WHOLE[type];
  if (!Number.isInteger(number)) throw new Error(`"${text}" is no whole number`);
  if (number < least || number > most) throw new Error(`from ${least} to ${most}`);
  return number;
}
