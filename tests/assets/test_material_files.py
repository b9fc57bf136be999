"""Coats, glass, opacity, holes and light of files: they are read, or refused by name."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from gen_data.assets.asset_folder import Folder
from gen_data.assets.library import open_library
from gen_data.assets.readers import read_mesh
from gen_data.assets.texture_maps import TextureMaps, compose_texture, find_maps
from gen_data.core.asset_types import Material, TextureData
from gen_data.core.errors import AssetError, ConfigError
from tests.assets.gltf_builder import Builder

TRIANGLE_OBJ = (
    "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
)


def png(pixels: np.ndarray) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG")
    return stream.getvalue()


def gltf(folder: Path, material: dict[str, Any], **images: np.ndarray) -> None:
    """A triangle with a material, next to its images, which have the numbers of their order."""
    for name, pixels in images.items():
        (folder / f"{name}.png").write_bytes(png(pixels))
    made = Builder()
    made.attributes["TEXCOORD_0"] = made.accessor(np.array([[0, 0], [1, 0], [0, 1]], "<f4"))
    made.material(**{"name": "skin of it", **material})
    made.tree |= {
        "textures": [{"source": k} for k in range(len(images))],
        "images": [{"uri": f"{name}.png"} for name in images],
    }
    made.write(folder, "t")


def triangle(folder: Path, mtl: str, obj: str = TRIANGLE_OBJ) -> None:
    (folder / "t.obj").write_text(obj)
    (folder / "m.mtl").write_text(mtl)


def loaded(folder: Path) -> tuple[Material, TextureData | None]:
    library = open_library([folder], cache_dir=folder.parent / "cache")
    (material,) = library.mesh("user/t").materials
    return material, library.texture(material.texture) if material.texture else None


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    path = tmp_path / "assets"
    path.mkdir()
    return path


def checker(low: int, high: int) -> np.ndarray:
    y, x = np.mgrid[:4, :4]
    return np.where((x + y) % 2, high, low).astype(np.uint8)


@pytest.mark.slow
def test_gltf_extensions_become_coat_glass_and_light(folder: Path) -> None:
    """Numbers as written; a volume makes glass a solid; nits stay nits; F0 follows the index."""
    gltf(folder, {
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0,
                                 "roughnessFactor": 0.1},
        "emissiveFactor": [1.0, 0.5, 0.0],
        "extensions": {
            "KHR_materials_clearcoat": {"clearcoatFactor": 0.8, "clearcoatRoughnessFactor": 0.2},
            "KHR_materials_transmission": {"transmissionFactor": 0.9},
            "KHR_materials_volume": {"thicknessFactor": 0.01},
            "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_emissive_strength": {"emissiveStrength": 400.0},
        },
    })  # fmt: skip
    material, texture = loaded(folder)
    assert texture is None
    assert (material.coat, material.coat_roughness) == (0.8, 0.2)
    assert (material.transmission, material.ior, material.thin) == (0.9, 1.33, False)
    assert material.emission_cd_m2 == (400.0, 200.0, 0.0)
    assert material.specular == pytest.approx((0.33 / 2.33) ** 2 / 0.08, abs=1e-4)
    assert material.base_color == (1.0, 1.0, 1.0)


def test_gltf_leaves_reflect_what_they_do_not_transmit(folder: Path) -> None:
    """KHR_materials_diffuse_transmission: reflection (1 - f) base, transmission f colour."""
    extension = {"diffuseTransmissionFactor": 0.4,
                 "diffuseTransmissionColorFactor": [0.5, 1.0, 0.25]}  # fmt: skip
    gltf(folder, {
        "pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.5, 0.1, 1], "metallicFactor": 0},
        "extensions": {"KHR_materials_diffuse_transmission": extension},
    })  # fmt: skip
    material, _ = loaded(folder)
    assert material.base_color == pytest.approx((0.12, 0.3, 0.06))
    assert material.diffuse_transmission == pytest.approx((0.2, 0.4, 0.1))


def test_the_mean_of_a_gltf_image_of_transmitted_light_is_kept(folder: Path) -> None:
    """Materials multiply transmission by the base colour's image: its mean must not count twice."""
    base = np.dstack([checker(188, 255), checker(0, 188), checker(255, 255)])
    passed = np.full((4, 4, 3), 188, np.uint8)
    gltf(folder, {
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0},
        "extensions": {"KHR_materials_diffuse_transmission": {
            "diffuseTransmissionFactor": 0.2, "diffuseTransmissionColorTexture": {"index": 1}}},
    }, base=base, passed=passed)  # fmt: skip
    material, texture = loaded(folder)
    # sRGB 188 is 0.5029 in linear light (IEC 61966-2-1).
    half = ((188 / 255 + 0.055) / 1.055) ** 2.4
    assert texture is not None
    means = np.array([0.5 * (half + 1.0), 0.5 * half, 1.0])
    np.testing.assert_allclose(
        np.array(material.diffuse_transmission) * means, 0.2 * half, atol=2e-4
    )


