"""Contracts: what a topic, a service, an action is called, and of which type it is. No behaviour."""
