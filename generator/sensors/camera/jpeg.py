"""Artefacts of JPEG compression."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray


def compress_jpeg(image: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """Encode and decode an image as JPEG, uint8 [h, w, 3].

    Args:
        image: sRGB, uint8 [h, w, 3].
        quality: Quality of libjpeg, 1 to 100.
    """
    ok, data = cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert ok, "the JPEG encoder takes any RGB image"
    decoded = cv2.imdecode(data, cv2.IMREAD_COLOR)
    assert decoded is not None, "encoded bytes can be decoded"
    return np.ascontiguousarray(decoded[..., ::-1], np.uint8)
