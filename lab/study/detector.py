"""A small object detector, complete: network, training targets, loss, and detection in an image.

It follows TTFNet (Liu et al., "Training-Time-Friendly Network for Real-Time Object Detection",
AAAI 2020): a heat map of object centres per class, and at each place near a centre the distances
to the four sides of the box. Boxes are ``x_min, y_min, x_max, y_max`` [px], half-open.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from pickle import UnpicklingError
from typing import Any

import cv2
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from gen_data.core.errors import ConfigError
from gen_data.lab.study.pretrained import Features

STRIDE = 4
"""Pixels of the network's input per place of its output."""

SPREAD = 0.54 / 6.0
"""Standard deviation of a centre in the heat map, as a share of the box (TTFNet, section 4)."""

PRETRAINED_RATE = 0.3
"""Learning rate of pretrained features, as a share of the others'."""

SCALING = 0.35
"""Largest natural logarithm of the random scale of training images."""

SAME_OBJECT_IOU = 0.7
"""Intersection over union above which detections of a class are of one object."""

Floats = NDArray[np.float32]
Image = NDArray[np.uint8]


def convolve(inner: int, outer: int, stride: int = 1) -> nn.Sequential:
    """A 3 x 3 convolution, batch normalisation and ReLU."""
    layer = nn.Conv2d(inner, outer, 3, stride, 1, bias=False)
    return nn.Sequential(layer, nn.BatchNorm2d(outer), nn.ReLU(inplace=True))


class Residual(nn.Module):
    """Two convolutions parallel to an identity (He et al., 2016)."""

    def __init__(self, width: int) -> None:
        super().__init__()
        last = nn.Conv2d(width, width, 3, 1, 1, bias=False)
        self.body = nn.Sequential(convolve(width, width), last, nn.BatchNorm2d(width))

    def forward(self, features: Tensor) -> Tensor:
        """Features of the same shape."""
        return functional.relu(features + self.body(features))


