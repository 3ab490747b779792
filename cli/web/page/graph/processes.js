// Where nodes run: the machines and processes of a system, each with its nodes and what has been exchanged with it.

import { h } from "../core/dom.js";

const HIDDEN = /(^|\/)_/;

/**
 * The groups of a system's snapshot, the main process first: {host, process, nodes: names, link: what is exchanged
 * with it, or undefined}.
 */
export function processes(system) {
  const groups = new Map();
  for (const { name, host, process } of system.nodes) {
    if (HIDDEN.test(name)) continue;
    const key = `${host} ${process}`;
    if (!groups.has(key))
      groups.set(key, {
        host,
        process,
        nodes: [],
        link: system.links.find((link) => link.host === host && link.process === process),
      });
    groups.get(key).nodes.push(name);
  }
  return [...groups.values()].sort((a, b) => a.host.localeCompare(b.host) || a.process - b.process);
}

/** A list of the groups; nothing where all nodes are in one. `open` makes the element of a node's name. */
export function processList(system, open) {
  const groups = processes(system);
  if (groups.length < 2) return "";
  return h(
    "ul.plain",
    { "aria-label": "Hosts and processes" },
    ...groups.map(({ host, process, nodes, link }) =>
      h(
        "li",
        {},
        h("b.mono", {}, [host, process || ""].filter(Boolean).join(" ") || "main process"),
        ` ${nodes.length} node${nodes.length > 1 ? "s" : ""} `,
        link
          ? h("span.muted", {}, `${kilobytes(link.sent_bytes)} sent, ${kilobytes(link.received_bytes)} received`)
          : "",
        link?.dropped ? h("b.warn", {}, ` ${link.dropped} dropped`) : "",
        h("div.names", {}, ...nodes.map(open)),
      ),
    ),
  );
}

function kilobytes(bytes) {
  return bytes < 1e6 ? `${Math.round(bytes / 1e3)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}
