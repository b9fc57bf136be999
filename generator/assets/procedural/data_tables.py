"""Tables of content: colours, words, measures and designs, in YAML files beside the modules."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

from gen_data.generator.config.data_files import load_data
from gen_data.generator.core.serialization import from_plain

T = TypeVar("T")


def load_table(package: str, name: str, kind: type[T]) -> Mapping[str, T]:
    """Rows of the file ``<name>.yaml`` of a package, by key, in the file's order.

    Args:
        package: Full name of the package.
        name: Of the file, without its ending.
        kind: Type of a row: a dataclass, or an annotation made of tuples and plain types.

    Raises:
        KeyError, TypeError: if a row has other fields than the type.
    """
    rows = load_data(package, name)
    return {key: from_plain(kind, row) for key, row in rows.items()}
