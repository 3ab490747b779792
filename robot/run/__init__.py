"""`python -m robot run`: the whole robot in a world, watched by a judge, with a report at the end."""

import sys

if "Robot" not in vars(sys.modules["robot"]).get("__all__", ()):
    # The package's __init__.py is Robot Framework's, which was installed over it and takes this folder for its own module `robot.run`.
    _said = (
        "Robot Framework was installed over the robot, and both are a package robot: install each in an environment of its own, or "
        "pip uninstall robotframework, then pip install --force-reinstall --no-deps robactor"
    )
    if sys.argv[0] == "-m":  # as it is while Python looks for the package that it was told to run
        sys.exit(f"robot: {_said}")
    raise ImportError(_said)
