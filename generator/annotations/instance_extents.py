"""Extents of instances in images: one pass over the id image, then crops."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core import errors, sample
from gen_data.core.boxes import BoxPx
from gen_data.core.capture import Channel, SensorReading, Silhouette
from gen_data.core.scene import Instance


@dataclass(frozen=True, slots=True)
class Extent:
    """Number of pixels with an id, and the tight box around them."""

    visible_px: int
    box: BoxPx


def find_extents(ids: NDArray[np.uint16]) -> dict[int, Extent]:
    """Pixel count and tight box of every id but 0 in an id image, shape [height, width].

    The image is first split into horizontal runs of equal ids: the cost of the rest depends on the
    number of runs (thousands), not on the number of pixels or objects.
    """
    height, width = ids.shape
    flat = ids.ravel()
    changes = np.ones(flat.size, dtype=bool)
    np.not_equal(flat[1:], flat[:-1], out=changes[1:])
    changes[::width] = True
    starts = np.flatnonzero(changes)
    lengths = np.diff(starts, append=flat.size)
    seen = flat[starts] != 0
    starts, lengths = starts[seen], lengths[seen]
    owners = flat[starts].astype(np.intp)
    rows, columns = np.divmod(starts, width)

    n = int(owners.max(initial=0)) + 1
    low = np.full((2, n), max(height, width))
    high = np.zeros((2, n), dtype=low.dtype)
    np.minimum.at(low[0], owners, columns)
    np.minimum.at(low[1], owners, rows)
    np.maximum.at(high[0], owners, columns + lengths)
    np.maximum.at(high[1], owners, rows + 1)
    counts = np.zeros(n, dtype=np.intp)
    np.add.at(counts, owners, lengths)
    return {
        int(k): Extent(
            int(counts[k]), BoxPx(int(low[0, k]), int(low[1, k]), int(high[0, k]), int(high[1, k]))
        )
        for k in np.flatnonzero(counts)
    }


def instance_error(reading: SensorReading, instance: Instance, fault: str) -> errors.SampleError:
    """An error that names sensor and instance."""
    return errors.SampleError(
        f"sensor '{reading.sensor}', instance {instance.instance_id} '{instance.name}': {fault}"
    )


def crop(image: NDArray[np.generic], box: BoxPx) -> NDArray[np.generic]:
    """The part of an image that a box inside it covers, as a view."""
    return image[box.window()]


def visible_mask(reading: SensorReading, truth: sample.ObjectTruth) -> NDArray[np.bool_]:
    """The object's visible pixels inside its box, bool [box height, box width]."""
    if truth.box is None:
        return np.zeros((0, 0), dtype=bool)
    ids = crop(reading.channels[Channel.INSTANCE], truth.box)
    return np.asarray(ids == truth.instance.instance_id)


def find_silhouette(reading: SensorReading, instance: Instance) -> Silhouette:
    """The silhouette of an instance as if nothing occluded it.

    Raises:
        SampleError: the renderer returned none.
    """
    silhouette = reading.silhouettes.get(instance.instance_id)
    if silhouette is None:
        raise instance_error(
            reading,
            instance,
            "the renderer returned no silhouette of it although the amodal channel was requested",
        )
    return silhouette


def silhouette_box(silhouette: Silhouette) -> BoxPx | None:
    """The tight box of a silhouette, possibly outside the image; None if it is empty."""
    height, width = silhouette.mask.shape
    if height == 0 or width == 0:
        return None
    x, y = silhouette.x_px, silhouette.y_px
    return BoxPx(x, y, x + width, y + height)


def silhouette_crop(silhouette: Silhouette, box: BoxPx) -> NDArray[np.bool_]:
    """The silhouette's pixels inside a box that lies within the silhouette's own, as a view."""
    return silhouette.mask[box.window(silhouette.x_px, silhouette.y_px)]