def test_gltf_images_become_maps(folder: Path) -> None:
    """Roughness from green, metal from blue, occlusion from red, coverage from alpha."""
    orm = np.dstack([checker(100, 200), checker(0, 255), checker(255, 0)])
    leaf = np.dstack([np.full((4, 4, 3), 90, np.uint8), checker(0, 200)])
    glow = np.dstack([checker(0, 255)] * 3)
    gltf(
        folder,
        {
            "alphaMode": "MASK",
            "alphaCutoff": 0.25,
            "occlusionTexture": {"index": 1},
            "pbrMetallicRoughness": {
                "baseColorTexture": {"index": 0},
                "metallicRoughnessTexture": {"index": 1},
            },
            "emissiveFactor": [3, 3, 3],
            "emissiveTexture": {"index": 2},
            "normalTexture": {"index": 2},
        },
        leaf=leaf,
        orm=orm,
        glow=glow,
    )
    material, texture = loaded(folder)
    assert texture is not None
    assert (material.roughness, material.metallic, material.opacity) == (1.0, 1.0, 1.0)
    np.testing.assert_array_equal(texture.albedo, leaf[..., :3])
    np.testing.assert_array_equal(texture.roughness, orm[..., 1])
    np.testing.assert_array_equal(texture.metallic, orm[..., 2])
    np.testing.assert_array_equal(texture.occlusion, orm[..., 0])
    np.testing.assert_array_equal(texture.emission, glow)
    np.testing.assert_array_equal(texture.normal, glow)
    assert texture.alpha is not None
    np.testing.assert_array_equal(texture.alpha >= 128, leaf[..., 3] >= 0.25 * 255)


def test_gltf_scales_of_normals_and_occlusion_apply(folder: Path) -> None:
    """A normal (0.6, 0, 0.8) at scale 0.5 is (0.3, 0, 0.8) normalised; occlusion 1 + s (o - 1)."""
    tilt = np.rint((np.array([0.6, 0.0, 0.8]) + 1.0) * 127.5)
    normals = np.broadcast_to(tilt, (4, 4, 3)).astype(np.uint8)
    shade = np.dstack([checker(55, 255)] * 3)
    gltf(folder, {"normalTexture": {"index": 0, "scale": 0.5},
                  "occlusionTexture": {"index": 1, "strength": 0.25}},
         normals=normals, shade=shade)  # fmt: skip
    _, texture = loaded(folder)
    assert texture is not None and texture.normal is not None
    found = texture.normal[0, 0] / 127.5 - 1.0
    assert found == pytest.approx(np.array([0.3, 0.0, 0.8]) / np.hypot(0.3, 0.8), abs=0.012)
    np.testing.assert_array_equal(texture.occlusion, checker(205, 255))


def test_a_metal_of_specular_glossiness_keeps_its_holes(folder: Path) -> None:
    """Black with the reflection of gold, and holes in the image of its diffuse colour."""
    mesh = np.dstack([np.zeros((4, 4, 3), np.uint8), checker(0, 255)])
    content = {"diffuseTexture": {"index": 0}, "specularFactor": [1, 0.77, 0.34]}
    gltf(folder, {"alphaMode": "MASK", **_extension("pbrSpecularGlossiness", **content)}, mesh=mesh)
    material, texture = loaded(folder)
    assert (material.metallic, material.base_color) == (1.0, (1.0, 0.77, 0.34))
    assert texture is not None and texture.alpha is not None
    np.testing.assert_array_equal(texture.alpha >= 128, mesh[..., 3] > 0)


