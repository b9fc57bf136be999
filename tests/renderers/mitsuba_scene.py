"""Translation of a Scene to Mitsuba 3: the same triangles, lights and camera."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gen_data.core.asset_types import MeshData
from gen_data.core.scene import Body, Camera, Light, Scene
from tests.renderers.fake_library import FakeLibrary

MIRROR_XY = np.diag([-1.0, -1.0, 1.0, 1.0])
"""Mitsuba's cameras have X to the left and Y up."""


def mitsuba() -> Any:
    import mitsuba as mi

    if mi.variant() is None:
        mi.set_variant("scalar_rgb")
    return mi


def mitsuba_scene(
    scene: Scene,
    camera: Camera,
    library: FakeLibrary,
    bsdfs: Mapping[str, Mapping[str, Any]],
    environment: Mapping[str, Any] | None = None,
    max_bounces: int = 16,
) -> Any:
    """The scene, loaded.

    Args:
        scene: What is shown.
        camera: By which camera.
        library: What its assets are.
        bsdfs: By body name; bodies without one have Lambert's in their base colour.
        environment: The emitter that stands for the scene's environment; None = a constant one of
            its luminance.
        max_bounces: As of the renderer's settings.
    """
    mi = mitsuba()
    world: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": max_bounces + 1, "rr_depth": 5},
        "sensor": _sensor(camera),
    }
    for body in scene.bodies:
        material = (body.materials or library.materials(body.asset))[0]
        lambert = {"type": "diffuse", "reflectance": _rgb(material.base_color)}
        bsdf = bsdfs.get(body.name, {"type": "twosided", "bsdf": lambert})
        world[body.name] = _mesh(body, library.mesh(body.asset), bsdf)
    for light in scene.lights:
        world[light.name] = _light(light)
    luminance = scene.environment.luminance_cd_m2
    if environment is not None:
        world["environment"] = dict(environment)
    elif luminance > 0.0:
        world["environment"] = {"type": "constant", "radiance": _rgb((luminance,) * 3)}
    return mi.load_dict(world)


def mitsuba_images(loaded: Any, samples: int, count: int, first_seed: int = 0) -> np.ndarray:
    mi = mitsuba()
    return np.stack(
        [
            np.array(mi.render(loaded, spp=samples, seed=first_seed + k), dtype=np.float64)
            for k in range(count)
        ]
    )


def _sensor(camera: Camera) -> dict[str, Any]:
    mi = mitsuba()
    k = camera.intrinsics
    return {
        "type": "perspective",
        "fov_axis": "x",
        "fov": math.degrees(2.0 * math.atan(0.5 * k.width_px / k.fx_px)),
        "to_world": mi.ScalarTransform4f(camera.T_world_camera.matrix() @ MIRROR_XY),
        "near_clip": 0.01,
        "film": {
            "type": "hdrfilm",
            "width": k.width_px,
            "height": k.height_px,
            "rfilter": {"type": "box"},
            "component_format": "float32",
            "pixel_format": "rgb",
        },
        "sampler": {"type": "independent"},
    }


def _rgb(color: tuple[float, ...]) -> dict[str, Any]:
    return {"type": "rgb", "value": [float(c) for c in color]}


def _mesh(body: Body, data: MeshData, bsdf: Mapping[str, Any]) -> Any:
    mi = mitsuba()
    properties = mi.Properties()
    properties["mesh_bsdf"] = mi.load_dict(dict(bsdf))
    n, m = len(data.vertices_m), len(data.faces)
    attributes = {"has_vertex_normals": True, "has_vertex_texcoords": True}
    mesh = mi.Mesh(body.name, n, m, props=properties, **attributes)
    R = body.T_world_body.rotation()
    vertices = data.vertices_m.astype(np.float64) * body.scale @ R.T
    vertices += np.asarray(body.T_world_body.translation_m)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = vertices.astype(np.float32).ravel()
    parameters["vertex_normals"] = (data.normals @ R.T).astype(np.float32).ravel()
    parameters["vertex_texcoords"] = data.uvs.astype(np.float32).ravel()
    parameters["faces"] = data.faces.astype(np.uint32).ravel()
    parameters.update()
    return mesh


def _light(light: Light) -> dict[str, Any]:
    mi = mitsuba()
    power = np.asarray(light.color) * light.intensity_cd
    position = [float(p) for p in light.position_m]
    direction = [float(d) for d in light.direction]
    if light.kind == "sun":
        lux = np.asarray(light.color) * light.illuminance_lux
        return {"type": "directional", "direction": direction, "irradiance": _rgb(tuple(lux))}
    if light.kind == "sphere":
        emitter = {"type": "area", "radiance": _rgb(tuple(power / (math.pi * light.radius_m**2)))}
        return {"type": "sphere", "center": position, "radius": light.radius_m, "emitter": emitter}
    normal = np.asarray(light.direction, dtype=np.float64)
    if light.kind == "spot":
        to_world = mi.ScalarTransform4f().look_at(
            position, list(np.asarray(position) + normal), _any_side(normal)
        )
        cutoff = math.degrees(light.cone_rad)
        return {
            "type": "spot",
            "intensity": _rgb(tuple(power)),
            "cutoff_angle": cutoff,
            "beam_width": light.even * cutoff,
            "to_world": to_world,
        }
    side = np.asarray(light.side, dtype=np.float64)
    half = 0.5 * np.asarray(light.size_m)
    area_m2 = light.size_m[0] * light.size_m[1]
    if light.kind == "disk":
        half, area_m2 = np.full(2, light.radius_m), math.pi * light.radius_m**2
        side = np.cross(normal, _any_side(normal))
        side = side / math.sqrt(float(side @ side))
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1] = side * half[0], np.cross(normal, side) * half[1]
    frame[:3, 2], frame[:3, 3] = normal, position
    return {
        "type": light.kind,
        "to_world": mi.ScalarTransform4f(frame),
        "bsdf": {"type": "diffuse", "reflectance": _rgb((0.0, 0.0, 0.0))},
        "emitter": {"type": "area", "radiance": _rgb(tuple(power / area_m2))},
    }


def _any_side(normal: np.ndarray) -> list[float]:
    return [1.0, 0.0, 0.0] if abs(normal[0]) < 0.9 else [0.0, 1.0, 0.0]
