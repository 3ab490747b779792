// One connection to the server by the Foxglove WebSocket protocol: topics by name, messages decoded, publishing,
// services, the running system.

import { decoder } from "./cdr.js";

const RETRY = 1000; // ms until the next attempt after a connection was lost
const PATIENCE = 15000; // ms until a service that does not answer is given up
const TEXT = new TextEncoder();

/**
 * Events: "open", "close", "channels", "services", "system" (detail: the snapshot), "findings" (detail: those of the
 * doctor); of a recording "playback" (detail: {playing, ended, rate, at}),
 * "time" (detail: seconds), and "seek" (detail: seconds) when what was shown is to be forgotten. */
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
    this.wanted = new Map(); // topic -> {callbacks, newest, id, decode, count}
    this.byId = new Map(); // subscription id -> topic
    this.channelTopics = new Map(); // channel id -> topic
    this.mine = new Map(); // topic -> id of the channel by which this page publishes
    this.answers = new Map(); // id -> {resolve, reject}
    this.last = 0;
    this.wishes = new Set(); // words of this server's own that are said again on each connection
    this.open();
  }

  open() {
    const socket = (this.socket = new WebSocket(this.url, ["foxglove.sdk.v1"]));
    socket.binaryType = "arraybuffer";
    socket.onmessage = (event) =>
      typeof event.data === "string" ? this.json(JSON.parse(event.data)) : this.binary(event.data);
    socket.onclose = () => this.lost();
  }

  lost() {
    this.connected = false;
    this.channels.clear();
    this.services.clear();
    this.byId.clear();
    this.mine.clear();
    for (const want of this.wanted.values()) want.id = undefined;
    for (const id of [...this.answers.keys()]) this.settle(id, new Error("the connection was lost"));
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
    const kind = view.getUint8(0);
    if (kind === 2) this.tell("time", seconds(view, 1));
    if (kind === 3) this.answered(view);
    if (kind === 4) this.fetched(view);
    if (kind === 5) this.played(view);
    if (kind !== 1) return;
    const topic = this.byId.get(view.getUint32(1, true));
    const want = this.wanted.get(topic);
    if (!want) return;
    this.received++;
    want.count++;
    const bytes = new Uint8Array(buffer, 13);
    const at = seconds(view, 5);
    for (const callback of want.callbacks) callback(bytes, at, want);
  }

  /**
   * The messages of a topic from now on, decoded, until the returned function is called. The topic need not exist yet.
   */
  subscribe(topic, callback) {
    return this.raw(topic, false, (bytes, at, want) => {
      try {
        callback(want.decode(bytes), at);
      } catch (error) {
        this.failed(topic, error);
      }
    });
  }

  /**
   * The newest message only, decoded when it is asked for: `take()` gives it once, or null when there is none since.
   * The server leaves out
   *  those that would be older when they are sent. */
  latest(topic) {
    let bytes = null;
    let want = null;
    let at = 0;
    const keep = (data, time, from) => ([bytes, at, want] = [data, time, from]);
    keep.forget = () => (bytes = null);
    const stop = this.raw(topic, true, keep);
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

  raw(topic, newest, callback) {
    let want = this.wanted.get(topic);
    if (!want) this.wanted.set(topic, (want = { callbacks: new Set(), newest, id: undefined, decode: null, count: 0 }));
    if (want.newest && !newest) {
      want.newest = false;
      this.release(want);
    }
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
    this.send({ op: "subscribe", subscriptions: [{ id: want.id, channelId: channel.id, newest: want.newest }] });
  }

  /** Publish a message, as JSON: fields that are left out have their defaults. */
  publish(topic, type, message) {
    if (!this.connected) return;
    let id = this.mine.get(topic);
    if (id === undefined) {
      this.mine.set(topic, (id = ++this.last));
      this.send({ op: "advertise", channels: [{ id, topic, encoding: "json", schemaName: type }] });
    }
    const text = TEXT.encode(JSON.stringify(message));
    const frame = new Uint8Array(5 + text.length);
    frame[0] = 1;
    new DataView(frame.buffer).setUint32(1, id, true);
    frame.set(text, 5);
    this.socket.send(frame);
  }

  /**
   * The answer of a service, as a plain object; the request's fields that are left out have their defaults. Rejects
   * with the reason.
   */
  call(name, request = {}) {
    const service = this.services.get(name);
    if (!this.connected) return Promise.reject(new Error("not connected"));
    if (!service) return Promise.reject(new Error(`nobody serves ${name}`));
    const id = ++this.last;
    const payload = TEXT.encode(`json${JSON.stringify(request)}`);
    const frame = new Uint8Array(13 + payload.length);
    const view = new DataView(frame.buffer);
    view.setUint8(0, 2);
    view.setUint32(1, service.id, true);
    view.setUint32(5, id, true);
    view.setUint32(9, 4, true);
    frame.set(payload, 13);
    this.socket.send(frame);
    return new Promise((resolve, reject) => {
      const timer = setTimeout(() => this.settle(id, new Error(`${name} does not answer`)), PATIENCE);
      this.answers.set(id, { resolve, reject, timer });
    });
  }

  answered(view) {
    const skip = 13 + view.getUint32(9, true);
    this.settle(view.getUint32(5, true), null, JSON.parse(new TextDecoder().decode(new Uint8Array(view.buffer, skip))));
  }

  /** End what waits for an answer with this id. */
  settle(id, error, value) {
    const answer = this.answers.get(id);
    if (!answer) return;
    this.answers.delete(id);
    clearTimeout(answer.timer);
    if (error) answer.reject(error);
    else answer.resolve(value);
  }

  /**
   * Ask for the snapshot of the running system once a second, "system" events, and for what the doctor finds in it,
   * "findings".
   */
  watchSystem() {
    this.wish("robactor.subscribeSystem");
    this.wish("robactor.subscribeFindings");
  }

  wish(op) {
    this.wishes.add(op);
    if (this.connected && this.info.capabilities?.includes("robactor")) this.send({ op });
  }

  /** Let a node fail, so that its supervisor restarts it. */
  killNode(node) {
    return this.request("robactor.killNode", { node });
  }

  /** The answer to a word that asks for one. Rejects with the reason. */
  request(op, fields = {}) {
    if (!this.connected) return Promise.reject(new Error("not connected"));
    const id = ++this.last;
    this.send({ op, ...fields, id, requestId: id }); // the protocol's own words call it so
    return new Promise((resolve, reject) => this.answers.set(id, { resolve, reject }));
  }

  /** A file of a package, package://PACKAGE/path, as bytes. Rejects with the reason. */
  asset(uri) {
    return this.request("fetchAsset", { uri });
  }

  fetched(view) {
    const length = view.getUint32(6, true);
    const failed = view.getUint8(5) !== 0;
    const rest = new Uint8Array(view.buffer, 10);
    this.settle(
      view.getUint32(1, true),
      failed ? new Error(new TextDecoder().decode(rest.subarray(0, length))) : null,
      rest,
    );
  }

  // -- a recording

  /** {start, end} in seconds, and the name, if this is a recording; else null. */
  get recording() {
    const { dataStartTime: start, dataEndTime: end, metadata } = this.info;
    return start && { start: start.sec + start.nsec * 1e-9, end: end.sec + end.nsec * 1e-9, name: metadata.recording };
  }

  /** Play or stand still, at a rate; `seek` is seconds after the start. */
  control(play, rate, seek = null) {
    if (!this.connected) return;
    const id = TEXT.encode(String(++this.last));
    const frame = new Uint8Array(19 + id.length);
    const view = new DataView(frame.buffer);
    view.setUint8(0, 3);
    view.setUint8(1, play ? 0 : 1);
    view.setFloat32(2, rate, true);
    view.setUint8(6, seek === null ? 0 : 1);
    const { sec, nsec } = this.info.dataStartTime;
    view.setBigUint64(
      7,
      seek === null ? 0n : BigInt(sec) * 1000000000n + BigInt(nsec) + BigInt(Math.round(seek * 1e9)),
      true,
    );
    view.setUint32(15, id.length, true);
    frame.set(id, 19);
    this.socket.send(frame);
  }

  played(view) {
    const at = seconds(view, 2);
    if (view.getUint8(14)) {
      for (const { callbacks } of this.wanted.values()) for (const callback of callbacks) callback.forget?.();
      this.tell("seek", at);
    }
    const status = view.getUint8(1);
    this.tell("playback", { playing: status === 0, ended: status === 3, rate: view.getFloat32(10, true), at });
  }
}

/** Nanoseconds of a frame as seconds. */
function seconds(view, place) {
  return Number(view.getBigUint64(place, true)) * 1e-9;
}

const HANDLERS = {
  serverInfo(self, message) {
    self.info = message;
    if (self.connected) return; // the server can do something else than before
    self.connected = true;
    for (const op of self.wishes) self.wish(op);
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
    for (const [name, service] of self.services)
      if (message.serviceIds.includes(service.id)) self.services.delete(name);
    self.tell("services");
  },
  "robactor.system": (self, message) => self.tell("system", (self.system = message)),
  "robactor.findings": (self, message) => self.tell("findings", (self.findings = message.findings)),
  serviceCallFailure: (self, message) => self.settle(message.callId, new Error(message.message)),
  "robactor.done": (self, message) =>
    self.settle(message.id, message.error ? new Error(message.error) : null, message.value),
};
