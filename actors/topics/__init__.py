"""Topics at work: publishers and subscriptions of one process."""
