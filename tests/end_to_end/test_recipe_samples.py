"""``gen_data.open`` of a recipe: samples are rendered when they are read, and then kept."""

import importlib.util
import os
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest

import gen_data
from gen_data.api.open_dataset import RecipeSamples
from gen_data.core.serialization import canonical_json
from gen_data.pipeline.pipeline import Pipeline
from tests.end_to_end.conftest import N


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of cached samples, empty."""
    monkeypatch.setattr("gen_data.runner.sample_cache.sample_cache_dir", lambda: tmp_path)
    return tmp_path


def forbid_rendering(monkeypatch: pytest.MonkeyPatch) -> None:
    def sample(self: Pipeline, index: int) -> None:
        raise AssertionError(f"sample {index} is rendered")

    monkeypatch.setattr(Pipeline, "sample", sample)


def assert_equal(one: gen_data.Sample, other: gen_data.Sample) -> None:
    assert (one.index, one.split, one.scene) == (other.index, other.split, other.scene)
    assert one.boxes2d == other.boxes2d
    for name, camera in other.cameras.items():
        assert canonical_json(one.cameras[name].truth) == canonical_json(camera.truth)
        for channel, image in camera.channels.items():
            np.testing.assert_array_equal(one.cameras[name].channels[channel], image)


def test_samples_are_equal_to_the_finished_data_set(
    author: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In any order; afterwards nothing is rendered."""
    stored, opened = gen_data.open(author / "set"), gen_data.open(author / "recipe.yaml")
    assert len(opened) == N
    assert (opened.categories, dict(opened.config)) == (stored.categories, dict(stored.config))
    for index in (3, 0, -1):
        assert_equal(opened[index], stored[index])

    forbid_rendering(monkeypatch)
    with gen_data.open(author / "recipe.yaml") as again:
        for index in (0, 3):
            assert_equal(again[index], stored[index])
        assert_equal(pickle.loads(pickle.dumps(again))[3], stored[3])
        with pytest.raises(AssertionError, match="sample 1 is rendered"):
            again[1]


@pytest.mark.parametrize("damage", ["cut", "changed", "exchanged"])
def test_a_damaged_sample_is_made_again(author: Path, cache: Path, damage: str) -> None:
    opened = gen_data.open(author / "recipe.yaml")
    first, second = opened[0], opened[1]
    (content,) = cache.iterdir()
    path, other = content / "000000000", content / "000000001"
    data = bytearray(path.read_bytes())
    if damage == "cut":
        os.truncate(path, len(data) // 2)
    elif damage == "changed":
        data[len(data) // 2] ^= 4
        path.write_bytes(data)
    else:
        path.write_bytes(other.read_bytes())

    assert_equal(opened[0], first)
    assert_equal(opened[1], second)


def test_samples_outlive_their_removal_from_the_cache(author: Path, cache: Path) -> None:
    """Images are decoded on access: a sample in hand needs no file."""
    kept = gen_data.open(author / "recipe.yaml")[0]
    none = gen_data.open(author / "recipe.yaml", cache_bytes=0)
    assert_equal(none[0], kept)
    none[1]

    assert not [path for path in cache.rglob("*") if path.is_file()]
    assert_equal(kept, gen_data.open(author / "set")[0])


def test_splits_and_failed_samples_are_as_in_the_data_set(
    author: Path, cache: Path, tmp_path: Path
) -> None:
    text = (author / "recipe.yaml").read_text()
    (author / "lacking.yaml").write_text(text.replace("shards:\n", "failed: [1, 3]\nshards:\n"))

    opened = gen_data.open(author / "lacking.yaml", "train")

    assert [sample.index for sample in opened] == [0, 2, 4]


@pytest.mark.parametrize(
    ("was", "now", "kind", "fact"),
    [
        ("numpy: ", "numpy: 1.2.3 #", gen_data.DeterminismError, r"1\.2\.3 made it"),
        ("n: 5", "n: 6", gen_data.ConfigError, r"recipe\.yaml:\d+:1: n: was edited"),
        ("folders: [meshes]", "folders: [..]", gen_data.ConfigError, "config.assets: was edited"),
    ],
)
def test_nothing_is_rendered_from_a_recipe_that_does_not_fit(
    author: Path, cache: Path, was: str, now: str, kind: type[Exception], fact: str
) -> None:
    path = author / "wrong_recipe.yaml"
    text = (author / "recipe.yaml").read_text()
    assert was in text
    path.write_text(text.replace(was, now, 1))

    with pytest.raises(kind, match=fact):
        gen_data.open(path)
    assert not list(cache.iterdir())


def test_a_file_that_is_no_recipe_is_refused(author: Path) -> None:
    with pytest.raises(gen_data.ConfigError, match=r"tiny\.yaml:2:1: format: missing; expected a"):
        gen_data.open(author / "tiny.yaml")


@pytest.mark.slow
def test_the_detector_is_trained_from_a_recipe_alone(
    author: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = Path(__file__).parents[2] / "examples" / "train_detector.py"
    spec = importlib.util.spec_from_file_location("train_detector", path)
    assert spec and spec.loader
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    given = "--eval none --batch 2 --workers 0 --size 48 --width 4 --steps 4"
    monkeypatch.setattr(sys, "argv", ["", str(author / "recipe.yaml"), *given.split()])

    args = script.parse_arguments()
    samples = script.open_source(args)
    model = script.train(samples, args)

    assert isinstance(samples._source, RecipeSamples)
    assert model.classes == samples.categories
