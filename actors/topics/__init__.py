"""Topics: publishers, subscriptions, and the Protocols through which they reach peers in other processes."""
