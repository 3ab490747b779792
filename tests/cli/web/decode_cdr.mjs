// Reads lines {schema, type, hex} and writes what the page's decoder makes of them, one line each: numbers that JSON has not as text.
import { createInterface } from "node:readline";
import { decoder, numericPaths, valueAt } from "../../../cli/web/page/core/cdr.js";

function plain(value) {
  if (typeof value === "number") {
    if (Object.is(value, -0)) return "number -0";
    if (!Number.isFinite(value)) return `number ${value}`;
    return Number.isInteger(value) && !Number.isSafeInteger(value) ? `number ${value.toExponential(17)}` : value;
  }
  if (typeof value === "bigint") return `integer ${value}`;
  if (ArrayBuffer.isView(value) || Array.isArray(value)) return Array.from(value, plain);
  if (value && typeof value === "object") return Object.fromEntries(Object.entries(value).map(([key, one]) => [key, plain(one)]));
  return value;
}

for await (const line of createInterface({ input: process.stdin })) {
  const { schema, type, hex } = JSON.parse(line);
  let answer;
  try {
    const message = decoder(schema, type)(new Uint8Array(Buffer.from(hex, "hex")));
    const numbers = Object.fromEntries(numericPaths(schema, type).map((path) => [path, plain(valueAt(message, path.replaceAll("[]", "[0]")))]));
    answer = { message: plain(message), numbers };
  } catch (error) {
    answer = { error: error.message };
  }
  console.log(JSON.stringify(answer));
}
