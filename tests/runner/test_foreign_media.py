"""Media of another kind than the manifest declares are refused when they are read."""

from pathlib import Path

import numpy as np
import pytest

import gen_data
from gen_data.core.capture import POINT, Channel
from gen_data.core.errors import StorageError
from gen_data.exporters.png import RowFilter, encode_png
from gen_data.runner.stored import StoredSamples

pytestmark = pytest.mark.filterwarnings("ignore:splits")

HEIGHT_PX, WIDTH_PX = 48, 64


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("media") / "table"
    gen_data.generate(
        "tabletop.yaml", 1, out=out, workers=0, overrides=["sensors.color.size_px=[64,48]"]
    )
    return out


def png(shape: tuple[int, ...], dtype: type[np.generic], value: int = 1) -> bytes:
    return encode_png(np.full(shape, value, dtype), RowFilter.SUB, 1)


@pytest.mark.parametrize("channel", [Channel.RGB, Channel.Z_DEPTH, Channel.INSTANCE])
@pytest.mark.parametrize(
    ("shape", "dtype"),
    [((HEIGHT_PX * 2, WIDTH_PX * 2), np.uint16), ((HEIGHT_PX * 2, WIDTH_PX * 2, 3), np.uint8),
     ((WIDTH_PX, HEIGHT_PX, 3), np.uint8), ((HEIGHT_PX, WIDTH_PX), np.uint8),
     ((HEIGHT_PX, WIDTH_PX, 3), np.uint16)],
)  # fmt: skip
def test_images_of_another_kind_or_size_are_refused(
    folder: Path, channel: Channel, shape: tuple[int, ...], dtype: type[np.generic]
) -> None:
    image = StoredSamples(folder).labelled(0).capture.readings["color"].channels
    path = next((folder / "shards").rglob(f"color/{channel.value}/000000000.png"))
    kept = path.read_bytes()
    try:
        path.write_bytes(png(shape, dtype))
        with pytest.raises(StorageError, match=rf"{path}: holds .* of channel {channel.value}"):
            _ = image[channel]
    finally:
        path.write_bytes(kept)
    _ = image[channel]


@pytest.mark.parametrize(
    ("points", "fact"),
    [(np.zeros(3, np.float32), "expected a list of"),
     (np.zeros((2, 2), POINT), "records \\[2, 2\\]"),
     (np.full(2, np.nan, np.float32).astype([("position_m", "<f4")]), "expected a list of")],
)  # fmt: skip
def test_points_of_another_kind_are_refused(
    folder: Path, points: np.ndarray[tuple[int, ...], np.dtype[np.generic]], fact: str
) -> None:
    clouds = StoredSamples(folder).labelled(0).capture.clouds
    [path] = (folder / "shards").rglob("pseudo_lidar/points/000000000.npy")
    kept = path.read_bytes()
    try:
        np.save(path, points)
        with pytest.raises(StorageError, match=fact):
            _ = clouds["pseudo_lidar"]
        endless = np.zeros(2, POINT)
        endless["position_m"][1, 2] = np.nan
        np.save(path, endless)
        with pytest.raises(StorageError, match="not finite"):
            _ = clouds["pseudo_lidar"]
    finally:
        path.write_bytes(kept)
    assert len(clouds["pseudo_lidar"].points)
