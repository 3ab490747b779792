"""Topics at work: publishers and subscriptions of one process, and what they ask of peers that are elsewhere."""
