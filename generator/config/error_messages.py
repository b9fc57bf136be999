"""What is wrong and what was expected, in our own words instead of pydantic's."""

from __future__ import annotations

import typing
from collections.abc import Callable
from enum import Enum
from typing import Any

from gen_data.generator.config.pydantic_errors import Fault, child_type, literal_tags
from gen_data.generator.config.type_names import (
    describe_type,
    numeric_bounds,
    union_branches,
    unwrap_annotated,
)
from gen_data.generator.config.yaml_scalars import quote_value, to_flow_yaml
from gen_data.generator.core.errors import did_you_mean

_MEANT = {"yes": "true", "on": "true", "no": "false", "off": "false"}


def error_text(fault: Fault) -> str:
    """One clause for the message, without place and field."""
    if fault.kind in _FACTS:
        return _FACTS[fault.kind](fault)
    if fault.kind.endswith(("_type", "_parsing", "_exact")):
        return _wrong_type(fault)
    message = fault.detail["msg"]
    return f"{message[:1].lower()}{message[1:]}, got {quote_value(fault.detail['input'])}"


def _own_words(fault: Fault) -> str:
    return str(fault.context["fact"])


def _of_validator(fault: Fault) -> str:
    return str(fault.context["error"])


def _wrong_type(fault: Fault) -> str:
    value, annotation = fault.detail["input"], fault.owner[0]
    hint = ""
    if annotation is bool and isinstance(value, str) and value.lower() in _MEANT:
        hint = f" (did you mean {_MEANT[value.lower()]}?)"
    if annotation is str and isinstance(value, (bool, int, float)):
        hint = "; put it in quotes"
    return f"expected {describe_type(*fault.owner)}, got {quote_value(value)}{hint}"


def _out_of_range(fault: Fault) -> str:
    limits = numeric_bounds(fault.owner[1])
    within = limits.within() if limits is not None else fault.detail["msg"]
    return f"{quote_value(fault.detail['input'])} is not {within}"


def _missing(fault: Fault) -> str:
    part = fault.detail["loc"][-1]
    if isinstance(part, int):
        return f"expected {describe_type(*fault.owner)}, got {_counted(part, 'item')}"
    return f"missing key '{part}'; expected {describe_type(*child_type(fault.owner[0], part))}"


def _missing_tag(fault: Fault) -> str:
    tags = [
        tag
        for branch in union_branches(fault.owner[0])
        for tag in literal_tags(unwrap_annotated(branch)[0])
    ]
    return f"missing key {fault.context['discriminator']}; expected {_one_of(tags)}"


def _unknown_key(fault: Fault) -> str:
    known = list(getattr(fault.owner[0], "model_fields", {}))
    key = str(fault.path[-1])
    expected = f"expected one of {', '.join(known)}" if known else "no keys are expected here"
    return f"unknown key {quote_value(key)}; {expected}{did_you_mean(key, known)}"


def _unknown_tag(fault: Fault) -> str:
    tags = str(fault.context["expected_tags"])
    return _unknown(fault.context["tag"], [tag.strip().strip("'") for tag in tags.split(",")])


def _unknown_value(fault: Fault) -> str:
    annotation = fault.owner[0]
    if isinstance(annotation, type) and issubclass(annotation, Enum):
        return _unknown(fault.detail["input"], [str(member.value) for member in annotation])
    return _unknown(fault.detail["input"], [str(v) for v in typing.get_args(annotation)])


def _unknown(wrong: object, known: list[str]) -> str:
    near = did_you_mean(wrong, known) if isinstance(wrong, str) else ""
    return f"unknown value {quote_value(wrong)}; expected {_one_of(known)}{near}"


def _wrong_length(fault: Fault) -> str:
    unit = "character" if fault.kind.startswith("string") else "item"
    value: Any = fault.detail["input"]
    annotation: Any = fault.owner[0]
    count = (
        _counted(len(value), unit) if isinstance(value, (str, list, dict)) else quote_value(value)
    )
    if _has_fixed_length(annotation):
        return f"expected {describe_type(*fault.owner)}, got {count}"
    least, most = fault.context.get("min_length"), fault.context.get("max_length")
    if least == 1:
        return "must not be empty"
    if least is not None:
        return f"expected at least {_counted(least, unit)}, got {count}"
    return f"expected at most {_counted(most, unit)}, got {count}"


def _has_fixed_length(annotation: Any) -> bool:
    return typing.get_origin(annotation) is tuple and Ellipsis not in typing.get_args(annotation)


def _wrong_pattern(fault: Fault) -> str:
    return (
        f"{quote_value(fault.detail['input'])} does not match the pattern "
        f"{fault.context['pattern']}"
    )


def _one_of(known: list[str]) -> str:
    return (
        to_flow_yaml(known[0])
        if len(known) == 1
        else f"one of {', '.join(to_flow_yaml(k) for k in known)}"
    )


def _counted(count: object, unit: str) -> str:
    return f"{count} {unit}" if count == 1 else f"{count} {unit}s"


_FACTS: dict[str, Callable[[Fault], str]] = {
    "fact": _own_words,
    "value_error": _of_validator,
    "assertion_error": _of_validator,
    "missing": _missing,
    "extra_forbidden": _unknown_key,
    "literal_error": _unknown_value,
    "enum": _unknown_value,
    "union_tag_invalid": _unknown_tag,
    "union_tag_not_found": _missing_tag,
    "whole_union": _wrong_type,
    "int_from_float": _wrong_type,
    "is_instance_of": _wrong_type,
    "greater_than": _out_of_range,
    "greater_than_equal": _out_of_range,
    "less_than": _out_of_range,
    "less_than_equal": _out_of_range,
    "too_short": _wrong_length,
    "too_long": _wrong_length,
    "string_too_short": _wrong_length,
    "string_too_long": _wrong_length,
    "string_pattern_mismatch": _wrong_pattern,
}
