"""A small world of the library's own objects, and its stage on disk."""

from pathlib import Path

from gen_data.assets.library import Library
from gen_data.core.asset_types import Material
from gen_data.core.capture import Capture
from gen_data.core.interfaces import DatasetInfo, Modality, SensorInfo
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.motion import Trajectory
from gen_data.core.sample import Sample
from gen_data.core.scene import Body, Camera, Environment, Instance, Light, Scene
from gen_data.core.se3 import SE3, look_at
from gen_data.exporters.usd import Usd

STEPS, STEP_S = 3, 0.1
RED = Material(base_color=(0.7, 0.05, 0.05), roughness=0.3)
THINGS = ("mug?seed=3", "bottle?seed=1", "ball?seed=2", "wrench?seed=4")


def off_centre_camera() -> Camera:
    """Neither square pixels nor a centred principal point."""
    intrinsics = Intrinsics(320, 240, 300.0, 310.0, 171.3, 110.9)
    return Camera("color", look_at((0.5, -0.7, 0.6), (0.0, 0.0, 0.05), 0.1), intrinsics)


def table_world(library: Library) -> Scene:
    """Four objects on a plane; the first, in red, moves; the second is half as large again."""
    poses = [SE3.about_z(0.7 * k, (0.16 * (k % 2), 0.18 * (k // 2), 0.08)) for k in range(4)]
    bodies = [Body("ground", "plane")]
    instances = []
    for k, (asset, pose) in enumerate(zip(THINGS, poses, strict=True)):
        scale = 1.5 if k == 1 else 1.0
        slots = len(library.materials(asset))
        worn = (RED,) * slots if k == 0 else ()
        bodies.append(Body(f"clutter/{k}", asset, pose, scale, instance_id=k + 1, materials=worn))
        category = library.get(asset).category
        instances.append(Instance(k + 1, f"clutter/{k}", category, 1, asset, T_world_instance=pose))
    way = tuple(SE3((0.02 * k, 0.0, 0.0)) @ poses[0] for k in range(STEPS))
    lights = (
        Light("lamp", "sphere", (0.4, -0.9, 2.2), intensity_cd=900.0, radius_m=0.08),
        Light("spot", "spot", (0.0, 0.5, 1.5), (0.0, -0.6, -0.8), (1.2, 0.97, 0.7), 250.0),
        Light("panel", "rectangle", (0.3, 0.4, 1.6), (0.0, -0.6, -0.8), (1.1, 0.98, 0.9), 120.0,
              size_m=(0.8, 0.4), side=(0.8, 0.48, -0.36)),
        Light("disk", "disk", (-0.5, 0.4, 1.2), (0.6, 0.0, -0.8), intensity_cd=60.0, radius_m=0.2),
        Light("sun", "sun", direction=(0.6, 0.0, -0.8), illuminance_lux=4000.0),
    )  # fmt: skip
    return Scene(
        "table",
        tuple(bodies),
        tuple(instances),
        lights=lights,
        cameras=(off_centre_camera(),),
        environment=Environment(luminance_cd_m2=80.0, yaw_rad=0.4),
        tracks=(Trajectory("clutter/0", STEP_S, way),),
    )


def exported(
    scene: Scene,
    library: Library,
    folder: Path,
    *,
    steps: int = 1,
    time_offset_s: float = 0.0,
    **options: str,
) -> Path:
    """The stage of a scene, as the exporter leaves it."""
    sensors = (SensorInfo("color", Modality.CAMERA, time_offset_s=time_offset_s),)
    timing = {"steps_per_scene": steps, "step_s": STEP_S}
    info = DatasetInfo("t", 7, steps, 1, ("thing",), sensors, **timing)
    sample = Sample(0, 0, 0, "train", scene, Capture({}), {})
    exporter = Usd.model_validate(options).with_assets(library)
    exporter.write_shard(info, [sample], folder / "shard")
    exporter.finalize(info, [folder / "shard"], folder / "usd")
    return next((folder / "usd").glob("000000000.usd?"))
