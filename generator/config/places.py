"""Where a document says something: from a text to its field and position."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from gen_data.generator.config.problems import FieldPath, Position, format_path
from gen_data.generator.config.yaml_tree import Node


def find_text(document: Node, text: str) -> tuple[Position, str] | None:
    """Position and field of the first scalar with that text; None if there is none."""
    for path, node in _scalars(document, ()):
        if text in (node.text, node.content):
            return node.position, format_path(path)
    return None


def _scalars(node: Node, path: FieldPath) -> Iterator[tuple[FieldPath, Node]]:
    """Every scalar below a node with its path, in the order of the source."""
    if isinstance(node.content, Mapping):
        for key, child in node.content.items():
            yield from _scalars(child, (*path, key))
    elif isinstance(node.content, tuple):
        for number, child in enumerate(node.content):
            yield from _scalars(child, (*path, number))
    else:
        yield path, node
