// Reads an MCAP file with @mcap/core by its index, and from front to back; prints what it found as JSON.
import { open, readFile } from "node:fs/promises";
import { createRequire } from "node:module";

const require = createRequire(process.argv[2] + "/");
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { FileHandleReadable } = require("@mcap/nodejs");
const { loadDecompressHandlers } = require("@mcap/support");

const path = process.argv[3];
const decompressHandlers = await loadDecompressHandlers();
const handle = await open(path, "r");
const reader = await McapIndexedReader.Initialize({ readable: new FileHandleReadable(handle), decompressHandlers });
const messages = [];
for await (const one of reader.readMessages({ validateCrcs: true })) {
  const data = Buffer.from(one.data).toString("base64");
  messages.push([reader.channelsById.get(one.channelId).topic, String(one.logTime), String(one.publishTime), data]);
}
const late = [];
for await (const one of reader.readMessages({ startTime: BigInt(process.argv[4]) })) late.push(String(one.logTime));
await handle.close();

const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
stream.append(await readFile(path));
let streamed = 0;
for (let record; (record = stream.nextRecord()); ) streamed += record.type === "Message" ? 1 : 0;

const schemas = [...reader.schemasById.values()].map((one) => [one.name, one.encoding]);
const statistics = String(reader.statistics.messageCount);
console.log(JSON.stringify({ profile: reader.header.profile, schemas, statistics, messages, late, streamed, done: stream.done() }));
