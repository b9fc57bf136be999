"""PyTorch: tensors of samples, from a finished data set and while rendering."""

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import gen_data

pytestmark = pytest.mark.slow
"""PyTorch is an optional dependency, which CI installs for its slow tests."""

SMALL = ("sensors[0].size_px=[96, 72]", "splits={train: 1, val: 0, test: 0}")


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> gen_data.StoredDataset:
    folder = tmp_path_factory.mktemp("torch") / "set"
    gen_data.generate("tabletop.yaml", 10, out=folder, seed=3, overrides=SMALL, workers=0)
    return gen_data.open(folder)


def test_detection_targets_are_those_of_torchvisions_reference_in_a_loader_too(stored: Any) -> None:
    """Types, shapes and ranges; boxes and labels of the data set."""
    import torch

    import gen_data.torch as gt

    image, target = gt.SampleDataset(stored)[4]
    camera = stored[4].cameras["color"]
    assert (image.dtype, tuple(image.shape)) == (torch.uint8, (3, 72, 96))
    assert np.array_equal(image.permute(1, 2, 0).numpy(), camera.rgb)
    assert target["boxes"].dtype == torch.float32
    assert target["labels"].dtype == torch.int64
    assert target["boxes"].tolist() == [list(map(float, b.xyxy)) for b in camera.boxes2d]
    assert target["labels"].tolist() == [b.category_id for b in camera.boxes2d]
    assert bool((target["boxes"][:, 2:] > target["boxes"][:, :2]).all())
    assert int(target["image_id"]) == 5
    from torch.utils.data import DataLoader

    source = gt.SampleDataset(stored)
    batches = DataLoader(source, 4, shuffle=True, num_workers=1, collate_fn=gt.collate)
    numbers = [int(t["image_id"]) for _, targets in batches for t in targets]
    assert sorted(numbers) == list(range(1, 11))


