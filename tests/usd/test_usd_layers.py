"""Coats, glass, holes and further maps: exported, they come back, and nonsense is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gen_data.assets.library import open_library
from gen_data.core.asset_types import Material, MeshData, TextureData
from gen_data.core.errors import AssetError
from gen_data.exporters.usd import _SharedFiles
from tests.renderers.fake_library import FakeLibrary, plane_mesh
from tests.usd.stages import add_mesh, bind, new_stage, surface


def returned(folder: Path, material: Material, texture: TextureData | None = None) -> MeshData:
    """A square with a material, written as a layer and read as a user's asset."""
    mesh = plane_mesh(1.0, (material,))
    assets = FakeLibrary({"sheet": mesh}, {"map": texture} if texture else {})
    files = _SharedFiles(folder / "out", "usda", assets).files()
    (folder / "out").mkdir()
    layer = folder / "out" / files.layer("sheet")
    library = open_library([folder / "out"], cache_dir=folder / "cache")
    return library.mesh(f"user/assets/{layer.stem}")


@pytest.mark.parametrize(
    "changes",
    [{"coat": 0.75, "coat_roughness": 0.125},
     {"transmission": 0.5, "ior": 1.25, "specular": 0.1543}, {"opacity": 0.25},
     {"emission_cd_m2": (100.0, 50.0, 25.0)}],
    ids=lambda changes: next(iter(changes)),
)  # fmt: skip
def test_numbers_come_back(tmp_path: Path, changes: dict[str, object]) -> None:
    """Each kind of layer by itself; other values do not change."""
    material = replace(Material(base_color=(0.5, 0.25, 0.125)), **changes)
    (read,) = returned(tmp_path, material).materials
    names = ("coat", "coat_roughness", "transmission", "opacity", "emission_cd_m2", "base_color")
    for name in names:
        if name != "coat_roughness" or material.coat:
            assert getattr(read, name) == pytest.approx(getattr(material, name), abs=1e-4), name
    if material.transmission:
        assert read.ior == pytest.approx(material.ior, abs=1e-4)


def test_maps_come_back(tmp_path: Path) -> None:
    """Colour, roughness, normals, metal, occlusion, emission and holes of one texture."""
    rng = np.random.default_rng(3)
    colors, shares = ("albedo", "normal", "emission"), ("roughness", "metallic", "occlusion")
    images = {name: rng.integers(0, 256, (8, 8, 3)) for name in colors}
    images |= {name: rng.integers(0, 256, (8, 8)) for name in shares}
    alpha = np.where(rng.random((8, 8)) < 0.5, 0, 255)
    texture = TextureData(
        **{name: image.astype(np.uint8) for name, image in images.items()},
        alpha=alpha.astype(np.uint8),
    )
    material = Material((1.0, 1.0, 1.0), 1.0, 1.0, texture="map", emission_cd_m2=(9.0, 9.0, 9.0))
    mesh = returned(tmp_path, material, texture)
    (read,) = mesh.materials
    library = open_library([tmp_path / "out"], cache_dir=tmp_path / "cache")
    again = library.texture(read.texture)
    for name, image in images.items():
        np.testing.assert_array_equal(getattr(again, name), image, err_msg=name)
    assert again.alpha is not None
    np.testing.assert_array_equal(again.alpha >= 128, alpha >= 128)
    assert (read.roughness, read.metallic, read.opacity) == (1.0, 1.0, 1.0)
    assert mesh.uvs.max() == 1.0


@pytest.mark.parametrize(
    ("name", "value"),
    [("roughness", 1.5), ("metallic", -1.0), ("clearcoat", 2.0), ("opacity", -0.5),
     ("ior", 0.5), ("ior", float("nan")), ("emissiveColor", (-1.0, 0.0, 0.0))],
)  # fmt: skip
def test_values_out_of_range_are_one_clear_error(tmp_path: Path, name: str, value: object) -> None:
    """The file, the material and the input are named."""
    stage = new_stage(tmp_path / "props" / "bad.usda")
    material, _ = surface(stage, "/Glaze", **{name: value})
    bind(add_mesh(stage, "/Mesh", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], (0, 1, 2)), material)
    stage.Save()
    library = open_library([tmp_path / "props"], cache_dir=tmp_path / "cache")
    with pytest.raises(AssetError, match=rf"bad\.usda: material /Glaze: {name} is .*correct it"):
        library.mesh("user/bad")
