"""Tables in YAML files next to the modules that use them."""

from collections.abc import Mapping
from importlib.resources import files
from typing import Any, TypeVar

import yaml

from gen_data.core.serialization import from_plain

T = TypeVar("T")

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


def load_table(package: str, name: str, kind: type[T]) -> Mapping[str, T]:
    """Rows of the file ``<name>.yaml`` of a package, by key, in the file's order.

    Args:
        package: Full name of the package.
        name: File name without its ending.
        kind: Type of a row: a dataclass, or an annotation made of tuples and plain types.

    Raises:
        KeyError, TypeError: if a row has other fields than the type.
    """
    rows = load_data(package, name)
    return {key: from_plain(kind, row) for key, row in rows.items()}
