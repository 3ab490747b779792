"""A passive look at nodes and trees before they run: ``python -m actors.check MODULE:TREE``."""
