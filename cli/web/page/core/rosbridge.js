// A second connection to the same port, by the rosbridge protocol: goals of actions, and services that the first one
// does not list, in JSON.

const PATIENCE = 15000; // ms until a service that does not answer is given up

export class Rosbridge {
  constructor(url) {
    this.url = url;
    this.last = 0;
    this.calls = new Map(); // id -> {resolve, reject, timer}
    this.goals = new Map(); // id -> {feedback, resolve, reject, action}
  }

  /** The open socket; it is opened when it is needed. */
  connection() {
    if (this.opening) return this.opening;
    this.opening = new Promise((resolve, reject) => {
      const socket = new WebSocket(this.url);
      socket.onopen = () => resolve(socket);
      socket.onmessage = (event) => this.heard(JSON.parse(event.data));
      socket.onclose = () => {
        this.opening = undefined;
        const lost = new Error("the connection was lost");
        reject(lost);
        for (const waiting of [...this.calls.values(), ...this.goals.values()]) waiting.reject(lost);
        this.calls.clear();
        this.goals.clear();
      };
    });
    return this.opening;
  }

  /**
   * The answer of a service, as a plain object; with its type, one that is opened only when it is asked. Rejects with
   * the reason when there is none.
   */
  async call(service, args = {}, type = undefined) {
    const socket = await this.connection();
    const id = `call:${++this.last}`;
    return new Promise((resolve, reject) => {
      const timer = setTimeout(
        () => this.calls.delete(id) && reject(new Error(`${service} does not answer`)),
        PATIENCE,
      );
      this.calls.set(id, { resolve, reject, timer });
      socket.send(JSON.stringify({ op: "call_service", id, service, type, args }));
    });
  }

  /** Start a goal: {id, result: promise of {status, values}, cancel()}; `feedback` is called with each feedback. */
  async goal(action, type, args, feedback) {
    const socket = await this.connection();
    const id = `goal:${++this.last}`;
    const result = new Promise((resolve, reject) => this.goals.set(id, { resolve, reject, feedback }));
    socket.send(JSON.stringify({ op: "send_action_goal", id, action, action_type: type, args, feedback: true }));
    return { id, result, cancel: () => socket.send(JSON.stringify({ op: "cancel_action_goal", id, action })) };
  }

  heard(message) {
    if (message.op === "action_feedback") this.goals.get(message.id)?.feedback?.(message.values);
    else if (message.op === "action_result")
      this.end(this.goals, message.id, {
        status: message.status,
        values: message.values,
        succeeded: message.status === 4,
      });
    else if (message.op === "service_response")
      this.end(this.calls, message.id, message.values, message.result ? null : message.values);
    else if (message.op === "status" && message.level === "error" && message.id) {
      this.end(this.goals, message.id, null, message.msg);
      this.end(this.calls, message.id, null, message.msg);
    }
  }

  /** End what waits under this id, with its value or with why there is none. */
  end(waiting, id, value, why = null) {
    const one = waiting.get(id);
    waiting.delete(id);
    clearTimeout(one?.timer);
    if (why === null) one?.resolve(value);
    else one?.reject(new Error(typeof why === "string" ? why : JSON.stringify(why)));
  }
}
