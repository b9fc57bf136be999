"""Cityscapes export, held against the samples; the slow test reads it with cityscapesscripts."""

import json
import math
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageDraw

from gen_data.core.capture import Channel
from gen_data.exporters.cityscapes import Cityscapes
from gen_data.exporters.cityscapes_classes import city_classes
from tests.exporters.datasets import in_scene, made_of, with_sensor
from tests.exporters.label_readers import pixels
from tests.exporters.test_labels import truth_of

CLASS_OF = {"car": 26, "crate": 5, "pedestrian": 24}


def with_a_tree(world: Any) -> tuple[Any, list[Any]]:
    """The street, and a frame with a tree that is not annotated."""
    tree = replace(
        world.instance(9, "crate", 12.0, 1.0, 0.2), category="tree", category_id=0, annotated=False
    )
    wood = world.sample(7, (world.instance(1, "crate", 8.0, 1.6, 0.4), tree), [world.camera()])
    return world.info(8, depth_scale_m=1 / 256), [*world.samples, wood]


dataset = made_of(Cityscapes(), with_a_tree)


def files_of(root: Path, index: int) -> dict[str, Path]:
    """Files of a frame of the split train by their suffix."""
    stem = f"street/street_{index:06d}_000000_"
    gt = root / "gtFine/train"
    return {
        **{k: gt / f"{stem}gtFine_{k}.png" for k in ("labelIds", "instanceIds", "color")},
        "polygons": gt / f"{stem}gtFine_polygons.json",
        "camera": root / f"camera/train/{stem}camera.json",
        "image": root / f"leftImg8bit/train/{stem}leftImg8bit.png",
    }


def redrawn(path: Path) -> Any:
    """Labels as cityscapesscripts draws them: polygons in their order, over each other."""
    truth = json.loads(path.read_text())
    numbers = {name: c.number for name, c in city_classes().by_name.items()}
    image = Image.new("L", (truth["imgWidth"], truth["imgHeight"]), 0)
    draw = ImageDraw.Draw(image)
    for thing in truth["objects"]:
        label = thing["label"].removesuffix("group")
        draw.polygon([tuple(p) for p in thing["polygon"]], fill=numbers[label])
    return np.asarray(image)