def test_an_even_gltf_occlusion_darkens_everywhere(folder: Path) -> None:
    gltf(folder, {"occlusionTexture": {"index": 0}}, shade=np.full((4, 4, 3), 128, np.uint8))
    _, texture = loaded(folder)
    assert texture is not None
    np.testing.assert_array_equal(texture.occlusion, np.full((4, 4), 128, np.uint8))


def test_unlit_gltf_materials_are_matte_and_have_their_base_colour_only(folder: Path) -> None:
    """KHR_materials_unlit ignores all other properties; without factors it would be a metal."""
    colour, other = np.dstack([checker(10, 240)] * 3), np.dstack([checker(0, 255)] * 3)
    gltf(folder, {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0},
                                           "metallicRoughnessTexture": {"index": 1}},
                  "normalTexture": {"index": 1}, "emissiveFactor": [1, 1, 1],
                  "extensions": {"KHR_materials_unlit": {}}},
         colour=colour, other=other)  # fmt: skip
    material, texture = loaded(folder)
    assert texture is not None
    np.testing.assert_array_equal(texture.albedo, colour)
    assert (texture.normal, texture.roughness, texture.metallic) == (None, None, None)
    assert (material.metallic, material.roughness) == (0.0, 1.0)
    assert material.emission_cd_m2 == (0.0, 0.0, 0.0)


def test_even_images_become_numbers(folder: Path) -> None:
    """A roughness image of 128 and a metal image of 255 are factors, not maps."""
    even = np.zeros((4, 4, 3), np.uint8)
    even[..., 1], even[..., 2] = 128, 255
    gltf(folder, {"pbrMetallicRoughness": {
        "metallicRoughnessTexture": {"index": 0}, "roughnessFactor": 0.5}}, even=even)  # fmt: skip
    material, texture = loaded(folder)
    assert texture is None
    assert material.roughness == pytest.approx(0.5 * 128 / 255, abs=1e-4)
    assert material.metallic == 1.0


def test_a_blended_image_is_opacity_and_holes(folder: Path) -> None:
    """Half of 4 x 4 texels at 0.4, half at nothing: opacity 0.4, and holes where nothing is."""
    veil = np.dstack([np.full((4, 4, 3), 255, np.uint8), checker(0, 102)])
    gltf(folder, {"alphaMode": "BLEND", "pbrMetallicRoughness": {
        "baseColorTexture": {"index": 0}}}, veil=veil)  # fmt: skip
    material, texture = loaded(folder)
    assert material.opacity == pytest.approx(0.4, abs=1e-4)
    assert texture is not None and texture.alpha is not None
    np.testing.assert_array_equal(texture.alpha >= 128, veil[..., 3] > 0)


VARIED = np.dstack([checker(0, 255)] * 3 + [checker(60, 250)])


def _extension(name: str, **content: Any) -> dict[str, Any]:
    return {"extensions": {f"KHR_materials_{name}": content}}


