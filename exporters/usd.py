"""OpenUSD: the world of every view as a stage.

::

    000000012.usdc      number of the first sample; a sequence is one stage, its steps time codes
    assets/<asset>.usdc    meshes with their own materials, shared by all stages
    textures/<texture>.png, environments/<sky>.hdr
    stages.jsonl        one line per stage: file, first sample, scene, view, split, steps

See ``gen_data.usd.stage_writer`` for the layout of a stage. Metres, Z up; ``time code =
step``. A camera with ``time_offset_s`` has its delay in ``genData:timeOffset``; the stage also has
the poses of these instants, which are other time codes. Labels are ``UsdSemantics.LabelsAPI`` with
the taxonomies ``category``, ``subcategory`` (annotated instances) and ``instance_id`` (all, as in
the masks). Cameras reproduce the intrinsics of pinholes to float precision; lights are photometric,
in UsdLux's units. Triplanar mapping becomes a projection along each face's dominant axis; weather
has no counterpart. Lenses other than pinholes have none either: their cameras are pinholes of the
same focal length, with the model and its coefficients in ``genData:lens:*``.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import astuple
from hashlib import sha256
from pathlib import Path
from typing import Any, ClassVar, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core import asset_types, scene_time
from gen_data.core.interfaces import AssetLibrary, DatasetInfo
from gen_data.core.sample import Sample
from gen_data.core.serialization import canonical_json
from gen_data.exporters import base, image_files, png, sequences
from gen_data.exporters.conventions import Conventions
from gen_data.usd.asset_layer import TextureFiles, write_asset_layer
from gen_data.usd.stage_writer import StageFiles, write_stage

STAGES = "stages.jsonl"


class Usd(base.AssetExporter):
    """One OpenUSD stage per view, with meshes, materials, lights, cameras and labels.

    Attributes:
        format: File format of all layers: ``usdc`` binary, ``usda`` text.
    """

    type: Literal["usd"] = "usd"
    shows_truth: ClassVar[bool] = True
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5",
        lens="any; `genData:lens:*`",
        time="time code = step; `timeCodesPerSecond` of the stage",
    )

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    format: Literal["usdc", "usda"] = "usdc"

    def check(self, info: DatasetInfo) -> None:
        """Refuse a machine without the format's library.

        Raises:
            ConfigError: it is not installed.
        """
        del info
        base.check_installed(self.type, "pxr")

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write a stage for every sequence that starts in the shard, and its shared files."""
        folder = shard_dir / self.type
        shared = _SharedFiles(folder, self.format, self.library)
        rows = []
        for sample in samples:
            if sample.step_index:
                continue
            count = min(info.steps_per_scene, info.n - sample.index)
            offsets_s = {s.name: s.time_offset_s for s in info.sensors if s.name in info.cameras}
            times_s = {
                round(k * info.step_s + offset_s, 9)
                for k in range(count)
                for offset_s in (0.0, *offsets_s.values())
            }
            instants = [scene_time.scene_at(sample.scene, time_s) for time_s in sorted(times_s)]
            path = folder / f"{sample.index:09d}.{self.format}"
            write_stage(path, instants, info.step_s, shared.files(), offsets_s)
            rows.append(_row(sample, path.name, count))
        sequences.write_text(folder / STAGES, "".join(canonical_json(row) + "\n" for row in rows))

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link stages and shared files, and join the lines."""
        del info
        folders = [shard_dir / self.type for shard_dir in shard_dirs]
        for folder in folders:
            for path in sorted(p for p in folder.rglob("*") if p.is_file() and p.name != STAGES):
                target = dataset_dir / path.relative_to(folder)
                # A shared file has the same bytes in all shards.
                if not target.exists():
                    image_files.link_or_copy(path, target)
        lines = "".join((folder / STAGES).read_text("utf-8") for folder in folders)
        sequences.write_text(dataset_dir / STAGES, lines)


def _row(sample: Sample, name: str, steps: int) -> dict[str, Any]:
    return {
        "file": name,
        "index": sample.index,
        "scene": sample.scene_index,
        "view": sample.view_index,
        "split": sample.split,
        "steps": steps,
    }


def _pack_shares(images: asset_types.TextureData) -> NDArray[np.uint8] | None:
    """Pack occlusion in red and metallic in blue, as glTF does; None without either."""
    if images.occlusion is None and images.metallic is None:
        return None
    full = np.full(images.albedo.shape[:2], 255, np.uint8)
    red, blue = (full if m is None else m for m in (images.occlusion, images.metallic))
    return np.stack([red, full, blue], axis=2)


class _SharedFiles:
    """Shared files of a shard's stages; each is written at its first use."""

    def __init__(self, folder: Path, suffix: str, assets: AssetLibrary) -> None:
        self._folder, self._suffix, self.library = folder, suffix, assets
        self._written: dict[str, TextureFiles] = {}

    def files(self) -> StageFiles:
        """Return functions that give paths relative to the stages, and write missing files."""
        return StageFiles(
            layer=lambda asset: f"./{self._layer(asset)}",
            textures=lambda texture: self._textures(texture, "./"),
            panorama=lambda sky: f"./{self._panorama(sky)}",
            materials=self.library.materials,
        )

    def _layer(self, asset: str) -> str:
        name = f"assets/{_file_name(asset)}.{self._suffix}"
        if not (self._folder / name).exists():
            mesh = self.library.mesh(asset)
            write_asset_layer(self._folder / name, mesh, lambda t: self._textures(t, "../"))
        return name

    def _textures(self, texture: str, up: str) -> TextureFiles:
        if texture not in self._written:
            stem = f"textures/{_file_name(texture)}"
            images = self.library.texture(texture)
            self._written[texture] = TextureFiles(
                self._image(f"{stem}.png", images.albedo),
                self._image(f"{stem}.roughness.png", images.roughness),
                self._image(f"{stem}.normal.png", images.normal),
                self._image(f"{stem}.shares.png", _pack_shares(images)),
                self._image(f"{stem}.emission.png", images.emission),
                self._image(f"{stem}.alpha.png", images.alpha),
            )
        names = astuple(self._written[texture])
        return TextureFiles(*(up + name if name else "" for name in names))

    def _image(self, name: str, pixels: NDArray[Any] | None) -> str:
        """Write an image and return its name; empty if there is none."""
        if pixels is None:
            return ""
        sequences.write_bytes(self._folder / name, png.encode_png(pixels, png.RowFilter.SUB, 2))
        return name

    def _panorama(self, sky: str) -> str:
        name = f"environments/{_file_name(sky)}.hdr"
        if not (self._folder / name).exists():
            bgr = np.ascontiguousarray(self.library.environment(sky)[..., ::-1])
            _, data = cv2.imencode(".hdr", bgr)
            sequences.write_bytes(self._folder / name, data.tobytes())
        return name


def _file_name(identity: str) -> str:
    """Readable file name of an id, unique by its digest."""
    digest = sha256(identity.encode()).hexdigest()[:10]
    return f"{re.sub(r'[^A-Za-z0-9]+', '_', identity)[:48].strip('_')}-{digest}"
