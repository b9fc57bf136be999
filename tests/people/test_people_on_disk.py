"""Which people the cache folder keeps."""

from pathlib import Path

from gen_data.assets.library import open_library


def test_people_that_are_offered_are_kept_and_other_poses_are_not(tmp_path: Path) -> None:
    """256 people are; each in every phase of every pose would fill a disk."""
    library = open_library(cache_dir=tmp_path)

    library.mesh("simple_person?phase=0.25&pose=walk&seed=3")
    assert not list(tmp_path.rglob("*.arrays"))

    made = library.mesh("simple_person?seed=3")
    assert len(list(tmp_path.rglob("*.arrays"))) == 1
    again = open_library(cache_dir=tmp_path)
    assert again.mesh("simple_person?seed=3").vertices_m.tobytes() == made.vertices_m.tobytes()
    assert again.keypoints("simple_person?seed=3") == library.keypoints("simple_person?seed=3")
