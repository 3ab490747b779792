"""The check for overrides of parameters that a node does not have, which are usually misspelled names."""

from __future__ import annotations

from collections.abc import Container

from actors.errors import DeclarationError
from actors.parameters.declare import NO_PARAMETERS
from actors.parameters.store import ParameterStore
from actors.suggest import did_you_mean


def refuse_unknown(store: ParameterStore, owner: str, optional: Container[str] = ()) -> None:
    """Raise `DeclarationError` for the first override that the node, of class `owner`, neither declares nor allows undeclared.

    Names in `optional` are not checked.
    """
    if store.allow_undeclared:
        return
    for name in store.overrides:
        if name not in optional and not store.has(name):
            known = sorted(set(store.values) - set(NO_PARAMETERS.values))
            raise DeclarationError(
                f"{store.node} has no parameter {name!r}{did_you_mean(name, store.values) or ': correct the name, or declare it'} "
                f"({owner} declares {', '.join(known) or 'none'})"
            )
