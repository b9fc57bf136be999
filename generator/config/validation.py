"""Validation of documents: typed, frozen values, or error messages with their places."""

from __future__ import annotations

import json
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from gen_data.generator.config.error_messages import error_text
from gen_data.generator.config.problems import FieldPath, Position, Problems, format_path
from gen_data.generator.config.pydantic_errors import Fault, locate_error, without_union_noise
from gen_data.generator.config.yaml_tree import Node

Model = TypeVar("Model", bound=BaseModel)


def validate(
    node: Node, model: type[Model], problems: Problems, field_prefix: str = ""
) -> Model | None:
    """Validate a node of a document as a model.

    Args:
        node: Usually a mapping.
        model: The expected type.
        problems: Receives every error.
        field_prefix: Dotted path of the node in its document: ``randomizers[0]``.

    Returns:
        The instance; None if there was an error.
    """
    # Pydantic's strict mode for JSON suits YAML: it reads a list as a tuple and a string as an enum
    # member, which have no other spelling, but never a string as a number.
    try:
        return model.model_validate_json(json.dumps(node.plain(), allow_nan=False))
    except ValidationError as error:
        details = error.errors(include_url=False)
    for fault in without_union_noise([locate_error(detail, model) for detail in details]):
        path = format_path(fault.path)
        joint = "." if field_prefix and path and not path.startswith("[") else ""
        problems.add(_position(node, fault), f"{field_prefix}{joint}{path}", error_text(fault))
    return None


def _position(node: Node, fault: Fault) -> Position:
    """Position of the value; of its key if that is wrong; of its parent if it is missing."""
    path = (*fault.path, *fault.below)
    if fault.at_key and path and isinstance(path[-1], str):
        return _nearest(node, path[:-1]).key_position(path[-1])
    return _nearest(node, path).position


def _nearest(node: Node, path: FieldPath) -> Node:
    """The deepest existing node on a path."""
    for part in path:
        child = node.get(part)
        if child is None:
            break
        node = child
    return node
