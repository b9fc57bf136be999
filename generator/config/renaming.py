"""Documents that were written for an earlier release: keys with new names, keys with new places."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

from pydantic import BaseModel

from gen_data.generator.config.base_model import Strict
from gen_data.generator.config.problems import Position, Problems
from gen_data.generator.config.pydantic_errors import child_type
from gen_data.generator.config.yaml_tree import Node


class RenamedKeyWarning(UserWarning):
    """A document has a key by its former name."""


def with_present_keys(
    node: Node, model: type[BaseModel], problems: Problems, field_prefix: str = ""
) -> Node:
    """A document with all keys by their present names, at their own positions.

    Args:
        node: Usually a mapping.
        model: What it is read as; its own and its fields' ``former_keys`` and ``moved_keys`` hold.
        problems: Receives the keys that have moved elsewhere; they are left out.
        field_prefix: Dotted path of the node in its document.
    """
    if not (isinstance(node.content, Mapping) and issubclass(model, Strict)):
        return node
    content: dict[str, Node] = {}
    positions: dict[str, Position] = {}
    for key, child in node.content.items():
        field = f"{field_prefix}.{key}" if field_prefix else key
        if key in model.moved_keys:
            problems.add(node.key_position(key), field, f"has moved to {model.moved_keys[key]}")
            continue
        name = model.former_keys.get(key, key)
        if name != key and name in node.content:
            name = key
        if name != key:
            text = f"{node.key_position(key)}: {field}: deprecated key; it is now '{name}'"
            warnings.warn(text, RenamedKeyWarning, stacklevel=2)
        annotation = child_type(model, name)[0]
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            child = with_present_keys(child, annotation, problems, field)  # noqa: PLW2901
        content[name], positions[name] = child, node.key_position(key)
    return Node(node.position, content, positions)
