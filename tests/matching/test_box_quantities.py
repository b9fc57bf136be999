"""Sizes and positions of boxes, and the fields of cameras that answer for them."""

from typing import Any

import pytest

from gen_data.assemble.config import parse_config
from gen_data.lab.matching.quantities import box_positions, box_sizes
from gen_data.lab.matching.quantities.base import FieldChange, NoParameter, map_numbers
from gen_data.lab.matching.recordings import ImageLabels

TABLETOP = """\
template: tabletop
randomizers:
  - {type: camera_pose, name: orbit, %s}
sensors: [{type: rgb_camera}]
"""


def double(value: float) -> float:
    return 2.0 * value


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (3, 6.0),
        ({"uniform": [1, 2]}, {"uniform": [2.0, 4.0]}),
        ({"log_uniform": [0.5, 2]}, {"log_uniform": [1.0, 4.0]}),
        ({"normal": {"mean": 1, "stddev": 0.1, "clip": [0.5, 2]}},
         {"normal": {"mean": 2.0, "stddev": 0.2, "clip": [1.0, 4.0]}}),
    ],
)  # fmt: skip
def test_distributions_are_scaled_number_by_number(given: Any, expected: Any) -> None:
    """Of every distribution whose numbers are lengths."""
    assert map_numbers(given, double, double) == expected


def test_distributions_without_lengths_and_images_without_boxes_have_no_statistics() -> None:
    with pytest.raises(NoParameter, match="can be neither scaled nor shifted"):
        map_numbers({"choice": {"1": 2}}, double, double)
    empty = ImageLabels(100, 100, ())
    assert box_sizes.measure(empty) != box_sizes.measure(empty)
    assert box_positions.measure(empty) != box_positions.measure(empty)
    low = ImageLabels(100, 80, (("mug", 0.0, 50.0, 10.0, 20.0),))
    assert box_positions.measure(low) == pytest.approx(60.0 / 80.0 - 0.5)


def test_boxes_of_twice_the_size_need_half_the_distance_or_twice_the_share() -> None:
    """Sizes are relative to the image: its resolution does not matter."""
    small = ImageLabels(100, 100, (("mug", 10.0, 10.0, 10.0, 20.0),))
    large = ImageLabels(200, 200, (("mug", 20.0, 20.0, 40.0, 80.0),))
    config = parse_config(TABLETOP % "distance_m: {uniform: [0.8, 1.2]}", "x", "x")
    assert box_sizes.measure(large) - box_sizes.measure(small) == pytest.approx(1.0)
    assert box_sizes.BOX_SIZES.change(config, "color", 1.0) == FieldChange(
        "randomizers", 0, "distance_m", {"uniform": [0.4, 0.6]}
    )
    # ``fills`` is in proportion to sizes.
    config = parse_config(TABLETOP % "aim: clutter, fills: {uniform: [0.2, 0.4]}", "x", "x")
    change = box_sizes.BOX_SIZES.change(config, "color", 1.0)
    assert (change.field, change.value) == ("fills", {"uniform": [0.4, 0.8]})
    config = parse_config(TABLETOP % "distance_m: 1", "x", "x")
    with pytest.raises(NoParameter, match="camera_pose aims at objects"):
        box_positions.BOX_POSITIONS.change(config, "color", 1.0)