@pytest.mark.parametrize(
    ("material", "remark"),
    [({"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
      "the opacity of its image counts by its mean"),
     (_extension("clearcoat", clearcoatFactor=1, clearcoatTexture={"index": 0}),
      "clearcoatTexture counts by its mean"),
     (_extension("clearcoat", clearcoatNormalTexture={"index": 0}),
      "clearcoatNormalTexture is not used"),
     (_extension("transmission", transmissionFactor=1, transmissionTexture={"index": 0}),
      "transmissionTexture counts by its mean"),
     (_extension("diffuse_transmission", diffuseTransmissionFactor=1,
                 diffuseTransmissionColorTexture={"index": 0}),
      "diffuseTransmissionColorTexture counts by its mean"),
     (_extension("volume", thicknessFactor=1, attenuationDistance=1, attenuationColor=[1, 0, 0]),
      "attenuationColor is not used"),
     (_extension("pbrSpecularGlossiness", diffuseFactor=[0, 0, 0, 1],
                 specularGlossinessTexture={"index": 0}),
      "specularGlossinessTexture counts by its mean"),
     (_extension("specular", specularTexture={"index": 0}), "specularTexture counts by its mean"),
     (_extension("specular", specularColorFactor=[1, 0.5, 0.5]),
      "the colour of its reflection is not used"),
     (_extension("ior", ior=3), "its reflectance of 25% counts as 8%")],
)  # fmt: skip
def test_properties_of_gltf_materials_that_are_not_used_as_they_are_have_a_remark(
    folder: Path, material: dict[str, Any], remark: str
) -> None:
    pbr = {"metallicFactor": 0.0, **material.get("pbrMetallicRoughness", {})}
    gltf(folder, {**material, "pbrMetallicRoughness": pbr}, varied=VARIED)
    assert read_mesh(Folder(folder), "t.gltf").remarks == (f"material 'skin of it': {remark}",)


@pytest.mark.parametrize("content", [{"ior": 3}, {"ior": 0}, {"specularColorFactor": [1, 0, 0]}])
def test_gltf_metals_have_no_remark_on_the_reflection_of_dielectrics(
    folder: Path, content: dict[str, Any]
) -> None:
    gltf(folder, _extension("ior" if "ior" in content else "specular", **content))
    assert read_mesh(Folder(folder), "t.gltf").remarks == ()


@pytest.mark.parametrize("ior", [0, 1000])
@pytest.mark.parametrize(
    ("diffuse", "reflected", "expected"),
    [([0.5, 0.2, 0.1, 1], [0.04] * 3, ((0.5, 0.2, 0.1), 0.0, 0.5)),
     # Black, with the reflection of gold: a metal of that colour.
     ([0, 0, 0, 1], [1.0, 0.77, 0.34], ((1.0, 0.77, 0.34), 1.0, 1.0))],
    ids=["plastic", "gold"],
)  # fmt: skip
def test_a_gltf_index_of_0_or_infinity_reflects_the_specular_colour(
    folder: Path,
    ior: float,
    diffuse: list[float],
    reflected: list[float],
    expected: tuple[Any, ...],
) -> None:
    """KHR_materials_ior's mode for former specular-glossiness: F0 is specularColorFactor."""
    extensions = {"KHR_materials_ior": {"ior": ior},
                  "KHR_materials_specular": {"specularColorFactor": reflected}}  # fmt: skip
    pbr = {"baseColorFactor": diffuse, "metallicFactor": 0, "roughnessFactor": 0.3}
    gltf(folder, {"pbrMetallicRoughness": pbr, "extensions": extensions})
    source = read_mesh(Folder(folder), "t.gltf")
    material = source.soup.slots[0].material
    assert material.base_color == pytest.approx(expected[0], abs=5e-3)
    assert (material.metallic, material.roughness, source.remarks) == (expected[1], 0.3, ())
    assert material.specular == pytest.approx(expected[2], abs=5e-3)


@pytest.mark.parametrize(("mode", "opacity"), [("OPAQUE", 1.0), ("BLEND", 0.5)])
def test_a_gltf_cutoff_counts_in_masks_only(folder: Path, mode: str, opacity: float) -> None:
    """Beyond 1 it hides a mask; OPAQUE ignores alpha, too."""
    alpha = 0.5 if mode == "BLEND" else 2.0
    factors = {"baseColorFactor": [1, 1, 1, alpha]}
    gltf(folder, {"alphaMode": mode, "alphaCutoff": 1.5, "pbrMetallicRoughness": factors})
    assert loaded(folder)[0].opacity == opacity


def test_mtl_says_opacity_light_coat_and_holes(folder: Path) -> None:
    """``d`` takes precedence over ``Tr``; a separate coverage image is grey."""
    triangle(
        folder,
        "newmtl m\nKd 1 1 1\nTr 0.9\nd 0.6\nKe 10 20 30\nPc 0.7\nPcr 0.1\nNi 1.4\n"
        "map_d hole.png\nmap_Kd wood.png\nmap_Ke lamp.png\n",
    )
    hole, wood = checker(0, 255), np.dstack([checker(10, 240)] * 3)
    for name, pixels in (("hole", hole), ("wood", wood), ("lamp", wood)):
        (folder / f"{name}.png").write_bytes(png(pixels))
    material, texture = loaded(folder)
    assert (material.opacity, material.emission_cd_m2) == (0.6, (10.0, 20.0, 30.0))
    assert (material.coat, material.coat_roughness, material.ior) == (0.7, 0.1, 1.4)
    assert texture is not None
    np.testing.assert_array_equal(texture.alpha >= 128, hole >= 128)
    np.testing.assert_array_equal(texture.emission, wood)


def test_a_changed_map_is_another_asset(folder: Path) -> None:
    """Content hashes cover every image that an MTL file names."""
    triangle(folder, "newmtl m\nmap_Kd wood.png\nmap_Ke lamp.png\n")
    (folder / "wood.png").write_bytes(png(np.dstack([checker(10, 240)] * 3)))
    digests = []
    for value in (50, 60):
        (folder / "lamp.png").write_bytes(png(np.full((2, 2, 3), value, np.uint8)))
        library = open_library([folder], cache_dir=folder.parent / f"cache{value}")
        digests.append(library.get("user/t").sha256)
    assert digests[0] != digests[1]


BAD = {
    "roughnessFactor": {"pbrMetallicRoughness": {"roughnessFactor": 1.5}},
    "metallicFactor": {"pbrMetallicRoughness": {"metallicFactor": -0.2}},
    "clearcoatFactor": {"extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 2}}},
    "transmissionFactor": {
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1.2}}
    },
    "alpha": {"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, -1]}},
    "emissiveFactor": {"emissiveFactor": [0, -1, 0]},
    "emissiveStrength": {
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": float("nan")}}
    },
    "ior": {"extensions": {"KHR_materials_ior": {"ior": 0.9}}},
}


@pytest.mark.parametrize("field", sorted(BAD))
def test_gltf_values_out_of_range_are_one_clear_error(folder: Path, field: str) -> None:
    gltf(folder, BAD[field])
    with pytest.raises(AssetError, match=rf"t\.gltf: .*material 'skin of it': .*{field}.* is"):
        read_mesh(Folder(folder), "t.gltf")


@pytest.mark.parametrize("line", ["d 1.5", "Tr -0.5", "Pr nan", "Pm 2", "Pc -1", "Ke -1 0 0"])
def test_mtl_values_out_of_range_are_one_clear_error(folder: Path, line: str) -> None:
    triangle(folder, f"newmtl m\n{line}\n")
    with pytest.raises(AssetError, match=rf"m\.mtl: material 'm': .*{line.partition(' ')[0]} is"):
        read_mesh(Folder(folder), "t.obj")


@pytest.mark.parametrize(
    ("field", "value"),
    [("coat", "1.5"), ("transmission", "-0.1"), ("opacity", ".nan"), ("ior", "0.5"),
     ("emission_cd_m2", "[-1, 0, 0]")],
)  # fmt: skip
def test_index_values_out_of_range_are_one_error(folder: Path, field: str, value: str) -> None:
    triangle(folder, "newmtl m\n")
    (folder / "assets.yaml").write_text(
        "assets:\n  - id: thing\n    file: t.obj\n    category: thing\n    licence: CC0-1.0\n"
        f"    materials: {{m: {{{field}: {value}}}}}\n"
    )
    with pytest.raises(ConfigError, match=rf"assets\.yaml.*materials\.m\.{field}"):
        open_library([folder], cache_dir=folder.parent / "cache").get("user/thing")


def test_names_of_maps_survive_any_file_name_and_several_sizes_take_the_largest() -> None:
    """Spaces, semicolons and equal signs in names of images come back."""
    maps = TextureMaps(
        albedo="a b;c=d.png", metallic="x%20/y.png!2", alpha="a b;c=d.png!3", cutoff=0.2,
        normal="n;normal_scale=3.png", normal_scale=-0.5, occlusion_strength=0.25,
    )  # fmt: skip
    assert find_maps(maps.name()) == maps
    assert find_maps("plain.png") is None
    assert TextureMaps(albedo="plain.png").name() == "plain.png"
    # A grey of 2 x 2 and a colour of 8 x 4.
    small, large = np.full((2, 2, 3), 70, np.uint8), np.full((4, 8, 3), 9, np.uint8)
    texture = compose_texture(
        TextureMaps(albedo="s", emission="l"), {"s": small, "l": large}.__getitem__
    )
    assert texture.albedo.shape == (4, 8, 3) and (texture.albedo == 70).all()


@pytest.mark.parametrize(
    ("key", "file", "texel", "expected"),
    [
        ("normal", "rock_nor_dx_2k.png", (128, 200, 220), [128, 55, 220]),
        ("normal", "Rock049_2K-PNG_NormalDX.png", (128, 200, 220), [128, 55, 220]),
        ("normal", "rock_normal_directx.png", (128, 200, 220), [128, 55, 220]),
        ("normal", "rock_nor_gl_2k.png", (128, 200, 220), [128, 200, 220]),
        ("normal", "Rock049_NormalGL.png", (128, 200, 220), [128, 200, 220]),
        ("normal", "nor_dx/rock.png", (128, 200, 220), [128, 200, 220]),
        ("roughness", "rock_GLOSS_2K.png", (200, 200, 200), 55),
        ("roughness", "rock_glossiness.png", (200, 200, 200), 55),
        ("roughness", "rock_rough_2k.png", (200, 200, 200), 200),
        ("roughness", "paint_gloss_roughness.png", (200, 200, 200), 200),
        ("roughness", "glossy_rock.png", (200, 200, 200), 200),
    ],
)
def test_maps_for_directx_and_gloss_are_inverted_by_their_names_and_named(
    folder: Path, key: str, file: str, texel: tuple[int, int, int], expected: object
) -> None:
    """Names of Poly Haven, ambientCG and Poliigon; as a texture and on an object."""
    (folder / file).parent.mkdir(exist_ok=True)
    Image.new("RGB", (2, 2), texel).save(folder / file)
    Image.new("RGB", (2, 2), 90).save(folder / "c.png")
    triangle(folder, "newmtl m\n")
    maps = f"maps: {{color: c.png, {key}: {file}}}"
    (folder / "assets.yaml").write_text(
        f"textures: [{{id: rock, {maps}}}]\n"
        f'assets: [{{id: t, file: t.obj, materials: {{"*": {{{maps}}}}}}}]\n'
    )
    library = open_library([folder], cache_dir=folder.parent / "cache")
    on_object = library.mesh("user/t").materials[0].texture
    for name in ("user/rock", on_object):
        found = getattr(library.texture(name), key)
        assert found[0, 0].tolist() == expected
    is_inverted = expected in ([128, 55, 220], 55)
    for name in ("user/rock", "user/t"):
        files = [one.file for one in library.remarks(name) or ()]
        assert files == [str(folder / file)] * is_inverted


def test_coverage_that_no_face_reaches_is_left_out(folder: Path) -> None:
    """An atlas that is transparent next to the triangle's corner of it: the mesh stays solid."""
    atlas = np.full((8, 8, 4), 200, np.uint8)
    atlas[..., 3] = np.where(np.arange(8) < 4, 255, 0)
    (folder / "wood.png").write_bytes(png(atlas))
    for name, wide in (("t", 0.4), ("u", 1.0)):
        (folder / f"{name}.obj").write_text(TRIANGLE_OBJ.replace("vt 1 0", f"vt {wide} 0"))
    (folder / "m.mtl").write_text("newmtl m\nmap_Kd wood.png\nmap_d wood.png\n")
    library = open_library([folder], cache_dir=folder.parent / "cache")
    names = [library.mesh(f"user/{name}").materials[0].texture for name in ("t", "u")]
    assert library.texture(names[0]).alpha is None
    assert library.texture(names[1]).alpha is not None
