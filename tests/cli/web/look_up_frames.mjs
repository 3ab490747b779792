// Reads one JSON of {insert: [TFMessage], ask: [[target, frame, stamp or null]]} and writes what the page's frames answer.
import { readFileSync } from "node:fs";
import { FrameTree } from "../../../cli/web/page/robot/frames.js";

const { insert, ask } = JSON.parse(readFileSync(0, "utf8"));
const tree = new FrameTree();
for (const message of insert) tree.insert(message);
process.stdout.write(JSON.stringify(ask.map(([target, frame, stamp]) => tree.lookup(target, frame, stamp ?? undefined))));
