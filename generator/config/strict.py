"""The base of everything that is read from YAML."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Strict(BaseModel):
    """Frozen values, exactly as declared.

    An unknown key is an error, a string is never read as a number, a boolean never as 0 or 1, and
    NaN and infinity are refused. Whole numbers are accepted where fractions are due; lists where
    tuples are due, since YAML knows only lists.
    """

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        strict=True,
        validate_default=True,
        allow_inf_nan=False,
    )
