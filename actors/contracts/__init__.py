"""Contracts: the names and types of topics, services and actions, and the decorators that declare their handlers."""
