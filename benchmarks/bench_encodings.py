"""Size and speed of the encodings of photographs: ``python -m benchmarks.bench_encodings FOLDER``.

FOLDER is a finished data set, in PNG, of a camera with the channel rgb. Its first ``--n``
photographs are encoded and decoded again in every encoding. Prints kilobytes, CPU milliseconds of
both, and the peak signal-to-noise ratio (PSNR) of the result.
"""

import argparse
import tempfile
import time
from pathlib import Path
from typing import get_args

import numpy as np

from gen_data.core.capture import Channel, ImageEncoding, ImageFormat
from gen_data.exporters.image_files import encode_channel, read_image
from gen_data.runner.stored import StoredSamples

QUALITIES = {"jpeg": (85, 92, 97), "webp": (85, 92)}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--n", type=int, default=20)
    args = parser.parse_args()
    stored = StoredSamples(args.folder)
    camera = next(c for c in stored.info.cameras if Channel.RGB in stored.info.media[c])
    images = [
        stored.sample(index).capture.readings[camera].channels[Channel.RGB]
        for index in stored.indices[: args.n]
    ]
    print(f"{'per image of ' + 'x'.join(map(str, images[0].shape[1::-1])):<24}"
          f"{'kB':>8}{'encode ms':>11}{'decode ms':>11}{'PSNR dB':>9}")  # fmt: skip
    for kind in get_args(ImageFormat):
        for quality in QUALITIES.get(kind, (0,)):
            encoding = ImageEncoding(kind, quality)
            label = f"{kind} {quality or ''}"
            print(f"{label:<24}" + describe(images, encoding))


def describe(images: list[np.ndarray], encoding: ImageEncoding) -> str:
    """Means over images: kilobytes, CPU milliseconds to encode and decode, PSNR."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{k}{encoding.suffix}" for k in range(len(images))]
        started_s = time.process_time()
        for path, image in zip(paths, images, strict=True):
            path.write_bytes(encode_channel(Channel.RGB, image, 1.0, encoding))
        encoded_s = time.process_time()
        read = [read_image(path, Channel.RGB, 1.0) for path in paths]
        decoded_s = time.process_time()
        kilobytes = sum(path.stat().st_size for path in paths) / 1e3 / len(paths)
    errors = [np.mean((a.astype(float) - b) ** 2) for a, b in zip(read, images, strict=True)]
    mean = float(np.mean(errors))
    psnr_db = f"{10 * np.log10(255**2 / mean):9.1f}" if mean else f"{'exact':>9}"
    encode_ms, decode_ms = (
        1e3 * seconds / len(images) for seconds in (encoded_s - started_s, decoded_s - encoded_s)
    )
    return f"{kilobytes:8.0f}{encode_ms:11.1f}{decode_ms:11.1f}{psnr_db}"


if __name__ == "__main__":
    main()
