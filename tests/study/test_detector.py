"""The small detector: its loss, its pretrained features, and its detections."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest


@pytest.mark.slow
def test_the_focal_loss_has_the_slope_of_its_formula() -> None:
    """Equation 1 of "Objects as Points", differentiated by torch, in 64 bits."""
    import torch

    from gen_data.lab.study.detector import CentreLoss, encode

    rng = np.random.default_rng(0)
    corners = rng.uniform(0.0, 60.0, (2, 6, 2)).astype(np.float32)
    boxes = np.concatenate([corners, corners + 24.0], axis=2)
    labels, ignored = rng.integers(1, 4, (2, 6)), np.arange(6) == 5
    truths = [encode(b, k, ignored, (3, 24, 24)) for b, k in zip(boxes, labels, strict=True)]
    truths = [replace(t, heat=t.heat.double(), counts=t.counts.double()) for t in truths]
    logits = torch.randn((2, 3, 24, 24), dtype=torch.float64, generator=torch.manual_seed(0))
    first, second = logits.clone().requires_grad_(), logits.clone().requires_grad_()
    heat = torch.stack([truth.heat for truth in truths])
    counts = torch.stack([truth.counts for truth in truths])[:, None]
    p, is_centre = torch.sigmoid(first), heat == 1.0
    centres = (1.0 - p) ** 2 * p.log() * is_centre
    others = (1.0 - heat) ** 4 * p**2 * (1.0 - p).log() * counts * ~is_centre
    expected = -(centres.sum() + others.sum()) / is_centre.sum()
    (3.0 * expected).backward()
    found = CentreLoss.apply(second, truths)
    (3.0 * found).backward()
    assert found.item() == pytest.approx(expected.item(), rel=1e-12)
    torch.testing.assert_close(second.grad, first.grad, rtol=1e-9, atol=1e-12)


@pytest.mark.slow
def test_detections_of_one_object_are_joined_and_other_classes_and_objects_stay() -> None:
    """A network that answers with four boxes: two of a cup overlap by 0.8, a plate is there too."""
    import torch

    from gen_data.lab.study.detector import Detector, detect

    model = Detector(["cup", "plate"], 32)
    heat, boxes = torch.full((1, 2, 8, 8), -20.0), torch.zeros((1, 4, 8, 8))
    for label, row, column, logit, box in (
        (0, 1, 1, 3.0, (2.0, 2.0, 12.0, 12.0)),
        (0, 1, 4, 2.0, (2.0, 2.0, 12.0, 10.0)),
        (0, 6, 6, 1.0, (20.0, 20.0, 30.0, 30.0)),
        (1, 4, 1, 0.0, (2.0, 2.0, 12.0, 12.0)),
    ):
        heat[0, label, row, column] = logit
        boxes[0, :, row, column] = torch.tensor(box)
    model.forward = lambda _: (heat, boxes)

    found, scores, labels = detect(model, np.zeros((32, 32, 3), np.uint8), most=4)

    assert found.tolist() == [[2, 2, 12, 12], [20, 20, 30, 30], [2, 2, 12, 12]]
    assert labels.tolist() == [1, 1, 2]
    assert scores == pytest.approx([1 / (1 + np.exp(-3.0)), 1 / (1 + np.exp(-1.0)), 0.5], abs=1e-6)


@pytest.mark.slow
def test_training_changes_the_last_pretrained_blocks_and_keeps_the_first_ones(
    tmp_path: Path,
) -> None:
    """Weights, means and variances; features halve their size four times, and survive a file."""
    import torch

    from gen_data.lab.study.detector import Detector, detect
    from gen_data.lab.study.pretrained import FROZEN
    from gen_data.lab.study.training import fit

    torch.manual_seed(0)
    model = Detector(["cup"], 64, pretrained=True)
    before = {name: value.clone() for name, value in model.state_dict().items()}
    sizes = [scale.shape[1:] for scale in model.features(torch.zeros((1, 3, 64, 96)))]
    image = np.random.default_rng(0).integers(0, 256, (3, 64, 64), np.uint8)
    target = (
        image,
        {
            "boxes": np.array([[8.0, 8.0, 40.0, 40.0]], np.float32),
            "labels": np.array([1]),
            "iscrowd": np.array([0]),
        },
    )

    fit(model, [[target] * 2] * 3, lambda step: step / 3)
    model.save(tmp_path / "detector.pt")

    assert sizes == [(24, 16, 24), (40, 8, 12), (112, 4, 6), (320, 2, 3)]
    first = ("features.stem.", *(f"features.blocks.{k}." for k in range(FROZEN)))
    changed = {n for n, value in model.state_dict().items() if not torch.equal(value, before[n])}
    assert not [name for name in changed if name.startswith(first)]
    assert {name for name in before if name not in changed and not name.startswith(first)} == set()
    stored = detect(Detector.load(tmp_path / "detector.pt"), image.transpose(1, 2, 0))
    for mine, theirs in zip(detect(model, image.transpose(1, 2, 0)), stored, strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=1e-4, atol=1e-3)
