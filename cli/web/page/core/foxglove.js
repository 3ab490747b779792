// One connection to the server by the Foxglove WebSocket protocol: topics by name, messages decoded, client publish, parameters, the running system.

import { decoder } from "./cdr.js";

const RETRY = 1000; // ms until the next attempt after a connection was lost

/** Events: "open", "close", "channels", "services", "parameters" (detail: the values), "status" (detail: {level, message, id}), "system" (detail: the snapshot). */
export class Foxglove extends EventTarget {
  constructor(url) {
    super();
    this.url = url;
    this.connected = false;
    this.info = {};
    this.channels = new Map(); // topic -> channel
    this.services = new Map(); // name -> service
    this.errors = 0; // messages that could not be decoded
    this.received = 0;
    this.wanted = new Map(); // topic -> {callbacks, id, channelId}
    this.byId = new Map(); // subscription id -> topic
    this.channelTopics = new Map(); // channel id -> topic
    this.mine = new Map(); // topic -> id of the channel by which this page publishes
    this.answers = new Map(); // id -> {resolve, reject}
    this.last = 0;
    this.systemWanted = false;
    this.open();
  }

  open() {
    const socket = (this.socket = new WebSocket(this.url, ["foxglove.sdk.v1"]));
    socket.binaryType = "arraybuffer";
    socket.onmessage = (event) => (typeof event.data === "string" ? this.json(JSON.parse(event.data)) : this.binary(event.data));
    socket.onclose = () => this.lost();
  }

  lost() {
    this.connected = false;
    this.channels.clear();
    this.services.clear();
    this.byId.clear();
    this.mine.clear();
    for (const want of this.wanted.values()) want.id = undefined;
    for (const { reject } of this.answers.values()) reject(new Error("the connection was lost"));
    this.answers.clear();
    this.tell("close");
    setTimeout(() => this.open(), RETRY);
  }

  tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  json(message) {
    const handler = HANDLERS[message.op];
    if (handler) handler(this, message);
  }

  binary(buffer) {
    const view = new DataView(buffer);
    if (view.getUint8(0) !== 1) return;
    const topic = this.byId.get(view.getUint32(1, true));
    const want = this.wanted.get(topic);
    if (!want) return;
    this.received++;
    want.count++;
    const bytes = new Uint8Array(buffer, 13);
    const at = Number(view.getBigUint64(5, true)) * 1e-9;
    for (const callback of want.callbacks) callback(bytes, at, want);
  }

  /** The messages of a topic from now on, decoded, until the returned function is called. The topic need not exist yet. */
  subscribe(topic, callback) {
    return this.raw(topic, (bytes, at, want) => {
      try {
        callback(want.decode(bytes), at);
      } catch (error) {
        this.failed(topic, error);
      }
    });
  }

  /** The newest message only, decoded when it is asked for: `take()` gives it once, or null when there is none since. */
  latest(topic) {
    let bytes = null;
    let want = null;
    let at = 0;
    const stop = this.raw(topic, (data, time, from) => ([bytes, at, want] = [data, time, from]));
    const take = () => {
      if (bytes === null) return null;
      const data = bytes;
      bytes = null;
      try {
        return want.decode(data);
      } catch (error) {
        this.failed(topic, error);
        return null;
      }
    };
    return { take, stop, at: () => at };
  }

  failed(topic, error) {
    if (this.errors++ === 0) console.warn(`${topic}: ${error.message}`);
  }

  raw(topic, callback) {
    let want = this.wanted.get(topic);
    if (!want) this.wanted.set(topic, (want = { callbacks: new Set(), id: undefined, decode: null, count: 0 }));
    want.callbacks.add(callback);
    this.ask(topic, want);
    return () => {
      want.callbacks.delete(callback);
      if (want.callbacks.size || this.wanted.get(topic) !== want) return;
      this.wanted.delete(topic);
      this.release(want);
    };
  }

  release(want) {
    if (want.id === undefined) return;
    this.byId.delete(want.id);
    this.send({ op: "unsubscribe", subscriptionIds: [want.id] });
    want.id = undefined;
  }

  ask(topic, want) {
    const channel = this.channels.get(topic);
    if (!channel || want.id !== undefined) return;
    want.decode = decoder(channel.schema, channel.schemaName);
    want.id = ++this.last;
    this.byId.set(want.id, topic);
    this.send({ op: "subscribe", subscriptions: [{ id: want.id, channelId: channel.id }] });
  }

  /** Publish a message, as JSON: fields that are left out have their defaults. */
  publish(topic, type, message) {
    if (!this.connected) return;
    let id = this.mine.get(topic);
    if (id === undefined) {
      this.mine.set(topic, (id = ++this.last));
      this.send({ op: "advertise", channels: [{ id, topic, encoding: "json", schemaName: type }] });
    }
    const text = new TextEncoder().encode(JSON.stringify(message));
    const frame = new Uint8Array(5 + text.length);
    frame[0] = 1;
    new DataView(frame.buffer).setUint32(1, id, true);
    frame.set(text, 5);
    this.socket.send(frame);
  }

  /** Ask for the snapshot of the running system once a second: "system" events. */
  watchSystem() {
    this.systemWanted = true;
    if (this.connected && this.info.capabilities?.includes("robactor")) this.send({ op: "robactor.subscribeSystem" });
  }

  /** Let a node fail, so that its supervisor restarts it. */
  killNode(node) {
    const id = ++this.last;
    this.send({ op: "robactor.killNode", node, id });
    return new Promise((resolve, reject) => this.answers.set(id, { resolve, reject }));
  }

  getParameters() {
    this.send({ op: "getParameters", parameterNames: [], id: `p${++this.last}` });
  }
}

const HANDLERS = {
  serverInfo(self, message) {
    self.info = message;
    self.connected = true;
    if (self.systemWanted) self.watchSystem();
    self.tell("open", message);
  },
  advertise(self, message) {
    for (const channel of message.channels) {
      self.channels.set(channel.topic, channel);
      self.channelTopics.set(channel.id, channel.topic);
      const want = self.wanted.get(channel.topic);
      if (want) self.ask(channel.topic, want);
    }
    self.tell("channels");
  },
  unadvertise(self, message) {
    for (const id of message.channelIds) {
      const topic = self.channelTopics.get(id);
      const want = self.wanted.get(topic);
      if (want) self.release(want);
      self.channelTopics.delete(id);
      self.channels.delete(topic);
    }
    self.tell("channels");
  },
  advertiseServices(self, message) {
    for (const service of message.services) self.services.set(service.name, service);
    self.tell("services");
  },
  unadvertiseServices(self, message) {
    for (const [name, service] of self.services) if (message.serviceIds.includes(service.id)) self.services.delete(name);
    self.tell("services");
  },
  parameterValues: (self, message) => self.tell("parameters", message.parameters),
  status: (self, message) => self.tell("status", message),
  "robactor.system": (self, message) => self.tell("system", (self.system = message)),
  "robactor.done"(self, message) {
    const answer = self.answers.get(message.id);
    self.answers.delete(message.id);
    if (message.error) answer?.reject(new Error(message.error));
    else answer?.resolve();
  },
};
