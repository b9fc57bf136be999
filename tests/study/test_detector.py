"""The loss that the small detector is trained with."""

from dataclasses import replace

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
