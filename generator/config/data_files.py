"""Tables in YAML files next to the modules that use them."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

import yaml

# The parser in C is ten times faster; PyYAML has it where libyaml was found.
_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def load_data(package: str | None, name: str) -> Any:
    """Plain values of the file ``<name>.yaml`` of a package.

    Args:
        package: Full name of the package; a module passes its ``__package__``.
        name: Name of the file, without its ending.
    """
    assert package is not None
    text = (files(package) / f"{name}.yaml").read_text(encoding="utf-8")
    return yaml.load(text, Loader=_LOADER)