class Residuals(nn.Module):
    """Residual network of 0.2 million parameters: features with strides of 4, 8 and 16 pixels.

    Attributes:
        channels: Numbers of channels, from fine to coarse.
    """

    def __init__(self, width: int) -> None:
        super().__init__()
        w = width
        self.channels = w, 2 * w, 4 * w
        self.fine = nn.Sequential(convolve(3, w // 2, 2), convolve(w // 2, w, 2), Residual(w))
        self.middle = nn.Sequential(convolve(w, 2 * w, 2), *(Residual(2 * w) for _ in range(2)))
        self.coarse = nn.Sequential(convolve(2 * w, 4 * w, 2), *(Residual(4 * w) for _ in range(3)))

    def forward(self, images: Tensor) -> list[Tensor]:
        """Features of images, from fine to coarse."""
        fine = self.fine(images)
        middle = self.middle(fine)
        return [fine, middle, self.coarse(middle)]


class Detector(nn.Module):
    """Features of several scales, joined from coarse to fine, and heads for centres and boxes.

    Args:
        classes: Names of the classes, in the order of their labels, which start at 1.
        size_px: Longest side of the images that it is trained on.
        width: Channels of the finest scale; the joined features have twice as many.
        pretrained: Features of ``pretrained.Features``, trained on photographs, instead of
            ``Residuals``.
        weights: State of a trained detector, as of ``state_dict``; None = untrained.

    Attributes:
        coarsest_px: Stride of the coarsest features: width and height of the input are multiples.
    """

    def __init__(
        self,
        classes: Sequence[str],
        size_px: int,
        width: int = 16,
        *,
        pretrained: bool = False,
        weights: Mapping[str, Any] | None = None,
    ) -> None:
        super().__init__()
        self.classes, self.size_px, self.width = tuple(classes), size_px, width
        self.pretrained = pretrained
        self.features = Features(on_photographs=weights is None) if pretrained else Residuals(width)
        w, scales = width, self.features.channels
        self.coarsest_px = STRIDE * 2 ** (len(scales) - 1)
        self.laterals = nn.ModuleList(nn.Conv2d(channels, 2 * w, 1) for channels in scales)
        self.joins = nn.ModuleList(convolve(2 * w, 2 * w) for _ in scales[2:])
        self.heat = nn.Sequential(convolve(2 * w, 2 * w), nn.Conv2d(2 * w, len(classes), 1))
        self.sides = nn.Sequential(convolve(2 * w, w), nn.Conv2d(w, 4, 1))
        # A centre is rare: its prior is 1 % (Lin et al., "Focal Loss", 2017, section 4.1).
        nn.init.constant_(self.heat[-1].bias, -4.6)
        nn.init.constant_(self.sides[-1].bias, 1.0)
        if weights is not None:
            self.load_state_dict(weights)

    def forward(self, images: Tensor) -> tuple[Tensor, Tensor]:
        """Logits of the heat map, and boxes.

        Args:
            images: float32 [b, 3, h, w] in [0, 1]; h and w are multiples of ``coarsest_px``.

        Returns:
            Logits [b, classes, h/4, w/4] and boxes [b, 4, h/4, w/4] in pixels of the images.
        """
        joined, *finer = reversed(
            [
                lateral(scale)
                for lateral, scale in zip(self.laterals, self.features(images), strict=True)
            ]
        )
        joins = [*self.joins, functional.relu]
        for scale, join in zip(finer, joins, strict=True):
            joined = join(scale + functional.interpolate(joined, size=scale.shape[-2:]))
        distances = STRIDE * self.sides(joined).clamp(max=6.0).exp()
        rows = (torch.arange(joined.shape[-2]) + 0.5) * STRIDE
        columns = (torch.arange(joined.shape[-1]) + 0.5) * STRIDE
        y, x = torch.meshgrid(rows, columns, indexing="ij")
        left, top, right, bottom = distances.unbind(1)
        return self.heat(joined), torch.stack([x - left, y - top, x + right, y + bottom], 1)

    def parameter_groups(self, rate: float) -> list[dict[str, Any]]:
        """Groups for an optimiser; features that were trained before learn more slowly."""
        features = [p for p in self.features.parameters() if p.requires_grad]
        others = [p for name, p in self.named_parameters() if not name.startswith("features.")]
        slower = PRETRAINED_RATE if self.pretrained else 1.0
        return [{"params": features, "lr": slower * rate}, {"params": others, "lr": rate}]

    def save(self, path: Path) -> None:
        """Write weights and classes."""
        names = ("classes", "size_px", "width", "pretrained")
        content = {name: getattr(self, name) for name in names}
        torch.save(content | {"classes": list(self.classes), "weights": self.state_dict()}, path)

    @staticmethod
    def load(path: Path) -> "Detector":
        """Read a file of ``save``, ready to detect. Raises ConfigError if it is not such a file."""
        try:
            content = torch.load(path, weights_only=True)
            model = Detector(**content)
        except (OSError, UnpicklingError, EOFError, LookupError, TypeError, RuntimeError) as error:
            reason = str(error).partition("\n")[0]
            raise ConfigError(
                f"{path}: cannot be read as a detector of gen-data study ({reason}); expected a "
                "file detector.pt in one of the folders runs/ of a study"
            ) from error
        model.eval()
        return model


def input_size(image: Image, size_px: int, coarsest_px: int) -> tuple[int, int]:
    """Width and height of the network's input for an image [h, w, 3]: padded, same proportions."""
    height, width = image.shape[:2]
    scale = size_px / max(height, width)
    across, down = (int(-(-scale * side // coarsest_px)) * coarsest_px for side in (width, height))
    return across, down


def augment(
    image: Image, boxes: Floats, model: Detector, rng: np.random.Generator
) -> tuple[Image, Floats]:
    """Random scale, place, mirroring and colour of an image [h, w, 3] with boxes [n, 4].

    Returns:
        The image in the size of the network's input, and its boxes, clipped; the box of an object
        with less than a third of it in the image is empty.
    """
    across, down = input_size(image, model.size_px, model.coarsest_px)
    height, width = image.shape[:2]
    scale = model.size_px / max(height, width) * np.exp(rng.uniform(-SCALING, SCALING))
    shift = rng.uniform(0.0, 1.0, 2) * (across - scale * width, down - scale * height)
    matrix = np.array([[scale, 0.0, shift[0]], [0.0, scale, shift[1]]])
    if rng.uniform() < 0.5:
        matrix[0] = -scale, 0.0, across - shift[0]
    # Continuous image coordinates have pixel centres at i + 0.5, OpenCV's at i.
    centred = matrix.copy()
    centred[:, 2] += matrix[:, :2] @ (0.5, 0.5) - 0.5
    moved = cv2.warpAffine(image, centred, (across, down)).astype(np.float32)
    moved *= rng.uniform(0.8, 1.25) * rng.uniform(0.95, 1.05, 3).astype(np.float32)
    moved += rng.uniform(-15.0, 15.0)
    x = np.sort(matrix[0, 0] * boxes[:, [0, 2]] + matrix[0, 2], axis=1)
    y = matrix[1, 1] * boxes[:, [1, 3]] + matrix[1, 2]
    kept_x, kept_y = np.clip(x, 0.0, across), np.clip(y, 0.0, down)
    share = (
        np.ptp(kept_x, axis=1) * np.ptp(kept_y, axis=1) / (np.ptp(x, axis=1) * np.ptp(y, axis=1))
    )
    clipped = np.stack([kept_x[:, 0], kept_y[:, 0], kept_x[:, 1], kept_y[:, 1]], axis=1)
    clipped[share < 1.0 / 3.0] = 0.0
    return np.clip(moved, 0.0, 255.0).astype(np.uint8), clipped.astype(np.float32)


@dataclass(frozen=True)
class Truth:
    """Training target of images, at the places of the network's output.

    Attributes:
        heat: Heat map [classes, h, w]; 1 at the place of a centre.
        counts: [h, w]; 0 inside ignored boxes, where the heat map is not trained.
        boxes: Box of the object that each place belongs to [4, h, w].
        weights: Weight of that box [h, w]; 0 = no object.
    """

    heat: Tensor
    counts: Tensor
    boxes: Tensor
    weights: Tensor


def encode(
    boxes: Floats, labels: NDArray[np.int64], ignored: NDArray[np.bool_], shape: tuple[int, ...]
) -> Truth:
    """Encode boxes [n, 4] with labels [n] for an output of shape (classes, h, w)."""
    heat, counts = np.zeros(shape, np.float32), np.ones(shape[1:], np.float32)
    sides, weights = np.zeros((4, *shape[1:]), np.float32), np.zeros(shape[1:], np.float32)
    rows, columns = np.mgrid[: shape[1], : shape[2]].astype(np.float32)
    area = (boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])
    for number in np.argsort(-area):  # the smallest box wins where objects overlap
        x0, y0, x1, y1 = boxes[number] / STRIDE
        if area[number] < 1.0:
            continue
        if ignored[number]:
            counts[int(y0) : int(np.ceil(y1)), int(x0) : int(np.ceil(x1))] = 0.0
            continue
        row, column = int(min((y0 + y1) / 2, shape[1] - 1)), int(min((x0 + x1) / 2, shape[2] - 1))
        spread_x, spread_y = max(SPREAD * (x1 - x0), 0.4), max(SPREAD * (y1 - y0), 0.4)
        away = ((columns - column) / spread_x) ** 2 + ((rows - row) / spread_y) ** 2
        spot = np.where(away < 9.0, np.exp(-0.5 * away), 0.0)
        np.maximum(heat[labels[number] - 1], spot, out=heat[labels[number] - 1])
        near = spot > 0.0
        sides[:, near] = boxes[number][:, None]
        # All places of an object together weigh the logarithm of its area (equation 6).
        weights[near] = (np.log(1.0 + area[number]) * spot / spot.sum())[near]
    return Truth(*(torch.from_numpy(part) for part in (heat, counts, sides, weights)))


def compute_loss(logits: Tensor, boxes: Tensor, truths: Sequence[Truth]) -> Tensor:
    """Focal loss of the heat maps, plus five times the GIoU loss of the boxes."""
    weights = torch.stack([truth.weights for truth in truths])
    focal: Tensor = CentreLoss.apply(logits, truths)
    overlap = compute_giou(boxes, torch.stack([truth.boxes for truth in truths]))
    return focal + 5.0 * ((1.0 - overlap) * weights).sum() / weights.sum().clamp(min=1e-6)


class CentreLoss(torch.autograd.Function):
    """Focal loss of heat maps by CenterNet (Zhou et al., "Objects as Points", 2019, equation 1).

    With ``p`` the sigmoid of a logit: ``-(1 - p)^2 log(p)`` at centres, and elsewhere
    ``-(1 - heat)^4 p^2 log(1 - p)``; over the number of centres. The slope is computed with the
    loss, one image at a time: with a hundred classes, the intermediate tensors that automatic
    differentiation keeps fit no cache, and took longer than the network.
    """

    @staticmethod
    def forward(ctx: Any, logits: Tensor, truths: Sequence[Truth]) -> Tensor:
        """Loss of logits [b, classes, h, w]."""
        slopes, total, centres = torch.empty_like(logits), 0.0, 0
        for image, truth, slope in zip(logits, truths, slopes, strict=True):
            p = torch.sigmoid(image).clamp_(1e-4, 1.0 - 1e-4)
            q = 1.0 - p
            weight = (1.0 - truth.heat).square_().square_().mul_(truth.counts).mul_(p).mul_(p)
            log_q = torch.log(q)
            total -= float((weight * log_q).sum())
            torch.mul(weight, q.mul_(log_q).mul_(2.0).sub_(p).neg_(), out=slope)
            at = truth.heat == 1.0
            found = p[at]
            missed = 1.0 - found
            total -= float((missed**2 * found.log()).sum())
            slope[at] = missed**2 * (2.0 * found * found.log() - missed)
            centres += len(found)
        number = max(centres, 1)
        ctx.save_for_backward(slopes.div_(number))
        return logits.new_tensor(total / number)

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor, None]:
        """Slope by the logits."""
        (slopes,) = ctx.saved_tensors
        return slopes * grads[0], None


def compute_giou(first: Tensor, second: Tensor) -> Tensor:
    """Generalised IoU (Rezatofighi et al., 2019) of boxes [b, 4, ...], in [-1, 1]."""
    ax0, ay0, ax1, ay1 = first.unbind(1)
    bx0, by0, bx1, by1 = second.unbind(1)
    common = (torch.minimum(ax1, bx1) - torch.maximum(ax0, bx0)).clamp(min=0) * (
        torch.minimum(ay1, by1) - torch.maximum(ay0, by0)
    ).clamp(min=0)
    union = (ax1 - ax0) * (ay1 - ay0) + (bx1 - bx0) * (by1 - by0) - common
    hull = (torch.maximum(ax1, bx1) - torch.minimum(ax0, bx0)) * (
        torch.maximum(ay1, by1) - torch.minimum(ay0, by0)
    )
    return common / union.clamp(min=1e-6) - (hull - union) / hull.clamp(min=1e-6)


def detect(
    model: Detector, image: Image, most: int = 100
) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Detect objects in an RGB image [h, w, 3].

    Returns:
        Boxes [n, 4] in its pixels, scores [n] and labels [n] from 1, best first; at most ``most``.
    """
    across, down = input_size(image, model.size_px, model.coarsest_px)
    scale = model.size_px / max(image.shape[:2])
    filter_ = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_LINEAR
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=filter_)
    padded = np.zeros((down, across, 3), np.float32)
    padded[: small.shape[0], : small.shape[1]] = small / 255.0
    with torch.inference_mode():
        logits, boxes = model(torch.from_numpy(padded).permute(2, 0, 1)[None])
    heat = torch.sigmoid(logits[0])
    peaks = heat * (functional.max_pool2d(heat, 3, 1, 1) == heat)
    scores, places = peaks.flatten().topk(min(most, peaks.numel()))
    labels, cells = places // heat[0].numel(), places % heat[0].numel()
    found = boxes[0].flatten(1)[:, cells].T / scale
    found[:, 0::2].clamp_(0.0, image.shape[1])
    found[:, 1::2].clamp_(0.0, image.shape[0])
    # Large objects have several peaks.
    sides = torch.cat([found[:, :2], found[:, 2:] - found[:, :2]], 1).numpy()
    kept = cv2.dnn.NMSBoxesBatched(sides, scores.numpy(), labels.numpy(), 0.0, SAME_OBJECT_IOU)
    best = np.sort(np.asarray(kept, np.int64))
    return found.numpy()[best], scores.numpy()[best], labels.numpy()[best] + 1
