"""``import gen_data``: data sets as lazy sequences, generated or read back from disk."""

import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import gen_data
from gen_data.assemble.config import parse_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.core.capture import Channel
from gen_data.core.serialization import to_plain
from gen_data.exporters.image_files import SIGNED_ZERO, encode_channel, read_image
from gen_data.runner.processes import START_WORKER
from gen_data.targets import detection_target, lidar_target, segmentation_target, semantic_target
from tests.end_to_end.running import environment

SMALL = (
    "sensors.color.size_px=[96, 72]",
    "shard_size=3",
    "splits={train: 1, val: 0, test: 0}",  # A few scenes would leave the others empty.
)
README = Path(__file__).parents[2] / "README.md"
MINIMAL = {
    "template": "tabletop",
    "elements": {"clutter": {"count": 2}},
    "randomizers": [{"type": "camera_pose", "name": "orbit", "distance_m": {"uniform": [0.8, 1]}}],
    "sensors": [{"type": "rgb_camera", "name": "color", "size_px": [64, 48]}],
    "annotations": ["boxes2d"],
    "splits": {"train": 1, "val": 0, "test": 0},
}


@pytest.fixture(scope="module")
def data() -> gen_data.Dataset:
    return gen_data.Dataset("tabletop.yaml", seed=1, overrides=SMALL)


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> gen_data.StoredDataset:
    """Seven samples of the same configuration, written by one worker process."""
    folder = tmp_path_factory.mktemp("stored") / "tabletop"
    gen_data.generate("tabletop.yaml", 7, out=folder, workers=1, seed=1, overrides=SMALL)
    return gen_data.open(folder)


