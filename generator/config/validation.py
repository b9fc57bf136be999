"""Validation of documents: typed, frozen values, or error messages with their positions.

Pydantic finds the errors. This module traces each one back to its place in the document and to
its field, and states it in terms of the YAML file instead of pydantic's.
"""

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import BaseModel, ValidationError

from gen_data.config.distributions import MEANT, Malformed
from gen_data.config.problems import FieldPath, Position, Problems, format_path
from gen_data.config.schema import FieldSchema
from gen_data.config.yaml_scalars import quote_value, to_flow_yaml
from gen_data.config.yaml_tree import Node, is_distribution
from gen_data.core.errors import did_you_mean

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

Model = TypeVar("Model", bound=BaseModel)

_WHOLE_UNION = "whole_union"


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
    for fault in select_union_branch([locate_error(detail, model) for detail in details]):
        text = error_text(fault)
        if fault.kind == "value_error" and (part := _named_part(node, fault, text)):
            fault = replace(fault, path=(*fault.path, *part))  # noqa: PLW2901
            text = text.removeprefix(f"{'.'.join(map(str, part))}: ")
        path = format_path(fault.path)
        joint = "." if field_prefix and path and not path.startswith("[") else ""
        problems.add(_position(node, fault), f"{field_prefix}{joint}{path}", text)
    return None


def _named_part(node: Node, fault: "Fault", text: str) -> FieldPath:
    """Path from a mapping as a whole to the key with which the text of its fault begins.

    Empty if the text begins with no key of the mapping, or the mapping is a distribution.
    """
    begin = re.match(r"([a-z]\w*(?:\.\w+)*):? ", text)
    place = None if fault.below else node.get(*fault.path)
    path = begin[1].split(".") if begin else []
    if place is None or is_distribution(place) or not path:
        return ()
    return tuple(path) if place.get(*path) else ()


def _position(node: Node, fault: "Fault") -> Position:
    """Position of the value; of its key if that is wrong; of its parent if it is missing."""
    path = (*fault.path, *fault.below)
    key = path[-1] if fault.at_key and path and isinstance(path[-1], str) else None
    for part in path if key is None else path[:-1]:
        child = node.get(part)
        if child is None:
            break
        node = child
    return node.position if key is None else node.key_position(key)


@dataclass(frozen=True)
class Fault:
    """One validation error.

    Attributes:
        kind: Pydantic's type of error.
        detail: Pydantic's record of the error.
        path: Path of the field, without the names of union branches.
        below: From the field to the wrong part of its distribution.
        owner: Schema of the field; of the mapping or list, for an unknown or missing part.
        at_key: The key is wrong, not its value.
        union: The innermost union on the path, with its own path; None if there is none.
        branch: The alternative of that union that pydantic tried.
    """

    kind: str
    detail: "ErrorDetails"
    path: FieldPath
    owner: FieldSchema
    below: FieldPath = ()
    at_key: bool = False
    union: tuple[FieldPath, FieldSchema] | None = None
    branch: str = ""

    @property
    def depth(self) -> int:
        """Length of the path at which validation failed."""
        return len(self.path) + len(self.below)

    @property
    def context(self) -> dict[str, Any]:
        """Parameters of pydantic's message."""
        return self.detail.get("ctx", {})


def locate_error(detail: "ErrorDetails", model: type[BaseModel]) -> Fault:
    """Follow an error's ``loc`` through the types, and drop the names of union branches from it."""
    owner = FieldSchema.of(model)
    path: FieldPath = ()
    union: tuple[FieldPath, FieldSchema] | None = None
    branch = ""
    kind, context = detail["type"], detail.get("ctx", {})
    cause = context.get("error")
    malformed = cause if isinstance(cause, Malformed) else Malformed("")
    is_in_parent = kind in {"missing", "extra_forbidden"}
    last = len(detail["loc"]) - is_in_parent
    for number, part in enumerate(detail["loc"]):
        owner = owner.without_nothing()
        if owner.branches and isinstance(part, int):
            # An index, not the name of an alternative: a list whose text form pydantic does not
            # know, such as a file that stands for it.
            owner = next((b for b in owner.branches if b.schema.get("type") == "array"), owner)
        if owner.branches and not isinstance(part, int):
            union, branch = (path, owner), str(part)
            owner = max(owner.branches, key=lambda schema: schema.label_score(str(part)))
        elif part != "[key]":
            path = (*path, part)
            owner = owner.child(part) if number < last else owner
    if kind == "missing" and isinstance(path[-1], int):
        path = path[:-1]
    if kind == "union_tag_invalid":
        path = (*path, str(context["discriminator"]).strip("'"))
    return Fault(
        kind,
        detail,
        path,
        owner.without_nothing(),
        below=malformed.path,
        at_key=kind == "extra_forbidden" or malformed.at_key,
        union=union,
        branch=branch,
    )