def problems(root: Path, samples: Any) -> list[str]:
    """Differences between the files of each frame of the split train, and from the samples."""
    found = []
    colors = np.array([c.color for c in city_classes().by_name.values()])
    for sample in (s for s in samples if s.split == "train"):
        files = files_of(root, sample.index)
        missing = [name for name, path in files.items() if not path.exists()]
        if missing:
            found.append(f"no {missing[0]}")
            continue
        labels, codes = pixels(files["labelIds"]), pixels(files["instanceIds"])
        if not np.array_equal(np.where(codes >= 1000, codes // 1000, codes), labels):
            found.append("instances differ from labels")
        if not np.array_equal(pixels(files["color"]), colors[labels]):
            found.append("colours differ from labels")
        if not np.array_equal(redrawn(files["polygons"]), labels):
            found.append("polygons differ from labels")
        counts: Counter[int] = Counter()
        for thing in truth_of(sample):
            number = CLASS_OF.get(thing.category, 0)
            code = 1000 * number + counts[number] if number >= 24 else number
            counts[number] += 1
            if not (codes[thing.mask] == code).all():
                found.append("an instance differs")
            if number >= 24 and (codes == code).sum() != thing.mask.sum():
                found.append("an instance differs")
    return found


def test_label_images_and_polygons_agree_with_the_samples(dataset: Path, world: Any) -> None:
    """Counted classes have numbers; crates are dynamic and have none."""
    assert problems(dataset, with_a_tree(world)[1]) == []
    # A tree without annotation is vegetation; above the horizon is sky.
    labels = pixels(files_of(dataset, 7)["labelIds"])
    codes = pixels(files_of(dataset, 7)["instanceIds"])
    instances = pixels(dataset.parent / "shards/000002/color/instance/000000007.png")
    assert (labels[instances == 9] == 21).all()
    assert (codes[instances == 9] == 21).all()
    assert (instances == 9).any()
    assert (labels[:60][instances[:60] == 0] == 23).all()


def test_calibration_is_that_of_the_camera(world: Any, tmp_path: Path) -> None:
    """On the rig: 0.3 m ahead, 1.6 m up, level; pixel centres at whole numbers."""
    info = world.info(8, ("left", "right"), ("top",), steps_per_scene=4)
    folder = world.export(Cityscapes(camera="left"), info, world.drive(), tmp_path)
    path = folder / "camera/train/street/street_000000_000003_camera.json"
    facts = json.loads(path.read_text())
    assert facts["extrinsic"] == pytest.approx(
        {"baseline": 0, "pitch": 0, "roll": 0, "yaw": 0, "x": 0.3, "y": 0, "z": 1.6}, abs=1e-6
    )
    focal_px = 80 / math.tan(0.6)
    assert facts["intrinsic"] == pytest.approx(
        {"fx": focal_px, "fy": focal_px, "u0": 79.5, "v0": 59.5}, abs=1e-6
    )


def test_a_pair_has_disparities_and_a_baseline(world: Any, tmp_path: Path) -> None:
    """(value - 1) / 256 pixels; times depth they are focal length times baseline."""
    info, pairs = world.pairs()
    info = with_sensor(info, "left", channels=(*info.media["left"], Channel.INSTANCE))
    folder = world.export(Cityscapes(camera="left", right="right"), info, pairs, tmp_path)
    stem = "train/street/street_000000_000001"
    facts = json.loads((folder / f"camera/{stem}_camera.json").read_text())
    assert facts["extrinsic"]["baseline"] == pytest.approx(0.54)
    values = pixels(folder / f"disparity/{stem}_disparity.png")
    depth = pairs[1].capture.readings["left"].channels[Channel.Z_DEPTH]
    near = np.isfinite(depth) & (depth < 15)
    expected = facts["intrinsic"]["fx"] * 0.54 / depth[near]
    np.testing.assert_allclose((values[near] - 1) / 256, expected, atol=0.003)
    assert (values[~np.isfinite(depth)] == 0).all()
    assert (folder / f"rightImg8bit/{stem}_rightImg8bit.png").exists()


def test_riders_vans_and_egos_have_classes_and_ignored_none(world: Any, tmp_path: Path) -> None:
    """Classes come from the table; the carrier of the camera from its rig."""
    classes = city_classes()
    bicycle = replace(world.instance(1, "car", 0, 0, 0), category="bicycle")
    assert classes.of_instance(bicycle).name == "bicycle"
    ridden = replace(bicycle, attributes=(("rider", "yes"),))
    assert classes.of_instance(ridden).name == "rider"
    assert classes.of_instance(replace(bicycle, category="van")).name == "car"
    assert classes.of_instance(replace(bicycle, category="sofa")).name == "dynamic"
    sofa = replace(bicycle, category="sofa", annotated=False)
    assert classes.of_instance(sofa).name == "static"
    sample = world.drive()[0]
    bodies = tuple(replace(b, instance_id=1) if b.name == "ego" else b for b in sample.scene.bodies)
    own = in_scene(sample, bodies=bodies)
    info = world.info(1, ("left", "right"), ("top",))
    folder = world.export(Cityscapes(camera="left"), info, [own], tmp_path)
    codes = pixels(files_of(folder, 0)["instanceIds"])
    ids = sample.capture.readings["left"].channels[Channel.INSTANCE]
    assert (codes[ids == 1] == 1).all()
    sample = world.samples[0]
    first = sample.truth["color"].objects[0]
    folder = world.export(Cityscapes(), world.info(1), [world.ignoring(sample)], tmp_path / "b")
    labels = pixels(files_of(folder, 0)["labelIds"])
    ids = sample.capture.readings["color"].channels[Channel.INSTANCE]
    assert (labels[ids == first.instance.instance_id] == 0).all()


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_the_official_scripts_read_it(dataset: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Polygons give the label images; the ground truth as prediction has IoU 1."""
    root = dataset
    monkeypatch.setenv("CITYSCAPES_DATASET", str(root))
    # cityscapesscripts still has the name that numpy 2.4 removed.
    monkeypatch.setattr(np, "in1d", np.isin, raising=False)
    import cityscapesscripts.evaluation.evalPixelLevelSemanticLabeling as pixel_level  # noqa: N813
    from cityscapesscripts.helpers.annotation import Annotation
    from cityscapesscripts.helpers.labels import labels as official
    from cityscapesscripts.preparation.json2labelImg import createLabelImage

    ours = [(c.name, c.number, c.color, c.counted) for c in city_classes().by_name.values()]
    assert ours == [(k.name, k.id, k.color, k.hasInstances) for k in official if k.id >= 0]
    paths = sorted((root / "gtFine/train/street").glob("*_labelIds.png"))
    for path in paths:
        annotation = Annotation()
        annotation.fromJsonFile(str(path).replace("labelIds.png", "polygons.json"))
        drawn = np.asarray(createLabelImage(annotation, "ids"))
        np.testing.assert_array_equal(drawn, pixels(path))
    names = [str(path) for path in paths]
    arguments = pixel_level.args
    arguments.quiet, arguments.JSONOutput, arguments.evalInstLevelScore = True, False, True
    result = pixel_level.evaluateImgLists(names, names, arguments)
    scores = SimpleNamespace(**result)
    assert scores.averageScoreClasses == pytest.approx(1.0)
    assert scores.averageScoreInstClasses == pytest.approx(1.0)
    shifted = pixel_level.evaluateImgLists(names, names[::-1], arguments)
    assert shifted["averageScoreClasses"] < 0.9
