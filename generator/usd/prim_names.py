"""Names of prims."""

from __future__ import annotations

from itertools import chain, count


def unique_name(name: str, taken: set[str]) -> str:
    """A valid identifier that tells the name and is not taken; it is taken from now on."""
    from pxr import Tf

    base = str(Tf.MakeValidIdentifier(name))
    candidates = chain([base], (f"{base}_{k}" for k in count(2)))
    chosen = next(c for c in candidates if c not in taken)
    taken.add(chosen)
    return chosen