def test_masks_lie_in_their_boxes_and_have_their_areas(stored: Any) -> None:
    import gen_data.torch as gt
    from gen_data.targets import segmentation_target

    checked = 0
    for _, target in gt.SampleDataset(stored, segmentation_target):
        for mask, box, area in zip(target["masks"], target["boxes"], target["area"], strict=True):
            rows, columns = mask.nonzero(as_tuple=True)
            extent = [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
            assert [int(v) for v in extent] == box.int().tolist()
            assert int(mask.sum()) == int(area)
            checked += 1
    assert checked > 20


def test_rendering_in_training_gives_the_finished_samples(stored: Any, tmp_path: Path) -> None:
    """The same tensors in the same order, by worker processes, resumed in mid-epoch."""
    import torch

    import gen_data.torch as gt
    from gen_data.targets import depth_target

    live = gen_data.Dataset("tabletop.yaml", seed=3, n=10, overrides=SMALL)
    options: dict[str, Any] = {"batch_size": 3, "shuffle": True, "seed": 5}
    expected = list(gt.loader(stored, depth_target, **options))
    first = gt.loader(live, depth_target, workers=2, **options)
    batches = iter(first)
    got = [next(batches), next(batches)]
    second = gt.loader(live, depth_target, workers=1, **options)
    second.load_state_dict(first.state_dict())
    got += list(second)
    assert len(got) == len(expected) == 4
    for (images, depths), (stored_images, stored_depths) in zip(got, expected, strict=True):
        assert all(map(torch.equal, images, stored_images))
        for one, other in zip(depths, stored_depths, strict=True):
            # Files hold depth in units of 0.1 mm.
            assert torch.equal(one.isfinite(), other.isfinite())
            assert torch.allclose(one.nan_to_num(posinf=0), other.nan_to_num(posinf=0), atol=6e-5)


@pytest.mark.parametrize("workers", [0, 2])
def test_workers_of_a_data_loader_do_not_repeat_an_epoch(stored: Any, workers: int) -> None:
    """Each of them would have a copy of the stream: they are refused."""
    from torch.utils.data import DataLoader

    import gen_data.torch as gt

    batches = DataLoader(gt.loader(stored, batch_size=3), batch_size=None, num_workers=workers)
    if workers:
        with pytest.raises(gen_data.ConfigError, match="num_workers: a SampleStream has its own"):
            list(batches)
    else:
        numbers = [int(t["image_id"]) for _, targets in batches for t in targets]
        assert numbers == list(range(1, 11))


def test_laser_boxes_hold_their_points() -> None:
    """Points in the box's frame are inside; as many as counted."""
    import gen_data.torch as gt
    from gen_data.targets import lidar_target

    data = gen_data.Dataset("tabletop.yaml", seed=3, n=1)
    points, target = gt.to_tensors(lidar_target(data[0]))
    assert points.shape[1] == 4
    assert len(target["boxes"]) > 3
    for box, count in zip(target["boxes"], target["points"], strict=True):
        local = points[:, :3] - box[:3]
        c, s = box[6].cos(), box[6].sin()
        x, y = local[:, 0] * c + local[:, 1] * s, local[:, 1] * c - local[:, 0] * s
        reach = 0.5 * box[3:6].norm()
        near = (x.abs() < reach) & (y.abs() < reach) & (local[:, 2].abs() < reach)
        assert int(near.sum()) >= int(count) > 0


def stand_in_for_torchvision() -> tuple[ModuleType, ModuleType]:
    """``torchvision.tv_tensors`` with its signatures: subclasses of Tensor, checked shapes."""
    import torch

    class BoundingBoxes(torch.Tensor):
        def __new__(cls, data: Any, *, format: str, canvas_size: tuple[int, int]) -> Any:  # noqa: A002
            assert data.ndim == 2 and data.shape[1] == 4
            made = data.as_subclass(cls)
            made.format, made.canvas_size = format, canvas_size
            return made

    class KeyPoints(torch.Tensor):
        def __new__(cls, data: Any, *, canvas_size: tuple[int, int]) -> Any:
            assert data.shape[-1] == 2
            made = data.as_subclass(cls)
            made.canvas_size = canvas_size
            return made

    class Image(torch.Tensor):
        def __new__(cls, data: Any) -> Any:
            return data.as_subclass(cls)

    class Mask(Image):
        pass

    package, module = ModuleType("torchvision"), ModuleType("torchvision.tv_tensors")
    for kind in (BoundingBoxes, KeyPoints, Image, Mask):
        setattr(module, kind.__name__, kind)
    package.tv_tensors = module  # type: ignore[attr-defined]
    return package, module


def test_targets_are_wrapped_for_torchvision(stored: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Kinds, format and canvas as torchvision defines them; the same numbers; labels stay."""
    import torch

    import gen_data.torch as gt
    from gen_data.targets import segmentation_target

    package, module = stand_in_for_torchvision()
    monkeypatch.setitem(sys.modules, "torchvision", package)
    monkeypatch.setitem(sys.modules, "torchvision.tv_tensors", module)
    image, target = gt.to_tensors(segmentation_target(stored[4]))
    target["keypoints"] = torch.tensor([[[3.5, 7.0, 2.0], [1.0, 0.5, 0.0]]])
    picture, wrapped = gt.to_tv_tensors((image, target))
    assert type(picture) is module.Image and torch.equal(picture, image)
    assert type(wrapped["boxes"]) is module.BoundingBoxes
    assert wrapped["boxes"].format == "XYXY"
    assert wrapped["boxes"].canvas_size == wrapped["keypoints"].canvas_size == (72, 96)
    assert torch.equal(wrapped["boxes"], target["boxes"]) and len(target["boxes"]) > 0
    assert type(wrapped["masks"]) is module.Mask
    assert wrapped["masks"].shape == (len(target["boxes"]), 72, 96)
    assert wrapped["keypoints"].tolist() == [[[3.5, 7.0], [1.0, 0.5]]]
    assert wrapped["keypoint_visibility"].tolist() == [[2.0, 0.0]]
    assert type(wrapped["labels"]) is torch.Tensor
    assert type(target["boxes"]) is torch.Tensor, "the target that was passed in is unchanged"


def test_rows_of_objects_are_all_that_torchvision_does_not_filter(stored: Any) -> None:
    """Every tensor with a row per object; it filters boxes and masks by their kinds."""
    import torch

    import gen_data.torch as gt
    from gen_data.targets import segmentation_target

    sample = next(s for s in stored if len(s.boxes2d["color"]) > 3)
    image, target = gt.to_tensors(segmentation_target(sample))
    count = len(target["boxes"])
    target |= {"keypoints": torch.rand(count, 5, 2), "keypoint_visibility": torch.rand(count, 5)}
    listed = gt.object_rows((image, target))
    others = [
        v for k, v in target.items() if k not in ("boxes", "masks") and v.shape[:1] == (count,)
    ]
    assert {*map(id, listed)} == {*map(id, others)}
    assert len(listed) == 5


def test_importing_the_package_does_not_import_torch() -> None:
    import subprocess

    code = "import sys, gen_data, gen_data.targets; gen_data.Loader; print('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
