"""Everything that would stop a run is found before it, and all of it at once."""

import re
from pathlib import Path
from typing import Any

import pytest
import trimesh
import yaml
from click.testing import CliRunner

import gen_data
from gen_data.api.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.cli.main import cli
from gen_data.core.errors import ConfigError, ConfigWarning

CAMERA = {"type": "rgb_camera", "size_px": [64, 48], "hfov_deg": 60}
BENT = {**CAMERA, "lens": {"model": "kannala_brandt", "k1": 0.01}}


def cart(*sensors: dict[str, Any], **sections: Any) -> dict[str, Any]:
    on_rig = [{"rig": "cart", "offset_m": [1.0, 0, 0.9], **sensor} for sensor in sensors]
    elements = [
        {"type": "room", "name": "room", "size_m": [5, 4, 2.8]},
        {"type": "carrier", "name": "cart"},
    ]
    labels = {"annotations": ["boxes2d"]}
    return {"elements": elements, "sensors": on_rig, **labels, **sections}


def table(*sensors: dict[str, Any], **sections: Any) -> dict[str, Any]:
    left_out = {"sensors": "all", "exporters": "all"}
    return {"extends": "tabletop.yaml", "without": left_out, "sensors": [*sensors], **sections}


def check(config: Any) -> None:
    PipelineFactory(load_config(config), 2).check()


def refusal(config: dict[str, Any]) -> str:
    with pytest.raises(ConfigError) as caught:
        check(config)
    return str(caught.value)


def test_every_exporter_and_every_camera_that_does_not_fit_is_named() -> None:
    """Two formats of pinholes, two bent cameras, in one message."""
    message = refusal(
        cart(
            {**BENT, "name": "front"},
            {**BENT, "name": "side", "yaw_deg": 90},
            {**CAMERA, "name": "rear", "yaw_deg": 180},
            exporters=[{"type": "solo"}, {"type": "kitti", "camera": "front"}, {"type": "coco"}],
        )
    )

    lens = "has a lens of the model 'kannala_brandt'"
    assert f"exporter 'solo': camera 'front' {lens}, camera 'side' {lens}, but" in message
    assert f"exporter 'kitti': camera 'front' {lens}, but" in message
    assert "exporter 'coco'" not in message
    assert "'rear'" not in message


def test_a_grid_in_the_frame_of_a_scanner_that_does_not_exist_is_refused_at_its_place() -> None:
    """With the scanners that exist; the frame ``world`` needs none."""
    scanner = {"type": "lidar", "name": "top", "model": "VLP-16"}

    def gridded(frame: str) -> dict[str, Any]:
        grid = {"type": "occupancy", "size_m": [4, 4, 2], "voxel_m": 0.5, "frame": frame}
        return cart({**CAMERA, "name": "front"}, scanner, annotations=["boxes2d", grid])

    check(gridded("top"))
    check(gridded("world"))
    message = refusal(gridded("tops"))
    assert (
        "annotations[1].frame: there is no scanner 'tops'; expected one of: world, top" in message
    )
    assert "did you mean 'top'?" in message


def test_every_sensor_that_does_not_fit_is_named() -> None:
    """Two cameras on rigs that do not exist: both are named, and the existing rigs."""
    message = refusal(
        cart({**CAMERA, "name": "a", "rig": "kart"}, {**CAMERA, "name": "b", "rig": "ego"})
    )

    assert [f"sensors[{k}]" in message for k in range(3)] == [True, True, False]


PAIR = ("rgb", "disparity")


def test_cameras_without_a_rig_are_no_stereo_pair() -> None:
    """``camera_pose`` gives each a pose of its own; the position is that of ``stereo_with``."""
    message = refusal(
        table(
            {**CAMERA, "name": "left", "channels": [*PAIR], "stereo_with": "right"},
            {**CAMERA, "name": "right"},
        )
    )

    assert "sensors[0].stereo_with: 'left' and 'right' are not a rectified pair: " in message
    assert "mount them on one rig" in message


