// Where nodes and topics are drawn: layers from left to right, by dagre.

import { graphlib, layout as arrange } from "../vendor/dagre.js";

const WIDTH = 7.4; // px of a character
const HEIGHT = { node: 34, topic: 24 };

/** Places for [{id, kind, name, bad}] and [{from, to, bad}]: {width, height, nodes with x, y, width, height, edges with points}. */
export function layout(nodes, edges) {
  const graph = new graphlib.Graph({ multigraph: false });
  graph.setGraph({ rankdir: "LR", nodesep: 12, ranksep: 46, edgesep: 6 });
  graph.setDefaultEdgeLabel(() => ({}));
  for (const node of nodes) graph.setNode(node.id, { ...node, width: node.name.length * WIDTH + 24, height: HEIGHT[node.kind] });
  for (const edge of edges) if (graph.hasNode(edge.from) && graph.hasNode(edge.to)) graph.setEdge(edge.from, edge.to, { bad: edge.bad });
  arrange(graph);
  return {
    width: graph.graph().width || 1,
    height: graph.graph().height || 1,
    nodes: graph.nodes().map((id) => graph.node(id)),
    edges: graph.edges().map((edge) => ({ from: edge.v, to: edge.w, ...graph.edge(edge) })),
  };
}
