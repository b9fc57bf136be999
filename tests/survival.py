"""Labels that are written as a line of JSON and read again."""

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from gen_data.core.serialization import canonical_json, from_plain


def assert_same(one: Any, other: Any, path: str = "") -> None:
    """Fail if values differ anywhere, also in the types of arrays; NaN is the same as NaN."""
    assert type(one) is type(other), path
    if is_dataclass(one):
        for field in fields(one):
            assert_same(
                getattr(one, field.name), getattr(other, field.name), f"{path}.{field.name}"
            )
    elif isinstance(one, Mapping):
        assert list(one) == list(other), path
        for key in one:
            assert_same(one[key], other[key], f"{path}[{key!r}]")
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype, path
        np.testing.assert_array_equal(one, other, err_msg=path)
    else:
        assert one == other, path


def assert_survives(label: Any) -> None:
    assert_same(label, from_plain(type(label), json.loads(canonical_json(label))))