@pytest.mark.parametrize(("right", "fault"), [
    ({"offset_m": [1.0, -0.1, 0.9], "yaw_deg": 2}, "they do not look the same way"),
    ({"offset_m": [1.0, 0.1, 0.9]}, "not straight to its right"),
    ({"offset_m": [1.0, -0.1, 0.9], "hfov_deg": 61}, "they are not the same pinhole"),
])  # fmt: skip
def test_pairs_on_a_rig_are_compared(right: dict[str, Any], fault: str) -> None:
    """Turned, on the wrong side, with another lens: each is refused before the first sample."""
    left = {**CAMERA, "name": "left", "channels": [*PAIR], "stereo_with": "right"}
    message = refusal(cart(left, {**CAMERA, "name": "right", **right}))

    assert "'left' and 'right' are not a rectified pair: " in message
    assert fault in message


def test_a_pair_whose_mounting_varies_is_refused() -> None:
    """``rig_calibration`` moves each camera alone."""
    left = {**CAMERA, "name": "left", "channels": [*PAIR], "stereo_with": "right"}
    right = {**CAMERA, "name": "right", "offset_m": [1.0, -0.1, 0.9]}
    varied = [{"type": "rig_calibration", "name": "mounts"}]

    assert "not a rectified pair" in refusal(cart(left, right, randomizers=varied))
    check(cart(left, right))


@pytest.mark.slow
def test_shipped_pairs_pass() -> None:
    """Of a street and of a wrist."""
    for name in ("kitti_stereo.yaml", "depth_cameras.yaml"):
        check(name)


def test_plan_and_generate_refuse_all_faults_with_the_same_message(tmp_path: Path) -> None:
    """A stereo pair and an exporter together; no folder is made."""
    config = table(
        {**BENT, "name": "left", "channels": ["rgb"]},
        {**CAMERA, "name": "middle", "channels": [*PAIR], "stereo_with": "right"},
        {**CAMERA, "name": "right"},
        exporters=[{"type": "bop", "camera": "left"}],
        splits={"train": 1},
    )
    file = tmp_path / "mine.yaml"
    file.write_text(yaml.safe_dump(config))
    planned = CliRunner().invoke(cli, ["plan", str(file), "--n", "2"])
    with pytest.raises(ConfigError) as generated:
        gen_data.generate(file, 2, out=tmp_path / "out", workers=0)

    assert "not a rectified pair" in str(generated.value)
    assert "exporter 'bop': camera 'left' has a lens" in str(generated.value)
    assert str(planned.exception) == str(generated.value)
    assert not (tmp_path / "out").exists()


def test_a_distance_beyond_the_scene_is_refused_with_the_numbers() -> None:
    """Millimetres for metres: no camera is a kilometre away in a room of 5 m."""
    far = [{"name": "orbit", "distance_m": {"uniform": [800, 1300]}}]
    message = refusal(table({**CAMERA, "name": "color"}, randomizers=far))

    assert (
        "distance_m: at least 800 m, but the scene is 4.7 x 3.7 x 2.5 m inside, 6.48 m " in message
    )
    near = [{"name": "orbit", "distance_m": {"uniform": [0.8, 1.3]}}]
    check(table({**CAMERA, "name": "color"}, randomizers=near))


def test_a_sensor_farther_from_its_rig_than_the_scene_is_long_is_doubted() -> None:
    """Millimetres for metres: a warning with the numbers."""
    with pytest.warns(gen_data.ConfigWarning) as caught:
        check(cart({**CAMERA, "name": "front", "offset_m": [1500, 0, 0]}))
    (text,) = [str(w.message) for w in caught]
    assert text == (
        "sensors.front.offset_m: 1500 m from its rig, but the scene is 4.7 x 3.7 x 2.5 m inside; "
        "expected metres"
    )


def test_a_camera_on_a_carrier_that_looks_away_is_named() -> None:
    """On the floor below the carrier, where the rig has its origin, instead of above a table."""
    above = {**CAMERA, "name": "left", "offset_m": [0, 0.03, 1.7], "pitch_deg": -90}
    below = {**CAMERA, "name": "right", "offset_m": [0, 0.03, 0]}
    config = cart(above, below)
    config["elements"].append(
        {"type": "surface", "name": "desk", "asset": "table", "top_size_m": [1.3, 0.9]}
    )
    with pytest.warns(gen_data.ConfigWarning) as caught:
        check(config)
    (text,) = [str(w.message) for w in caught]
    assert text.startswith("sensors.right: its image shows nothing of the scene's focus, 1.3 x 0.9")
    assert "it is at (0, 0.03, 0) and looks along (1, 0, 0)" in text


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tabletop", "indoor_rgbd", "closeup", "wrist_camera", "drone"])
def test_shipped_configurations_pass_without_a_warning(name: str) -> None:
    """One of each kind of camera; other tests check the rest."""
    check(name)


