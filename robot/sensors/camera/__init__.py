"""The RGB-D camera: its lens, what it sees of a scene, and the node that publishes it."""
