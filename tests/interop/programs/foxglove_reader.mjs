// npm's @foxglove/ws-protocol reads a recording: node foxglove_reader.mjs FOLDER_OF_PACKAGES URL SUBPROTOCOL. Prints what it has seen as JSON.
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";
import { join } from "node:path";

const [, , folder, url, subprotocol] = process.argv;
const require = createRequire(pathToFileURL(join(folder, "node_modules", "x.js")));
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const { WebSocket } = require("ws");

const client = new FoxgloveClient({ ws: new WebSocket(url, [subprotocol]) });
const readers = new Map(), values = { "/count": [], "/map": [] }, errors = [];
let playback;
client.on("error", (error) => errors.push(String(error)));
client.on("serverInfo", (info) => (playback = info.capabilities.includes("playbackControl")));
client.on("advertise", (channels) => channels.filter(({ topic }) => topic in values).forEach((channel) =>
  readers.set(client.subscribe(channel.id), { topic: channel.topic, reader: new MessageReader(parse(channel.schema, { ros2: true })) })));
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const { topic, reader } = readers.get(subscriptionId);
  values[topic].push({ at: timestamp, value: reader.readMessage(data).data });
  const counts = values["/count"];
  if (counts.length < 3 || !values["/map"].length) return;
  const rising = counts.every((one, i) => !i || (one.value === counts[i - 1].value + 1 && one.at - counts[i - 1].at === 1000000000n));
  console.log(JSON.stringify({ errors, first: counts[0].value, rising, map: values["/map"][0].value, playback }));
  process.exit(0);
});
