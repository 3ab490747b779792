"""The verbs, each in a module or package of its name."""
