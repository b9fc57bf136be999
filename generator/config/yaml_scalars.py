"""Parsing and formatting of scalars of the YAML 1.2 core schema.

Source: YAML 1.2.2, section 10.3.2. ``no`` and ``1:30`` are strings, ``010`` is ten, ``1e3`` is a
float. NaN and infinity, which the schema allows, are refused.
"""

import json
import math
import re
from collections.abc import Mapping
from typing import Any

PlainScalar = str | int | float | bool | None

_NULL = frozenset({"", "~", "null", "Null", "NULL"})
_BOOL = {
    "true": True, "True": True, "TRUE": True,
    "false": False, "False": False, "FALSE": False,
}  # fmt: skip
_INT = re.compile(r"[-+]?[0-9]+")
_OCTAL = re.compile(r"0o[0-7]+")
_HEX = re.compile(r"0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")

_SAFE_TEXT = re.compile(r"[A-Za-z_][A-Za-z0-9_./@?=-]*")
_MAX_INT_DIGITS = 32


def resolve_scalar(text: str) -> PlainScalar:
    """The value of an unquoted scalar.

    Raises:
        ValueError: a number is not finite, or needs more than 64 bits.
    """
    if text in _NULL:
        return None
    if text in _BOOL:
        return _BOOL[text]
    if _NOT_FINITE.fullmatch(text):
        raise ValueError(f"{text} is not a finite number")
    if _INT.fullmatch(text):
        return _parse_integer(text, 10)
    if _OCTAL.fullmatch(text):
        return _parse_integer(text[2:], 8)
    if _HEX.fullmatch(text):
        return _parse_integer(text[2:], 16)
    if _FLOAT.fullmatch(text):
        value = float(text)
        if not math.isfinite(value):
            raise ValueError(f"{abbreviate(text)} is too large for a number")
        return value
    return text


def to_flow_yaml(value: Any) -> str:
    """Format a plain value as YAML on one line, which reads back as an equal value."""
    if isinstance(value, str):
        if _SAFE_TEXT.fullmatch(value) and resolve_scalar(value) == value:
            return value
        return json_as_yaml(value)
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, (int, float)):
        return format_number(value)
    if isinstance(value, Mapping):
        return (
            "{"
            + ", ".join(f"{to_flow_yaml(str(k))}: {to_flow_yaml(v)}" for k, v in value.items())
            + "}"
        )
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(to_flow_yaml(item) for item in value) + "]"
    raise TypeError(f"{type(value).__name__} has no YAML form")


def json_as_yaml(value: Any) -> str:
    """A plain value as JSON that is also YAML: characters that no document may have are escaped.

    Numbers keep their form: ``5.0`` has a fraction, ``5`` has none.
    """
    return json.dumps(value, ensure_ascii=False).translate(_ESCAPES)


_ESCAPES = {code: f"\\u{code:04x}" for code in (0x2028, 0x2029, 0xFEFF)}
"""Line and paragraph separators, and the byte order mark."""


def format_number(value: float) -> str:
    """Shortest text that reads back as the same number; whole floats have no fraction."""
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return repr(value)


def quote_value(value: Any) -> str:
    """Format a value for an error message: strings in single quotes, long ones truncated."""
    if isinstance(value, str):
        return f"'{abbreviate(value)}'"
    if value is None:
        return "nothing"
    return abbreviate(to_flow_yaml(value))


def abbreviate(text: str, length: int = 60) -> str:
    """At most ``length`` characters of a text, on one line; unprintable characters are escaped."""
    start = text if len(text) <= length else text[: length - 3] + "..."
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in start)


def _parse_integer(digits: str, base: int) -> int:
    # The length is checked first: int() is quadratic, and refuses 4,301 digits with its own error.
    if len(digits.lstrip("+-0")) <= _MAX_INT_DIGITS * 2:
        value = int(digits, base)
        if abs(value) < 2**63:
            return value
    raise ValueError(f"{abbreviate(digits)} is too large for a whole number (64 bits)")
