// npm's @foxglove/ws-protocol against our server: node foxglove_client.mjs FOLDER_OF_PACKAGES URL SUBPROTOCOL. Prints what it has seen as JSON.
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";
import { join } from "node:path";

const [, , folder, url, subprotocol] = process.argv;
const require = createRequire(pathToFileURL(join(folder, "node_modules", "x.js")));
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization");
const { WebSocket } = require("ws");

const client = new FoxgloveClient({ ws: new WebSocket(url, [subprotocol]) });
const channels = new Map(), services = new Map(), seen = {};
const waiting = [];
const look = () => waiting.forEach((check) => check());
const until = (condition) => new Promise((done, failed) => {
  const check = () => { const found = condition(); if (found !== undefined) done(found); };
  waiting.push(check);
  setTimeout(() => failed(new Error(`timeout: ${condition}`)), 15000).unref();
  check();
});
const on = (name, take) => client.on(name, (event) => { take(event); look(); });
on("serverInfo", (event) => { seen.capabilities = event.capabilities; });
on("advertise", (list) => list.forEach((one) => channels.set(one.topic, one)));
on("advertiseServices", (list) => list.forEach((one) => services.set(one.name, one)));
let messages = [], responses = [], values = [], statuses = [], graphs = [], failures = [], assets = [];
on("message", (event) => messages.push(event));
on("serviceCallResponse", (event) => responses.push(event));
on("serviceCallFailure", (event) => failures.push(event));
on("parameterValues", (event) => values.push(event));
on("status", (event) => statuses.push(event));
on("connectionGraphUpdate", (event) => graphs.push(event));
on("fetchAssetResponse", (event) => assets.push(event));

const chatter = await until(() => channels.get("/chatter"));
const reader = new MessageReader(parse(chatter.schema, { ros2: true }));
const writer = new MessageWriter(parse(chatter.schema, { ros2: true }));
const subscription = client.subscribe(chatter.id);
const own = client.advertise({ topic: "/chatter", encoding: "cdr", schemaName: "std_msgs/msg/String" });
const again = setInterval(() => client.sendMessage(own, writer.writeMessage({ data: "round" })), 50);
const message = await until(() => messages.find((one) => one.subscriptionId === subscription));
clearInterval(again);
seen.message = reader.readMessage(new DataView(message.data.buffer, message.data.byteOffset, message.data.byteLength)).data;

const add = await until(() => services.get("/add"));
const request = new MessageWriter(parse(add.request.schema, { ros2: true })).writeMessage({ a: 2n, b: 40n });
client.sendServiceCallRequest({ serviceId: add.id, callId: 5, encoding: "cdr", data: new DataView(request.buffer, request.byteOffset, request.byteLength) });
const response = await until(() => responses.find((one) => one.callId === 5));
seen.sum = Number(new MessageReader(parse(add.response.schema, { ros2: true })).readMessage(response.data).sum);

client.getParameters(["/talker.speed"], "get");
seen.speed = (await until(() => values.find((one) => one.id === "get"))).parameters[0];
client.setParameters([{ name: "/talker.speed", value: 1.5 }], "set");
seen.changed = (await until(() => values.find((one) => one.id === "set"))).parameters[0].value;
client.setParameters([{ name: "/talker.speed", value: 9 }], "refuse");
seen.refused = (await until(() => statuses.find((one) => one.id === "refuse"))).message;
client.subscribeConnectionGraph();
seen.graph = (await until(() => graphs[0])).publishedTopics.find((one) => one.name === "/chatter").publisherIds;
client.fetchAsset("package://nothing/here.stl", 8);
seen.asset = (await until(() => assets.find((one) => one.requestId === 8))).status;
console.log(JSON.stringify(seen));
process.exit(0);
