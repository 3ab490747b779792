// Where nodes and topics are drawn: layers from left to right, by dagre.

import { graphlib, layout as arrange } from "../vendor/dagre.js";

const WIDTH = 7.8; // px of a character
const HEIGHT = { node: 34, topic: 24 };

/**
 * Places for [{id, kind, name, bad}] and [{from, to, bad}], in the direction that fills a place of this shape (width /
 * height) better.
 */
export function layout(nodes, edges, shape) {
  if (!nodes.length) return { width: 1, height: 1, nodes, edges: [] }; // of nothing dagre makes something infinite
  const both = ["LR", "TB"].map((direction) => arranged(nodes, edges, direction));
  const size = ({ width, height }) => Math.max(width / shape, height);
  return size(both[0]) <= size(both[1]) ? both[0] : both[1];
}

/** {width, height, nodes with x, y, width, height, edges with points}. */
function arranged(nodes, edges, rankdir) {
  const graph = new graphlib.Graph({ multigraph: false });
  graph.setGraph({ rankdir, nodesep: 14, ranksep: 40, edgesep: 6, ranker: "tight-tree" });
  graph.setDefaultEdgeLabel(() => ({}));
  for (const node of nodes)
    graph.setNode(node.id, { ...node, width: node.name.length * WIDTH + 22, height: HEIGHT[node.kind] });
  for (const edge of edges)
    if (graph.hasNode(edge.from) && graph.hasNode(edge.to)) graph.setEdge(edge.from, edge.to, { bad: edge.bad });
  arrange(graph);
  return {
    width: Math.max(1, graph.graph().width || 1), // without a node it is below nothing
    height: Math.max(1, graph.graph().height || 1),
    nodes: graph.nodes().map((id) => graph.node(id)),
    edges: graph.edges().map((edge) => ({ from: edge.v, to: edge.w, ...graph.edge(edge) })),
  };
}