def marker(distance_m: Any) -> dict[str, Any]:
    """A marker of 2 cm, 35 mm from corner to corner with its margin, and images of 16 pixels."""
    prop = {"type": "prop", "asset": "marker?side_m=0.02", "on": "table", "at_m": [0, 0]}
    coarse = {**CAMERA, "name": "color", "size_px": [16, 12], "hfov_deg": 100}
    orbit = {"name": "orbit", "distance_m": distance_m}
    return table(coarse, elements={"tag": prop}, randomizers=[orbit])


def test_a_marker_below_a_pixel_in_every_image_is_refused() -> None:
    """A focal length of 6.7 px makes 0.08 px of 35 mm at 3 m; twice of it with a longer lens."""
    message = refusal(marker(3.0))

    assert ".asset: 'marker?side_m=0.02' is 0.1" in message
    assert "px long at most in all images; expected at least one pixel" in message


def test_a_marker_that_some_draw_brings_near_is_accepted() -> None:
    check(marker({"uniform": [0.3, 3.0]}))


def prints(*ids: str, **sections: Any) -> dict[str, Any]:
    """Some assets on a table."""
    desk = {"type": "surface", "name": "desk", "asset": "table", "top_size_m": [1.3, 0.9]}
    things = {"type": "objects", "name": "things", "on": "desk", "assets": {"ids": [*ids]}}
    config = cart({**CAMERA, "name": "front"}, **sections)
    return {**config, "elements": [*config["elements"], desk, things]}


@pytest.mark.filterwarnings("ignore::gen_data.ConfigWarning")
def test_text_is_refused_where_nothing_is_written_on() -> None:
    """Apples have none; of mugs some have. Also if only a format asks for it."""
    expected = "nothing in the scenes is written on; add objects with print"
    message = refusal(prints("apple?seed=0", annotations=["boxes2d", "text"]))
    assert f": annotations[1]: {expected}" in message
    message = refusal(prints("apple?seed=0", exporters=[{"type": "scene_text"}]))
    assert f": exporters[0]: exporter 'scene_text': {expected}" in message
    check(prints("apple?seed=0", "mug?seed=0", "mug?seed=44", annotations=["text"]))
    check(prints("apple?seed=0"))


def test_a_subcategory_that_no_object_has_is_named_at_its_place() -> None:
    """The known one in the same map is not."""
    label_map = {"classes": {"half": ["lemon/halve", "apple/half"]}, "drop": ["apple/halve"]}
    config = {"extends": "closeup.yaml", "labels": {"map": label_map}}
    with pytest.warns(ConfigWarning) as warned:
        check(config)
    texts = [str(one.message).splitlines()[0] for one in warned]
    assert len(texts) == 2, texts
    for text, field, name in zip(
        texts, ("classes.half[0]", "drop[0]"), ("lemon", "apple"), strict=True
    ):
        start = rf".+:\d+:\d+: labels\.map\.{re.escape(field)}: no object is '{name}/halve'; "
        assert re.match(
            rf"{start}expected one of .*{name}/half, .*did you mean '{name}/half'", text
        )


def test_stacks_of_objects_that_are_not_stackable_are_doubtful(tmp_path: Path) -> None:
    """A mesh of a user is not, unless the index states it."""
    box = trimesh.creation.box((0.05, 0.05, 0.05))
    box.export(tmp_path / "block.stl")
    group = {"placement": "stack", "assets": {"ids": ["user/block"]}}
    config = table(
        {"name": "color", **CAMERA},
        assets={"folders": [str(tmp_path)]}, elements={"clutter": group},
    )  # fmt: skip
    with pytest.warns(ConfigWarning, match=r"elements.clutter.placement: stack: none of its asset"):
        check(config)
    (tmp_path / "assets.yaml").write_text("assets: [{file: block.stl, stackable: true}]\n")
    check(config)
