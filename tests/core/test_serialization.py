"""Frozen dataclasses to JSON and back."""

import json
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray

from gen_data.core.scene import Body, Environment, IrradianceVolume, Light, Scene, SupportSurface
from gen_data.core.se3 import IDENTITY, SE3
from gen_data.core.serialization import canonical_json, from_plain, to_plain


class Colour(str, Enum):
    RED = "red"


@dataclass(frozen=True)
class Inner:
    pose: SE3 = IDENTITY
    ratio: float = 1.0


@dataclass(frozen=True)
class Outer:
    """Every shape of field that the nouns have."""

    kind: Literal["a", "b"]
    inner: Inner
    many: tuple[Inner, ...] = ()
    pair: tuple[float, str] = (0.0, "")
    maybe: float | None = None
    nested: tuple[tuple[float, ...], ...] = ()
    names: tuple[str, ...] = field(default_factory=tuple)


numbers = st.floats(allow_nan=False, allow_infinity=False)
inners = st.builds(Inner, pose=st.builds(SE3, st.tuples(numbers, numbers, numbers)), ratio=numbers)
outers = st.builds(
    Outer,
    kind=st.sampled_from(["a", "b"]),
    inner=inners,
    many=st.lists(inners, max_size=2).map(tuple),
    pair=st.tuples(numbers, st.text(st.characters(exclude_categories=["Cs"]), max_size=3)),
    maybe=st.none() | numbers,
    nested=st.lists(st.lists(numbers, max_size=2).map(tuple), max_size=2).map(tuple),
    names=st.lists(st.sampled_from(["x", "ü"]), max_size=2).map(tuple),
)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(outers)
def test_a_value_survives_json(value: Outer) -> None:
    """Through text and back, bit for bit."""
    back = from_plain(Outer, json.loads(canonical_json(value)))

    assert back == value
    assert canonical_json(back) == canonical_json(value)


def test_a_scene_survives_json() -> None:
    """The noun in the sidecar of every sample."""
    scene = Scene(
        template="tabletop",
        bodies=(Body("table", "table?seed=1", SE3.about_z(0.3, (1, 2, 3)), mass_kg=2.5),),
        surfaces=(SupportSurface("top", "table", SE3(), (1.2, 0.8), 1.0),),
        lights=(Light("sun", "sun", illuminance_lux=1000.0),),
        environment=Environment(yaw_rad=0.5),
    )

    assert from_plain(Scene, json.loads(canonical_json(scene))) == scene


@dataclass(frozen=True)
class Labelled:
    mask: NDArray[np.bool_]


@given(arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, min_side=0, max_side=7)))
def test_masks_survive_json(mask: NDArray[np.bool_]) -> None:
    """As lengths of row-major runs, the first one of unset pixels."""
    plain = json.loads(canonical_json(Labelled(mask)))["mask"]
    assert plain["size"] == list(mask.shape)
    expected = [pixel for k, n in enumerate(plain["runs"]) for pixel in [k % 2 == 1] * n]
    assert mask.ravel().tolist() == expected
    found = from_plain(Labelled, {"mask": plain}).mask
    assert found.dtype == bool
    assert np.array_equal(found, mask)


def test_canonical_json_is_one_line_of_plain_data_with_sorted_keys() -> None:
    """UTF-8 as it is, no spaces, no tuples and no enums."""
    assert canonical_json({"b": (1, 2.5), "a": Colour.RED, "ü": {"z", "y"}}) == (
        '{"a":"red","b":[1,2.5],"ü":["y","z"]}'
    )
    assert to_plain({"a": (Colour.RED, {3, 1})}) == {"a": ["red", [1, 3]]}


def test_what_a_field_cannot_hold_is_refused() -> None:
    with pytest.raises(ValueError, match="Out of range float"):
        canonical_json(float("nan"))
    with pytest.raises(TypeError, match="'c' is not one of"):
        from_plain(Outer, {"kind": "c", "inner": {}})
    with pytest.raises(KeyError, match="colour"):
        from_plain(Inner, {"ratio": 1.0, "colour": "red"})


def test_whole_numbers_become_floats_where_floats_are_declared() -> None:
    """JSON writers may drop the fraction."""
    assert isinstance(from_plain(Inner, {"ratio": 2}).ratio, float)


def test_sparse_fields_are_left_out_while_empty_and_read_back() -> None:
    """An environment without volumes has the data of before; one with volumes keeps them."""
    box = IrradianceVolume((0.0, 0.0, 0.0), (1.0, 2.0, 3.0), (1, 1, 1), (0.5,) * 18)

    assert set(to_plain(Environment())) == {"image", "luminance_cd_m2", "visible", "yaw_rad"}
    for environment in (Environment(), Environment(volumes=(box,))):
        assert from_plain(Environment, json.loads(canonical_json(environment))) == environment