def select_union_branch(faults: list[Fault]) -> Iterator[Fault]:
    """Keep the errors of the alternative of each union that the user probably meant.

    This is the alternative with the longest valid path; if all alternatives refuse the value as a
    whole, one error replaces theirs.
    """
    groups: dict[object, list[Fault]] = {}
    for number, fault in enumerate(faults):
        groups.setdefault(fault.union[0] if fault.union else number, []).append(fault)
    for group in groups.values():
        deepest = max(group, key=lambda fault: fault.depth)
        union = deepest.union
        if union is None or len({fault.branch for fault in group}) == 1:
            yield from group
        elif deepest.depth > len(union[0]):
            yield from (fault for fault in group if fault.branch == deepest.branch)
        else:
            yield Fault(_WHOLE_UNION, deepest.detail, *union)


def error_text(fault: Fault) -> str:
    """Text of the message, without position and field."""
    if fault.kind in _FACTS:
        return _FACTS[fault.kind](fault)
    if fault.kind.endswith(("_type", "_parsing", "_exact")):
        return _wrong_type(fault)
    message = fault.detail["msg"]
    return f"{message[:1].lower()}{message[1:]}, got {quote_value(fault.detail['input'])}"


def _wrong_type(fault: Fault) -> str:
    value, kind = fault.detail["input"], fault.owner.schema.get("type")
    hint = ""
    if kind == "boolean" and isinstance(value, str) and value.lower() in MEANT:
        hint = f" (did you mean {MEANT[value.lower()]}?)"
    if kind == "string" and isinstance(value, (bool, int, float)):
        hint = "; put it in quotes"
    return f"expected {fault.owner.words()}, got {quote_value(value)}{hint}"


def _out_of_range(fault: Fault) -> str:
    limits = fault.owner.limits
    within = limits.within() if limits is not None else fault.detail["msg"]
    return f"{quote_value(fault.detail['input'])} is not {within}"


def _missing(fault: Fault) -> str:
    part = fault.detail["loc"][-1]
    if isinstance(part, int):
        return f"expected {fault.owner.words()}, got {_counted(part, 'item')}"
    return f"missing key '{part}'; expected {fault.owner.child(part).words()}"


def _missing_tag(fault: Fault) -> str:
    name = fault.context["discriminator"]
    tags = [str(branch.tags[name.strip("'")]) for branch in fault.owner.branches]
    return f"missing key {name}; expected {_one_of(tags)}"


def _unknown_key(fault: Fault) -> str:
    known = list(fault.owner.fields)
    key = str(fault.path[-1])
    expected = f"expected one of {', '.join(known)}" if known else "no keys are expected here"
    return f"unknown key {quote_value(key)}; {expected}{did_you_mean(key, known)}"


def _unknown_tag(fault: Fault) -> str:
    tags = str(fault.context["expected_tags"])
    return _unknown(fault.context["tag"], [tag.strip().strip("'") for tag in tags.split(",")])


def _unknown_value(fault: Fault) -> str:
    return _unknown(fault.detail["input"], [str(value) for value in fault.owner.choices])


def _unknown(wrong: object, known: list[str]) -> str:
    near = did_you_mean(wrong, known) if isinstance(wrong, str) else ""
    return f"unknown value {quote_value(wrong)}; expected {_one_of(known)}{near}"


def _wrong_length(fault: Fault) -> str:
    unit = "character" if fault.kind.startswith("string") else "item"
    value: Any = fault.detail["input"]
    is_sized = isinstance(value, (str, list, dict))
    count = _counted(len(value), unit) if is_sized else quote_value(value)
    if "prefixItems" in fault.owner.schema:
        return f"expected {fault.owner.words()}, got {count}"
    least, most = fault.context.get("min_length"), fault.context.get("max_length")
    if least == 1:
        return "must not be empty"
    if least is not None:
        return f"expected at least {_counted(least, unit)}, got {count}"
    return f"expected at most {_counted(most, unit)}, got {count}"


def _wrong_pattern(fault: Fault) -> str:
    value = quote_value(fault.detail["input"])
    return f"{value} does not match the pattern {fault.context['pattern']}"


def _one_of(known: list[str]) -> str:
    words = ", ".join(to_flow_yaml(k) for k in known)
    return words if len(known) == 1 else f"one of {words}"


def _counted(count: object, unit: str) -> str:
    return f"{count} {unit}" if count == 1 else f"{count} {unit}s"


_FACTS: dict[str, Callable[[Fault], str]] = {
    "value_error": lambda fault: str(fault.context["error"]),
    "assertion_error": lambda fault: str(fault.context["error"]),
    "missing": _missing,
    "extra_forbidden": _unknown_key,
    "literal_error": _unknown_value,
    "enum": _unknown_value,
    "union_tag_invalid": _unknown_tag,
    "union_tag_not_found": _missing_tag,
    "string_pattern_mismatch": _wrong_pattern,
    **dict.fromkeys(("whole_union", "int_from_float", "is_instance_of"), _wrong_type),
    **dict.fromkeys(("greater_than", "greater_than_equal"), _out_of_range),
    **dict.fromkeys(("less_than", "less_than_equal"), _out_of_range),
    **dict.fromkeys(("too_short", "too_long"), _wrong_length),
    **dict.fromkeys(("string_too_short", "string_too_long"), _wrong_length),
}
