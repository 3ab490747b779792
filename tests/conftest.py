"""What all tests share: the virtual clock and the `rig` of `actors.testing`, also where the package is not installed."""

pytest_plugins = ["actors.testing.plugin", "pytester"]
