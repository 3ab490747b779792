"""What clients see of a graph, and do in it: topics, types, parameters, nodes, findings."""
