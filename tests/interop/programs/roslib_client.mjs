// npm's roslib against our server: node roslib_client.mjs FOLDER_OF_PACKAGES URL. Prints what it has seen as JSON.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";
import { join } from "node:path";

const [, , folder, url] = process.argv;
const library = join(folder, "node_modules", "roslib");
const entry = JSON.parse(readFileSync(join(library, "package.json"))).exports["."].import;
const ROSLIB = await import(pathToFileURL(join(library, entry.default ?? entry)).href);
const seen = {};
const ros = new ROSLIB.Ros({ url });
await new Promise((done, failed) => { ros.on("connection", done); ros.on("error", failed); });
const within = (promise) => Promise.race([promise, new Promise((_, no) => setTimeout(() => no(new Error("timeout")), 15000).unref())]);
const asked = (start) => within(new Promise((done, failed) => start(done, failed)));

for (const compression of ["none", "cbor", "cbor-raw"]) {
  const topic = new ROSLIB.Topic({ ros, name: "/words", messageType: "std_msgs/msg/String", compression });
  seen[compression] = await asked((done) => {
    topic.subscribe((message) => { topic.unsubscribe(); done(message.data ?? Buffer.from(message.bytes).toString("latin1")); });
    const again = setInterval(() => topic.publish({ data: "hallo" }), 50);
    setTimeout(() => clearInterval(again), 3000);
  });
}
const add = new ROSLIB.Service({ ros, name: "/add", serviceType: "example_interfaces/srv/AddTwoInts" });
seen.sum = (await asked((done, failed) => add.callService({ a: 2, b: 40 }, done, failed))).sum;

const own = new ROSLIB.Service({ ros, name: "/of_the_browser", serviceType: "example_interfaces/srv/AddTwoInts" });
await own.advertise((request, response) => { response.sum = request.a * request.b; return true; });
const client = new ROSLIB.Service({ ros, name: "/of_the_browser", serviceType: "example_interfaces/srv/AddTwoInts" });
seen.product = (await asked((done, failed) => client.callService({ a: 6, b: 7 }, done, failed))).sum;

const action = new ROSLIB.Action({ ros, name: "/count", actionType: "example_interfaces/action/Fibonacci" });
seen.feedback = [];
seen.result = (await asked((done, failed) =>
  action.sendGoal({ order: 4 }, done, (feedback) => seen.feedback.push(feedback.sequence), failed))).sequence;

const served = new ROSLIB.Action({ ros, name: "/count_of_the_browser", actionType: "example_interfaces/action/Fibonacci" });
await served.advertise((goal, id) => {
  served.sendFeedback(id, { sequence: [goal.order] });
  served.setSucceeded(id, { sequence: [goal.order, goal.order + 1] });
}, (id) => served.setCanceled(id, { sequence: [] }));
const goals = new ROSLIB.Action({ ros, name: "/count_of_the_browser", actionType: "example_interfaces/action/Fibonacci" });
seen.browserResult = (await asked((done, failed) => goals.sendGoal({ order: 7 }, done, () => {}, failed))).sequence;

const speed = new ROSLIB.Param({ ros, name: "/talker:speed" });
seen.speed = await asked((done, failed) => speed.get(done, failed));
await asked((done, failed) => speed.set(1.5, done, failed));
seen.changed = await asked((done, failed) => speed.get(done, failed));
seen.refused = await asked((done) => speed.set(9, () => done("not refused"), (why) => done(String(why))));
seen.nodes = await asked((done, failed) => ros.getNodes(done, failed));
seen.type = await asked((done, failed) => ros.getTopicType("/chatter", done, failed));
console.log(JSON.stringify(seen));
process.exit(0);
