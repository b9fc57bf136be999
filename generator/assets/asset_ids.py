"""Asset ids: ``family?key=value&key=value`` or a plain path such as ``pybullet/teddy``.

Values are numbers, comma-separated lists of numbers, or words. The canonical form has sorted keys
and numbers in their shortest form: equal assets have equal ids.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

from gen_data.core.errors import AssetError

ParameterValue = float | int | str | tuple[float, ...]

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.\-+]*(/[A-Za-z0-9_][A-Za-z0-9_.\-+ ]*)*")
_KEY = re.compile(r"[a-z][a-z0-9_]*")
_INTEGER = re.compile(r"[-+]?[0-9]{1,18}")
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]{1,3})?")
_WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_.\-]*")
_NAME_MAX, _LENGTH_MAX = 400, 2000
"""Names become paths; parameters hold the profiles of roads."""


@dataclass(frozen=True)
class AssetId:
    """A parsed asset id.

    Attributes:
        name: The part before ``?``.
        parameters: The part after it; empty for plain ids.
    """

    name: str
    parameters: Mapping[str, ParameterValue] = field(default_factory=dict)

    def __str__(self) -> str:
        """The canonical form."""
        return self._text

    @cached_property
    def _text(self) -> str:
        if not self.parameters:
            return self.name
        pairs = (
            f"{key}={format_parameter(self.parameters[key])}" for key in sorted(self.parameters)
        )
        return f"{self.name}?{'&'.join(pairs)}"


@lru_cache(maxsize=1024)
def parse_asset_id(text: str) -> AssetId:
    """Parse an asset id; the latest are kept, since a scene parses the id of each asset often.

    Raises:
        AssetError: if it is malformed.
    """
    name, question_mark, query = text.partition("?")
    if len(name) > _NAME_MAX or len(text) > _LENGTH_MAX or not _NAME.fullmatch(name):
        raise AssetError(
            f"asset '{text[:60]}': not an asset id; expected a name such as 'pybullet/teddy' or "
            "'mug?seed=3'"
        )
    parameters: dict[str, ParameterValue] = {}
    for pair in query.split("&") if question_mark else ():
        key, equals, value = pair.partition("=")
        if not equals or not _KEY.fullmatch(key):
            raise AssetError(f"asset '{text}': '{pair}' is not of the form key=value")
        if key in parameters:
            raise AssetError(f"asset '{text}': '{key}' is given twice")
        parameters[key] = _parse_value(text, key, value)
    return AssetId(name, parameters)


def format_parameter(value: ParameterValue) -> str:
    """Format a parameter for an id; numbers in the shortest form that parses to the same value."""
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        return ",".join(format_parameter(item) for item in value)
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return repr(value)


def _parse_value(text: str, key: str, value: str) -> ParameterValue:
    if "," in value:
        items = [_parse_number(item) for item in value.split(",")]
        if None not in items:
            return tuple(float(item) for item in items if item is not None)
    elif (number := _parse_number(value)) is not None:
        return number
    elif _WORD.fullmatch(value):
        return value
    raise AssetError(
        f"asset '{text}': {key}='{value}' is neither a number, nor numbers with commas, nor a word"
    )


def _parse_number(text: str) -> float | int | None:
    if _INTEGER.fullmatch(text):
        return int(text)
    if _NUMBER.fullmatch(text):
        number = float(text)
        return number if math.isfinite(number) else None
    return None
