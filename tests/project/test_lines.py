"""How lines of code are counted."""

from __future__ import annotations

from tests.lines import lines_of_code

MODULE = '''"""A docstring
of two lines."""

import math  # a comment behind code


def area(radius: float) -> float:
    """Its docstring."""
    # a comment
    text = """a text
    of two lines"""
    return math.pi * (
        radius ** 2
    )
'''


def test_blank_lines_comments_and_docstrings_are_no_code() -> None:
    assert lines_of_code(MODULE) == 7  # import, def, the text's two, the return's three


def test_an_empty_module_has_no_code() -> None:
    assert lines_of_code("") == 0
    assert lines_of_code('"""Only a docstring."""\n') == 0
