from argparse import ArgumentParser


def no_arguments(text: str | None) -> None:
    """Refuse arguments in one line; `--help` shows `text`, the docstring of a program, which begins with its command."""
    command, _, rest = (text or "").partition(": ")
    ArgumentParser(prog=command.strip("`"), description=rest.strip()).parse_args()
