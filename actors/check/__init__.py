"""Static checks of nodes and trees: ``python -m actors.check MODULE:TREE``."""
