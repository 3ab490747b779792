"""The base class `Node`, the declarations in its subclasses, and their checks."""
