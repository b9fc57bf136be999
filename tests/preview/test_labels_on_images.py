"""Labels drawn on images: legible at the size of a tile, and nothing is painted over."""

import numpy as np
import pytest

from gen_data.core.boxes import BoxPx
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import ImageTruth, MaskPx, ObjectTruth
from gen_data.core.scene import Camera, Instance
from gen_data.core.se3 import SE3
from gen_data.preview.overlay import draw_labels

GREY = 120


def drawn(
    *items: tuple[str, BoxPx], unit: float = 1.0, size: tuple[int, int] = (320, 240)
) -> np.ndarray:
    """Objects that fill their boxes on a grey image."""
    width, height = size
    camera = Camera("color", SE3(), Intrinsics(width, height, 300.0, 300.0, width / 2, height / 2))
    image = np.full((height, width, 3), GREY, np.uint8)
    objects = tuple(
        ObjectTruth(
            Instance(k, category, category, k, category),
            visible_px=box.width_px * box.height_px,
            box=box,
            mask=MaskPx(box.x_min, box.y_min, np.ones((box.height_px, box.width_px), bool)),
        )
        for k, (category, box) in enumerate(items, 1)
    )
    return draw_labels(
        SensorReading("color", camera, {Channel.RGB: image}), ImageTruth(camera, objects), unit
    )


@pytest.mark.parametrize("category", ["wall", "floor", "ceiling", "giant"])
def test_what_surrounds_the_scene_is_outlined_and_not_tinted(category: str) -> None:
    """Walls, floors, ceilings, and whatever fills a fifth of the image."""
    image = drawn((category, BoxPx(0, 0, 320, 200)))
    inner = image[40:190, 10:310]
    assert (inner == GREY).all()
    assert (image[199, 10:310] != GREY).any(axis=-1).all()


def test_things_are_tinted_and_names_of_neighbours_do_not_cover_one_another() -> None:
    """A box, a tint and a name."""
    image = drawn(("mug", BoxPx(100, 100, 160, 160)))
    assert (image[140:155, 105:155] != GREY).any(axis=-1).all()
    box = BoxPx(100, 100, 140, 140)
    one, both = drawn(("mug", box)), drawn(("mug", box), ("mug", BoxPx(102, 101, 142, 141)))
    name = (slice(86, 99), slice(100, 130))
    np.testing.assert_array_equal(one[name], both[name])


def test_lines_and_names_grow_with_the_image_that_is_scaled_down() -> None:
    """At four times the size of a tile, four times as thick: alike on the tile."""
    small = drawn(("mug", BoxPx(100, 100, 160, 160)))
    large = drawn(("mug", BoxPx(400, 400, 640, 640)), unit=4.0, size=(1280, 960))
    tile = large.reshape(240, 4, 320, 4, 3).mean(axis=(1, 3))
    for image, name in ((small, "small"), (tile, "tile")):
        changed = (np.abs(image - float(GREY)) > 40).any(axis=-1)
        rows = np.flatnonzero(changed[:, 101:158].any(axis=1))
        assert 98 - rows.min() >= 10, name
        # The name is light on dark.
        label = image[rows.min() : 99, 101:125]
        assert label.max() > 200, name
        assert label.min() < 80, name
