"""Samples of one split: selected by name, in every kind of data set."""

import pickle
import warnings
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gen_data
from gen_data.core.errors import ConfigError

N, VIEWS = 40, 2
CONFIG = {"seed": 5, "template": "tabletop", "views_per_scene": VIEWS,
          "splits": {"train": 0.6, "val": 0.4},
          "sensors": [{"type": "rgb_camera", "name": "color", "size_px": [32, 24], "hfov_deg": 60}],
          "annotations": ["boxes2d"], "labels": {"map": {"classes": {"mug": None}}}}  # fmt: skip


def number(sample: gen_data.Sample) -> int:
    return sample.index


class Numbered:
    """A source whose samples are drawn by nobody: only their numbers and splits are known."""

    categories = ("mug",)
    config = CONFIG

    def sample(self, index: int) -> Any:
        return type("Record", (), {"index": index})()

    def close(self) -> None:
        """Nothing is open."""


def drawn_splits() -> list[str]:
    """The split of each sample, from the pipeline that writes it into the labels."""
    data = gen_data.Dataset(CONFIG)
    with data._source.pipeline() as pipeline:  # type: ignore[attr-defined]
        return [pipeline.split(k // VIEWS) for k in range(N)]


SPLITS = drawn_splits()
TRAIN = [k for k in range(N) if SPLITS[k] == "train"]
VAL = [k for k in range(N) if SPLITS[k] == "val"]


@pytest.fixture
def data() -> gen_data.SampleSequence:
    return gen_data.SampleSequence(Numbered(), range(N))


def numbers(samples: gen_data.SampleSequence) -> list[int]:
    return [sample.index for sample in samples]


def test_a_split_has_exactly_its_samples_in_order_and_scenes(data: gen_data.SampleSequence) -> None:
    """As the pipeline assigns them; nothing is in two splits, or in none."""
    assert (numbers(data.split("train")), numbers(data.split("val"))) == (TRAIN, VAL)
    assert len(data.split("train")) == len(TRAIN)
    assert data.split("val")[-1].index == VAL[-1]
    assert numbers(data.split("all")) == list(range(N))
    again = pickle.loads(pickle.dumps(data.split("val")))
    assert numbers(again) == VAL
    # Loaders keep views of a scene together by them.
    scenes = data.split("val").scene_indices(np.arange(len(VAL)))
    assert scenes.tolist() == [k // VIEWS for k in VAL]
    # ``n`` counts the samples of all splits, as in ``generate``.
    assert len(gen_data.Dataset(CONFIG, n=N, split="val")) == len(VAL)
    assert not gen_data.Dataset(CONFIG, split="train").is_bounded


def test_splits_and_slices_compose_in_any_order(data: gen_data.SampleSequence) -> None:
    """A slice of a split counts its samples; a split of a slice has its samples in the slice."""
    assert numbers(data.split("train")[3:15:4]) == TRAIN[3:15:4]
    assert numbers(data.split("val")[::-1]) == VAL[::-1]
    assert numbers(data[7:30].split("val")) == [k for k in VAL if 7 <= k < 30]
    assert numbers(data[::-1].split("train")[:5]) == TRAIN[::-1][:5]
    assert numbers(data.relabelled().split("val")) == numbers(data.split("val").relabelled()) == VAL


def test_a_data_set_without_end_has_splits_without_end() -> None:
    """Position ``p`` is the same sample as in a data set with a size."""
    endless = gen_data.SampleSequence(Numbered(), gen_data.Dataset(CONFIG)._indices)
    val = endless.split("val")
    assert not val.is_bounded
    assert numbers(val[: len(VAL)]) == VAL
    assert val[len(VAL) - 1].index == VAL[-1]
    with pytest.raises(TypeError, match="without a size"):
        len(val)


def test_loaders_yield_the_split_and_resume_in_it(data: gen_data.SampleSequence) -> None:
    """Every sample once per epoch, whole scenes together; the rest after an interruption."""

    def loader() -> gen_data.Loader[int]:
        return gen_data.Loader(data.split("train"), number, batch_size=4, shuffle=True, seed=3)

    first = loader()
    batches = list(first)
    assert sorted(k for batch in batches for k in batch) == TRAIN

    begun, resumed = loader(), loader()
    reading = iter(begun)
    _ = next(reading), next(reading)
    resumed.load_state_dict(begun.state_dict())
    assert list(resumed) == batches[2:]


MIXED = "samples of the splits train and val"


def test_loaders_warn_of_mixed_splits_unless_they_are_wanted(data: gen_data.SampleSequence) -> None:
    """The remedy is named; a choice of a split, or of all, is silent."""
    with pytest.warns(gen_data.ConfigWarning, match=MIXED) as caught:
        gen_data.Loader(data, number)
    assert ".split('train')" in str(caught[0].message)
    assert ".split('all')" in str(caught[0].message)
    with pytest.warns(gen_data.ConfigWarning, match=MIXED):
        gen_data.Loader(gen_data.Dataset(CONFIG), number, epoch_size=4)
    with pytest.warns(gen_data.ConfigWarning, match=MIXED):
        gen_data.Loader(data.relabelled()[4:], number)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = VAL[0] // VIEWS * VIEWS
        train, every = data.split("train"), data.split("all")
        for chosen in (train, every, every[3:9], train.relabelled(), data[scene : scene + VIEWS]):
            gen_data.Loader(chosen, number)


@pytest.mark.slow
def test_the_data_set_of_torch_warns_of_mixed_splits(data: gen_data.SampleSequence) -> None:
    import gen_data.torch

    with pytest.warns(gen_data.ConfigWarning, match=MIXED):
        gen_data.torch.SampleDataset(data, number)
    assert len(gen_data.torch.SampleDataset(data.split("val"), number)) == len(VAL)


def test_unknown_splits_name_others_and_a_name_is_no_index(data: gen_data.SampleSequence) -> None:
    """Splits without a share have no samples; a mapping's syntax gets the method's name."""
    for name, fact in (
        ("test", "there is no split 'test': its share is 0; expected one of train, val, all"),
        ("trian", "there is no split 'trian'; expected one of train, val, all .*mean 'train'"),
    ):
        with pytest.raises(gen_data.UnknownNameError, match=fact):
            data.split(name)
    with pytest.raises(TypeError, match=r"'val'; expected a whole .*\.split\('val'\)"):
        data["val"]  # type: ignore[call-overload]
    with pytest.raises(TypeError, match=r"1\.0; expected a whole number or a slice"):
        data[1.0]  # type: ignore[call-overload]


def test_nothing_to_load_is_said(data: gen_data.SampleSequence) -> None:
    """An empty split is a warning, and a loader without samples an error."""
    in_train = data[TRAIN[0] : TRAIN[0] + 1]
    with pytest.warns(gen_data.ConfigWarning, match="split 'val': none of the 1 samples is in it"):
        empty = in_train.split("val")
    assert len(empty) == 0
    with pytest.raises(ConfigError, match="samples: there are none"):
        gen_data.Loader(empty, number)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::gen_data.ConfigWarning")  # tiny images show little
def test_a_stored_data_set_is_opened_with_a_split(tmp_path: Path) -> None:
    """Its samples are those whose labels state the split, in workers too."""
    with suppress(gen_data.NoLabels):
        gen_data.generate(CONFIG, 8, out=tmp_path / "set", workers=0)
    every = gen_data.open(tmp_path / "set")
    stated = [sample.index for sample in every if sample.split == "val"]
    val = gen_data.open(tmp_path / "set", split="val")
    assert numbers(val) == stated
    assert 0 < len(stated) < 8
    assert repr(val) == f"<StoredDataset '{tmp_path / 'set'}', val: {len(stated)} samples>"
    loaded = [k for batch in gen_data.Loader(val, number, workers=1) for k in batch]
    assert loaded == stated
