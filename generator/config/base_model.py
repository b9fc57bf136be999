"""Base class of all models that are read from YAML."""

from pydantic import BaseModel, ConfigDict

NAME_PATTERN = r"^[A-Za-z][A-Za-z0-9_-]{0,63}$"
"""Names of elements, randomizers and sensors, which become names of files and folders."""


class Strict(BaseModel):
    """A frozen model without silent conversions.

    Unknown keys, NaN and infinity are errors; a string is never read as a number, nor a boolean as
    0 or 1. A whole number is accepted for a ``float``, and a list for a tuple, which YAML lacks.
    """

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, validate_default=True, allow_inf_nan=False
    )
