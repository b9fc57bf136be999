"""Pictures of single assets."""

from gen_data.assets.library import open_library
from gen_data.preview.thumbnails import thumbnail
from gen_data.renderers import TABLE


def test_an_object_is_shown_in_the_middle_of_its_picture() -> None:
    library = open_library(())
    renderer = TABLE.load("warp")().open(library)
    image = thumbnail(library.get("apple?seed=0"), library, renderer, 64)
    assert image.shape == (64, 64, 3)
    assert image[32, 32].max() > 30
    assert image[0, 0].max() < 10
