"""Mitsuba 3: balls of light, sampled with few paths; ``llvm_ad_rgb`` with an LLVM of the system."""

from collections.abc import Callable, Sequence

import drjit as dr
import mitsuba as mi
import numpy as np

from benchmarks.peers.worlds import Images, World, encode_srgb

SAMPLES_PER_PIXEL = 16
"""Of the light; depth and ids come from a second image with one sample per pixel."""
AMBIENT = 0.05
GAIN = 1e-3
"""Factor from radiance to linear sRGB, close to the result of automatic exposure."""


def open_renderer(worlds: Sequence[World]) -> Callable[[World], Images]:
    """Direct light of two balls and the sky; geometry is moved for each world.

    Raises:
        ImportError: there is no LLVM.
    """
    try:
        mi.set_variant("llvm_ad_rgb")
        dr.set_thread_count(1)
        dr.eval(mi.Float([1.0]) + 1.0)
    except Exception as error:  # Dr.Jit raises plain exceptions
        raise ImportError(f"no LLVM: {error}") from error
    first = worlds[0]
    vertices = [
        np.array(_load(path, number), np.float32) for number, path in enumerate(first.meshes)
    ]
    scene = mi.load_dict(_describe(first), optimize=False)  # else all meshes become one
    parameters = mi.traverse(scene)
    index_of = dr.reinterpret_array(mi.UInt32, scene.shapes_dr())
    numbers = [index_of[k] for k, s in enumerate(scene.shapes()) if s.id().startswith("body")]
    lit = mi.load_dict({"type": "direct", "hide_emitters": True})
    surfaces = mi.load_dict({"type": "aov", "aovs": "position:position,shape:shape_index"})

    def draw(world: World) -> Images:
        for k, T in enumerate(np.array(world.T_world_bodies)):
            moved = vertices[k] @ T[:3, :3].T + T[:3, 3]
            parameters[f"body{k:02d}.vertex_positions"] = mi.Float(moved.astype(np.float32).ravel())
        for k, lamp in enumerate(world.lamps):
            to_world = mi.ScalarTransform4f().translate(lamp.position_m).scale(lamp.radius_m)
            parameters[f"lamp{k}.to_world"] = mi.Transform4f(to_world.matrix)
            parameters[f"lamp{k}.emitter.radiance.value"] = mi.Color3f(_radiance(lamp))
        parameters["camera.to_world"] = mi.Transform4f(_camera_pose(world).matrix)
        parameters.update()
        light = np.array(mi.render(scene, integrator=lit, spp=SAMPLES_PER_PIXEL))
        hits = np.array(mi.render(scene, integrator=surfaces, spp=1, seed=1))
        position_m, shapes = hits[..., -4:-1], hits[..., -1]
        forward = np.array(world.T_world_camera)[:3, 2]
        depth_m = (position_m - np.array(world.T_world_camera)[:3, 3]) @ forward
        found = np.where(np.isin(shapes, numbers), shapes, 0).astype(int)
        ids = np.zeros(max(numbers) + 1, np.uint16)
        ids[numbers] = world.ids
        return Images(
            encode_srgb(GAIN * light[..., :3]), np.where(found > 0, depth_m, np.inf), ids[found]
        )

    return draw


def _describe(world: World) -> dict[str, object]:
    film = {"type": "hdrfilm", "width": world.size_px[0], "height": world.size_px[1]}
    camera = {
        "type": "perspective",
        "fov": float(np.degrees(world.vfov_rad)),
        "fov_axis": "y",
        "to_world": _camera_pose(world),
        "film": {**film, "rfilter": {"type": "box"}},
    }
    sky = {"type": "constant", "radiance": {"type": "rgb", "value": AMBIENT / GAIN}}
    found: dict[str, object] = {"type": "scene", "camera": camera, "sky": sky}
    for k, path in enumerate(world.meshes):
        found[f"body{k:02d}"] = {"type": "obj", "filename": path, "bsdf": {"type": "diffuse"}}
    for k, lamp in enumerate(world.lamps):
        emitter = {"type": "area", "radiance": {"type": "rgb", "value": _radiance(lamp)}}
        to_world = mi.ScalarTransform4f().translate(lamp.position_m).scale(lamp.radius_m)
        found[f"lamp{k}"] = {"type": "sphere", "to_world": to_world, "emitter": emitter}
    return found


def _load(path: str, number: int) -> np.ndarray:
    mesh = mi.load_dict({"type": "obj", "filename": path, "id": f"body{number:02d}"})
    return np.array(mi.traverse(mesh)["vertex_positions"]).reshape(-1, 3)


def _radiance(lamp: object) -> list[float]:
    """Of a ball of this intensity: I / (pi r^2)."""
    return [value / (np.pi * lamp.radius_m**2) for value in lamp.intensity_cd]  # type: ignore[attr-defined]


def _camera_pose(world: World) -> object:
    """Mitsuba's camera frame: X left, Y up, Z forward."""
    return mi.ScalarTransform4f(np.array(world.T_world_camera) @ np.diag([-1.0, -1.0, 1.0, 1.0]))
