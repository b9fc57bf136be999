"""From a document to typed, frozen values; every fault is told at its place, in plain words."""

from __future__ import annotations

import json
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from gen_data.generator.config.error_messages import error_text
from gen_data.generator.config.problems import FieldPath, Position, Problems, format_path
from gen_data.generator.config.pydantic_errors import Fault, locate_error, without_union_noise
from gen_data.generator.config.renaming import with_present_keys
from gen_data.generator.config.yaml_tree import Node

Model = TypeVar("Model", bound=BaseModel)


def validate(
    node: Node, model: type[Model], problems: Problems, field_prefix: str = ""
) -> Model | None:
    """The model that a node of a document stands for.

    Args:
        node: Usually a mapping.
        model: What it is read as.
        problems: Receives every fault that is found.
        field_prefix: Dotted path of the node in its document: ``randomizers[0]``.

    Returns:
        An instance; None where there was a problem.
    """
    node = with_present_keys(node, model, problems, field_prefix)
    # In JSON mode, strictness means what YAML needs: a list is a tuple's only spelling and a
    # string an enum's, but a string is still no number.
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
    """Of the value; of the key where that is at fault; of what holds it where it is missing."""
    path = (*fault.path, *fault.below)
    if fault.at_key and path and isinstance(path[-1], str):
        return _nearest(node, path[:-1]).key_position(path[-1])
    return _nearest(node, path).position


def _nearest(node: Node, path: FieldPath) -> Node:
    """The last node on the way that exists."""
    for part in path:
        child = node.get(part)
        if child is None:
            break
        node = child
    return node
