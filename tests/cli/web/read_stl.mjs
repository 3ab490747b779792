// Reads meshes as the page does: a line of hexadecimal digits for each file, a line of JSON for what is in it.

import { createInterface } from "node:readline";
import { readStl } from "../../../cli/web/page/robot/stl.js";

for await (const line of createInterface({ input: process.stdin })) {
  try {
    console.log(JSON.stringify({ corners: [...readStl(Uint8Array.from(Buffer.from(line, "hex")))] }));
  } catch (error) {
    console.log(JSON.stringify({ error: error.message }));
  }
}