def test_a_sample_has_images_boxes_objects_and_the_scene(data: gen_data.Dataset) -> None:
    """Each visible box is the extent of its object's pixels, computed here from the id image."""
    sample = data[4]
    camera = sample.cameras["color"]
    assert camera.rgb.shape == (72, 96, 3)
    assert camera.depth_m.dtype == np.float32
    assert len(camera.objects) >= len(camera.boxes2d) > 0
    for box in sample.boxes2d["color"]:
        rows, columns = np.nonzero(camera.instance_ids == box.instance_id)
        extent = (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
        assert box.xyxy == extent
        assert data.categories[box.category_id - 1] == box.category
    assert {body.name for body in sample.scene.bodies} >= {"table"}


def test_samples_are_the_same_in_any_order_and_of_a_pickled_set(data: gen_data.Dataset) -> None:
    """A sample made first in a fresh data set equals the same one made after others."""
    _ = data[0], data[2]
    fresh = gen_data.Dataset("tabletop.yaml", seed=1, overrides=SMALL)
    np.testing.assert_array_equal(fresh[5].cameras["color"].rgb, data[5].cameras["color"].rgb)
    # Loaders of other libraries send the data set to their worker processes.
    other = pickle.loads(pickle.dumps(data))
    np.testing.assert_array_equal(other[1].cameras["color"].rgb, data[1].cameras["color"].rgb)


def test_slices_have_a_length_and_what_is_not_there_is_said(data: gen_data.Dataset) -> None:
    """A slice of an endless data set is bounded; indices count from its first sample."""
    part = data[10:1000:5]
    assert len(part) == 198
    assert part[1].index == 15
    assert [sample.index for sample in data[3:5]] == [3, 4]
    # Both refusals say how to bound it.
    with pytest.raises(TypeError, match="n="):
        len(data)
    with pytest.raises(gen_data.SampleIndexError, match="n="):
        _ = data[-1]
    data = gen_data.Dataset("tabletop.yaml", n=5, overrides=SMALL)
    with pytest.raises(gen_data.SampleIndexError, match="index 5 is out of range for 5 samples"):
        _ = data[5]
    assert issubclass(gen_data.SampleIndexError, IndexError)
    # Sensors and channels alike; the error is also a KeyError, as ``get`` requires.
    sample = data[0]
    with pytest.raises(gen_data.UnknownNameError, match=r"no camera 'colour'.*'color'"):
        _ = sample.cameras["colour"]
    with pytest.raises(gen_data.UnknownNameError, match="there is no channel 'normals'"):
        _ = sample.cameras["color"].channels["normals"]
    assert sample.cameras.get("left") is None


def test_channels_can_be_rendered_in_addition() -> None:
    data = gen_data.Dataset(MINIMAL, channels=["normals"])
    camera = data[0].cameras["color"]
    lengths = np.linalg.norm(camera.channels["normals"], axis=-1)
    np.testing.assert_allclose(lengths[np.isfinite(camera.depth_m)], 1.0, atol=1e-5)
    with pytest.raises(gen_data.ConfigError, match="unknown channel 'normal'"):
        gen_data.Dataset(MINIMAL, channels=["normal"])


def test_a_dictionary_equals_the_file_with_its_content(tmp_path: Path) -> None:
    """The resolved configurations are the same."""
    file = tmp_path / "mine.yaml"
    file.write_text(yaml.safe_dump(MINIMAL))
    assert gen_data.Dataset(MINIMAL).config == gen_data.Dataset(file).config
    # Also a shipped one, and omits inherited values.
    own = {"extends": "tabletop.yaml", "without": {"exporters": "all"},
           "sensors": [{"name": "color", "size_px": [64, 48]}]}  # fmt: skip
    file = tmp_path / "mine.yaml"
    file.write_text(yaml.safe_dump(own))
    assert gen_data.Dataset(own).config == gen_data.Dataset(file).config
    assert gen_data.Dataset(own).config["sensors"][0]["size_px"] == [64, 48]
    with pytest.raises(gen_data.ConfigError, match=r"<config>:1:\d+: extends: .*tabeltop"):
        gen_data.Dataset({"extends": "tabeltop.yaml"})
    # An object of a plug-in's class is equivalent to its YAML.
    sensor = {"type": "rgb_camera", "name": "color", "size_px": [64, 48], "hfov_deg": 70.0}
    typed = gen_data.Dataset({**MINIMAL, "sensors": [sensor]})
    from gen_data.sensors.camera.rgb_camera import RgbCamera

    camera = RgbCamera(name="color", size_px=(64, 48), hfov_deg=70.0)
    assert gen_data.Dataset({**MINIMAL, "sensors": [camera]}).config == typed.config
    # The same message as for a file, with a place in the dictionary's own YAML.
    wrong = {**MINIMAL, "views_per_scene": "many"}
    with pytest.raises(gen_data.ConfigError, match=r"<config>:\d+:\d+: views_per_scene: "):
        gen_data.Dataset(wrong)


def test_all_that_was_made_is_read(data: gen_data.Dataset, stored: gen_data.StoredDataset) -> None:
    """Colour, ids, labels and scene are equal; depth up to half a unit of its file."""
    assert len(stored) == 7
    for generated, read in zip(data[:7], stored, strict=True):
        ours, theirs = generated.cameras["color"], read.cameras["color"]
        np.testing.assert_array_equal(theirs.rgb, ours.rgb)
        np.testing.assert_array_equal(theirs.instance_ids, ours.instance_ids)
        near = ours.depth_m < 6.5
        np.testing.assert_allclose(theirs.depth_m[near], ours.depth_m[near], atol=0.51e-4)
        assert to_plain(read.core.truth) == to_plain(generated.core.truth)
        assert to_plain(read.ego) == to_plain(generated.ego)
        assert read.scene == generated.scene
        assert (read.split, read.index) == (generated.split, generated.index)
    for ours, theirs in zip(data[6].objects["color"], stored[6].objects["color"], strict=True):
        assert ours.mask is not None and theirs.mask is not None
        assert (ours.mask.x_px, ours.mask.y_px) == (theirs.mask.x_px, theirs.mask.y_px)
        np.testing.assert_array_equal(ours.mask.pixels, theirs.mask.pixels)
    assert pickle.loads(pickle.dumps(stored))[2].boxes2d["color"] == stored[2].boxes2d["color"]


def test_asking_for_a_channel_decodes_no_image(
    stored: gen_data.StoredDataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    channels = stored[0].cameras["color"].channels
    monkeypatch.setattr("gen_data.exporters.image_files.read_image", None)
    assert "rgb" in channels and "flow" not in channels
    with pytest.raises(TypeError):
        channels["rgb"]


def test_an_unfinished_folder_cannot_be_opened(tmp_path: Path) -> None:
    with pytest.raises(gen_data.StorageError, match=r"plan\.json: missing"):
        gen_data.open(tmp_path)


def test_workers_have_one_thread_whatever_the_host_programs_environment(tmp_path: Path) -> None:
    """Sums in BLAS depend on the number of threads: the program of a worker sets it itself."""
    program = START_WORKER.partition("from gen_data")[0] + "print(os.environ['OMP_NUM_THREADS'])"
    done = subprocess.run(
        [sys.executable, "-c", program, "0", "0", "0", "0", *sys.path],
        env={**environment(), "OMP_NUM_THREADS": "8"},
        capture_output=True, text=True, check=True, cwd=tmp_path,
    )  # fmt: skip
    assert done.stdout.strip() == "1"


def test_progress_is_reported_and_empty_splits_are_warned_of(tmp_path: Path) -> None:
    """The callback sees every sample of the data set; the summary names the folder."""
    seen: list[int] = []
    one_scene = {**MINIMAL, "views_per_scene": 2, "splits": {"train": 0.5, "val": 0.5, "test": 0}}
    with pytest.warns(gen_data.ConfigWarning, match="splits: 1 scene leaves"):
        summary = gen_data.generate(
            one_scene, 2, out=tmp_path / "out", workers=0, on_progress=lambda p: seen.append(p.done)
        )
    assert max(seen) == 2
    assert summary.folder == str(tmp_path / "out")


def readme_block(language: str) -> str:
    """The first code block of a language in the README."""
    return README.read_text().partition(f"```{language}\n")[2].partition("```")[0]


def test_the_yaml_of_the_readme_is_valid() -> None:
    config = parse_config(readme_block("yaml"), "README.md", "README")
    assert [sensor.name for sensor in config.sensors] == ["color"]
    with PipelineFactory(config, n=1)() as pipeline:
        assert set(pipeline.exporters) == {"coco", "kitti"}


@pytest.mark.slow
def test_the_python_of_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With small images, and few of them."""
    monkeypatch.chdir(tmp_path)
    program = readme_block("python")
    for written, small in (
        ('"tabletop.yaml", ', f'"tabletop.yaml", overrides={SMALL!r}, '),
        ("n=1000", "n=2"),
        ("workers=8", "workers=0"),
    ):
        assert written in program
        program = program.replace(written, small)
    names: dict[str, Any] = {}
    exec(compile(program, str(README), "exec"), names)
    assert names["sample"].index == 1
    assert (tmp_path / "out" / "tabletop" / "manifest.json").is_file()


def test_public_names_are_the_listed_ones_and_importing_loads_no_engine() -> None:
    """Every name of the list exists, and ``dir`` shows just these."""
    for name in gen_data.__all__:
        assert getattr(gen_data, name) is not None
    assert dir(gen_data) == sorted(gen_data.__all__)
    # ``import gen_data`` is quick: numpy and all that is heavier wait until they are needed.
    program = "import sys, gen_data; print(sorted({'numpy', 'warp', 'pydantic'} & {*sys.modules}))"
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment(), capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.strip() == "[]"


@pytest.mark.slow
def test_packages_of_the_same_names_do_no_harm(tmp_path: Path) -> None:
    """A user's own ``configs``, ``exporters`` and ``tests`` next to the script do no harm.

    The worker, which makes the sample, has the same search path.
    """
    for name in ("configs", "exporters", "tests", "generator", "randomizers"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise ImportError('not this one')\n")
    script = tmp_path / "mine.py"
    script.write_text(
        "import gen_data\n"
        f"data = gen_data.Dataset('tabletop.yaml', overrides={SMALL!r})\n"
        "print(len(data.categories))\n"
        f"gen_data.generate('tabletop.yaml', 1, out='out', workers=1, overrides={SMALL!r})\n"
    )
    done = subprocess.run(
        [sys.executable, str(script)],
        cwd=tmp_path, env=environment(), capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 0
    assert (tmp_path / "out" / "manifest.json").is_file()


IMAGES = [c for c in Channel if c.value.startswith(("flow_", "scene", "normals"))]


@pytest.mark.parametrize("channel", IMAGES)
def test_images_of_motion_and_normals_are_read_as_written(channel: Channel, tmp_path: Path) -> None:
    """Values on the grid of the file return exactly; NaN stays NaN; normals within their 8 bits."""
    rng = np.random.Generator(np.random.Philox(key=1))
    if channel is Channel.NORMALS:
        image = rng.normal(size=(6, 8, 3)).astype(np.float32)
        image /= np.linalg.norm(image, axis=-1, keepdims=True)
        image[0, 0] = 0.0
    elif channel.value.startswith("flow_occluded"):
        image = rng.integers(0, 2, (5, 7)).astype(np.uint8)
    else:
        unit, depth = (1 / 64, 2) if channel.value.startswith("flow") else (0.001, 3)
        units = rng.integers(1 - SIGNED_ZERO, SIGNED_ZERO, (5, 7, depth))
        image = (units * unit).astype(np.float32)
        image[2, 3] = np.nan
    path = tmp_path / "image.png"
    path.write_bytes(encode_channel(channel, image, 0.001))
    read = read_image(path, channel, 0.001)
    if channel is Channel.NORMALS:
        angles = np.arccos(np.clip((read * image).sum(axis=-1), -1.0, 1.0))[1:]
        assert np.degrees(angles).max() < 0.7
        assert (read[0, 0] == 0.0).all()
    else:
        np.testing.assert_allclose(read, image, atol=1e-6)


def test_relabelled_samples_have_the_classes_of_the_map(stored: gen_data.StoredDataset) -> None:
    """Only their objects, with the ids of the map's order; images stay, pickles too."""
    names = sorted({b.category for s in stored for b in s.boxes2d["color"]})
    chosen = {"second": names[1], "first": [names[0]]}
    mapped = stored.relabelled({"classes": chosen})
    assert mapped.categories == ("second", "first")
    for plain, one in zip(stored, pickle.loads(pickle.dumps(mapped)), strict=True):
        expected = [b for b in plain.boxes2d["color"] if b.category in names[:2]]
        boxes = one.boxes2d["color"]
        assert [b.xyxy for b in boxes] == [b.xyxy for b in expected]
        assert [b.category_id for b in boxes] == [2 - names.index(b.category) for b in expected]
        assert np.array_equal(one.cameras["color"].rgb, plain.cameras["color"].rgb)
        assert {i.category for i in one.scene.instances if i.annotated} <= {"first", "second"}
    with pytest.raises(gen_data.ConfigError, match=r"labels\.map: the configuration has none"):
        stored.relabelled()
    with pytest.raises(gen_data.ConfigError, match=r"<label map>:1:\d+: classess: unknown key"):
        stored.relabelled({"classess": {}})


def test_category_ids_of_pixels_and_points_are_the_classes_of_the_map(
    stored: gen_data.StoredDataset,
) -> None:
    """Of the instances that the map has; 0 for all others, such as the rest of a category."""
    names = sorted({b.category for b in stored[0].boxes2d["color"]})
    mapped = stored.relabelled({"classes": {"second": names[1], "first": [names[0]]}})
    plain, one = stored[0], mapped[0]
    class_of = {b.instance_id: b.category_id for b in one.boxes2d["color"]}
    assert set(class_of.values()) == {1, 2}
    ids = plain.cameras["color"].instance_ids
    expected = np.vectorize(lambda number: class_of.get(number, 0))(ids)
    assert np.array_equal(semantic_target(one)[1], expected)
    (cloud,), (former,) = one.lidars.values(), plain.lidars.values()
    expected = np.vectorize(lambda number: class_of.get(number, 0))(former.points["instance_id"])
    seen = np.isin(former.points["instance_id"], [0, *class_of])
    assert np.array_equal(cloud.points["category_id"][seen], expected[seen])
    assert {1, 2} <= {*cloud.points["category_id"].tolist()}
    assert np.array_equal(cloud.points["position_m"], former.points["position_m"])


def test_targets_leave_out_ignored_objects_which_detectors_would_learn(
    stored: gen_data.StoredDataset,
) -> None:
    """Or keep them with COCO's mark of regions that training leaves out."""
    name = stored[0].boxes2d["color"][0].category
    sample = stored.relabelled({"ignore": [name]})[0]
    ignored = [box.category == name for box in stored[0].boxes2d["color"]]
    assert 0 < sum(ignored) < len(ignored)
    _, kept = detection_target(sample, ignored=True)
    assert kept["iscrowd"].tolist() == [int(flag) for flag in ignored]
    for find in (detection_target, segmentation_target):
        _, target = find(sample)
        assert not target["iscrowd"].any()
        counting = np.flatnonzero(np.logical_not(ignored))
        assert target["boxes"].tolist() == kept["boxes"][counting].tolist()
    assert [list(b.xyxy) for b in sample.boxes2d["color"]] == target["boxes"].tolist()
    assert name not in {b.category for b in sample.boxes3d["color"]}
    number = 1 + stored.categories.index(name)
    assert number in lidar_target(stored[0])[1]["labels"]
    assert number not in lidar_target(sample)[1]["labels"]
