"""The base of everything that is read from YAML."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from pydantic import BaseModel, ConfigDict


class Strict(BaseModel):
    """Frozen values, exactly as declared.

    An unknown key is an error, a string is never read as a number, a boolean never as 0 or 1, and
    NaN and infinity are refused. Whole numbers are accepted where fractions are due; lists where
    tuples are due, since YAML knows only lists.

    Attributes:
        former_keys: Former names of fields, and their present ones; documents may still use them.
        moved_keys: Keys that other models have now, and their places in a configuration.
    """

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        strict=True,
        validate_default=True,
        allow_inf_nan=False,
    )

    former_keys: ClassVar[Mapping[str, str]] = {}
    moved_keys: ClassVar[Mapping[str, str]] = {}
