"""Blender's Cycles on the CPU: balls of light, few paths, its denoiser."""

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import bpy
import mathutils
import numpy as np
import OpenEXR

from benchmarks.peers.worlds import FAR_M, NEAR_M, Images, World, encode_srgb

SAMPLES_PER_PIXEL = 16
AMBIENT = 0.05


def open_renderer(worlds: Sequence[World]) -> Callable[[World], Images]:
    """A scene of all bodies, moved for each world; layers come back through an OpenEXR file."""
    first = worlds[0]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    _set_up_rendering(scene, first)
    bodies = []
    for number, path in enumerate(first.meshes):
        bpy.ops.wm.obj_import(filepath=path, forward_axis="Y", up_axis="Z")
        body = bpy.context.selected_objects[0]
        body.pass_index = first.ids[number]
        bodies.append(body)
    lamps = []
    for k, lamp in enumerate(first.lamps):
        data = bpy.data.lights.new(f"lamp{k}", type="POINT")
        lamps.append(bpy.data.objects.new(f"lamp{k}", data))
        scene.collection.objects.link(lamps[-1])
        data.shadow_soft_size = lamp.radius_m
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.data.clip_start, camera.data.clip_end = NEAR_M, FAR_M
    camera.data.sensor_fit = "VERTICAL"
    target = Path(tempfile.mkdtemp()) / "frame.exr"
    scene.render.filepath = str(target)

    def draw(world: World) -> Images:
        for body, number, T in zip(bodies, world.ids, world.T_world_bodies, strict=True):
            body.matrix_world = mathutils.Matrix(T)
            body.pass_index = number
        camera.matrix_world = mathutils.Matrix(world.T_world_gl.tolist())
        camera.data.angle = world.vfov_rad
        for node, lamp in zip(lamps, world.lamps, strict=True):
            node.location = lamp.position_m
            node.data.shadow_soft_size = lamp.radius_m
            node.data.energy = 0.02 * max(lamp.intensity_cd)
        bpy.ops.render.render(write_still=True)
        channels = [part.channels for part in OpenEXR.File(str(target)).parts]
        layers = {name: channel.pixels for part in channels for name, channel in part.items()}
        return Images(
            encode_srgb(layers["ViewLayer.Combined"][..., :3]),
            layers["ViewLayer.Depth.Z"],
            layers["ViewLayer.Object Index.X"].round().astype(np.uint16),
        )

    return draw


def _set_up_rendering(scene: bpy.types.Scene, world: World) -> None:
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = world.size_px
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.render.use_persistent_data = True  # keeps hierarchies of meshes between images
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.image_settings.exr_codec = "NONE"
    scene.render.image_settings.color_depth = "32"
    scene.cycles.device = "CPU"
    scene.cycles.samples = SAMPLES_PER_PIXEL
    scene.cycles.use_denoising = True
    scene.cycles.denoising_prefilter, scene.cycles.denoising_quality = "FAST", "FAST"
    scene.cycles.max_bounces = 0
    scene.world = bpy.data.worlds.new("sky")
    scene.world.color = (AMBIENT, AMBIENT, AMBIENT)
    layer = scene.view_layers[0]
    layer.use_pass_z = True
    layer.use_pass_object_index = True
