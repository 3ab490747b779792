"""What all tests share: the virtual clock and the `rig` of `actors.testing`, also where the package is not installed."""

pytest_plugins = ["actors.testing.plugin", "pytester"]

from hypothesis import settings  # noqa: E402  # after the environment is set

settings.register_profile("repeatable", derandomize=True)
settings.register_profile("explore", derandomize=False, max_examples=1000)
settings.load_profile(
    "repeatable"
)  # the suite run twice gives the same result; pytest --hypothesis-profile=explore looks further
