"""CPU milliseconds per laser sweep in a street: ``python -m benchmarks.bench_lidar``.

An HDL-64E, 133,312 pulses, in samples of ``kitti_rig.yaml``, from directions to records with
position, intensity, time, ring, labels and returns. One process, one core; the best of several
sweeps, each in a new scene, as in a sequence: the scene is packed and traced again, its assets are
cached. "Moving" is the same street with the scanner and all vehicles and people in motion.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import replace

from benchmarks import bench_render, runs
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core import motion, se3, streams
from gen_data.core.capture import LidarRays, PointCloud
from gen_data.core.scene import Body, Rig, Scene
from gen_data.sensors.lidar import lidar_sensor, scan_pattern


def best_s(work: Callable[[], object], repeats: int) -> float:
    """Least CPU time of one call [s]."""
    spent = []
    for _ in range(repeats):
        started = time.process_time()
        work()
        spent.append(time.process_time() - started)
    return min(spent)


def set_in_motion(scene: Scene) -> Scene:
    """Return the scene with scanner, vehicles and people in motion; each turns slightly."""
    cart = Body("cart", scene.bodies[0].asset, se3.SE3((0.0, 0.0, -1000.0)))
    T_cart_lidar = cart.T_world_body.inverse() @ scene.lidar("velodyne").T_world_lidar
    lidar = replace(scene.lidar("velodyne"), rig="rig", T_rig_lidar=T_cart_lidar)
    people = {"pedestrian", "person", "cyclist"}
    speeds_m_s = {i.instance_id: 1.5 if i.category in people else 10.0
                  for i in scene.instances if i.annotated}  # fmt: skip
    bodies = [b for b in scene.bodies if b.instance_id in speeds_m_s]
    start_s = scene.time_s - 1.0
    tracks = [_straight(cart, 12.0, start_s)]
    tracks += [_straight(b, speeds_m_s[b.instance_id], start_s) for b in bodies]
    print(f"    {len(bodies)} bodies move")
    return replace(scene, bodies=(*scene.bodies, cart), rigs=(Rig("rig", "cart"),),
                   lidars=(lidar,), tracks=tuple(tracks))  # fmt: skip


def _straight(body: Body, speed_m_s: float, start_s: float) -> motion.Trajectory:
    pose = body.T_world_body
    steps = [se3.SE3.about_z(0.02 * k, (0.1 * speed_m_s * k, 0.0, 0.0)) for k in range(-10, 11)]
    return motion.Trajectory(body.name, 0.1, tuple(pose @ step for step in steps), start_s)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=3)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--model", default="HDL-64E")
    arguments = parser.parse_args()
    model = scan_pattern.lidar_model(arguments.model)
    sweep = scan_pattern.make_sweep(model, 0.0)
    beams = LidarRays(sweep.directions, 0.0, 1, model.range_m[1], order=sweep.order)
    config = load_config("kitti_rig.yaml", overrides=["sensors[0].size_px=[64, 32]"])
    print(f"{runs.machine()}; {arguments.model}, {len(sweep.ring)} pulses")
    with open_pipeline(config) as pipeline:
        for index in range(0, 5 * arguments.samples, 5):
            scene = pipeline.sample(index).scene
            renderer, lidar = pipeline.renderer, scene.lidar("velodyne")
            for sensor in (
                lidar_sensor.LidarSensor(name="velodyne", model=arguments.model),
                lidar_sensor.LidarSensor(
                    name="velodyne", model=arguments.model, divergence=True, returns="dual"
                ),
            ):

                def capture(sensor: lidar_sensor.LidarSensor = sensor) -> PointCloud:
                    rng = streams.Streams(0, 0).rng("sensor/velodyne")
                    anew = replace(scene)  # noqa: B023
                    return sensor.capture(anew, renderer, frozenset(), rng)  # noqa: B023

                points = len(capture().points)
                spent = best_s(capture, arguments.repeats)
                kind = "7 rays, dual" if sensor.divergence else "1 ray, strongest"
                print(f"sample {index}, {kind}: {1e3 * spent:.0f} ms, {points} points")
            moving = set_in_motion(scene)
            sensor = lidar_sensor.LidarSensor(name="velodyne", model=arguments.model)

            def capture_moving(sensor: lidar_sensor.LidarSensor = sensor) -> PointCloud:
                rng = streams.Streams(0, 0).rng("sensor/velodyne")
                return sensor.capture(replace(moving), renderer, frozenset(), rng)  # noqa: B023

            spent = best_s(capture_moving, arguments.repeats)
            with bench_render.timed_launches() as by_kernel:
                capture_moving()
            print(f"sample {index}, 1 ray, moving: {1e3 * spent:.0f} ms, of which " + ", ".join(
                  f"{name} {ms:.0f} ms = {len(sweep.ring) / ms / 1e3:.2f} million rays/s"
                  for name, ms in by_kernel.items()))  # fmt: skip
            scan_s = best_s(
                lambda: renderer.scan(replace(scene), lidar, beams),  # noqa: B023
                arguments.repeats,
            )
            with bench_render.timed_launches() as by_kernel:
                renderer.scan(scene, lidar, beams)
            for kernel, ms in by_kernel.items():
                rate = len(sweep.ring) / ms / 1e3
                print(f"    {len(scene.bodies)} bodies; scan {1e3 * scan_s:.0f} ms; {kernel}"
                      f" {ms:.0f} ms = {rate:.2f} million rays/s")  # fmt: skip


if __name__ == "__main__":
    main()
