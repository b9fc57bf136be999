"""Grasps and suctions of a settled scene, held against rays and sampled surfaces."""

from functools import cache
from typing import Any

import numpy as np
import pytest
import trimesh

from gen_data.annotations.annotate import annotate_ego
from gen_data.annotations.grasps import Grasps
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.sample import EgoTruth
from gen_data.core.scene import Scene
from tests.annotations.test_relations import instance_meshes
from tests.embree import RayCaster

SETTINGS = Grasps(tried=48, most=4)


@cache
def settled() -> tuple[Scene, EgoTruth, dict[int, trimesh.Trimesh]]:
    """A table with objects: the scene, its grasps, and the meshes of instances."""
    small = ("sensors[0].size_px=[64, 48]", "exporters=[]", "annotations=[]")
    with open_pipeline(load_config("tabletop", overrides=small), frozenset()) as made:
        scene = made.sample(5).scene
        frame = annotate_ego({"": scene}, [SETTINGS], made.assets)
        assert frame is not None
        return scene, frame, instance_meshes(scene, made.assets)


def cast(mesh: trimesh.Trimesh, origin: Any, direction: Any) -> tuple[float, Any]:
    """Distance to the first surface along a ray, and its normal, by Embree."""
    hit = RayCaster((mesh.vertices, mesh.faces)).cast(origin, direction)
    return float(hit.distance), hit.normal


@pytest.mark.slow
def test_every_grasp_is_antipodal_and_its_score_is_the_friction_it_needs() -> None:
    """Rays from both fingers along the closing direction meet the object at the contacts."""
    _, frame, meshes = settled()
    assert frame.grasps and len({g.instance_id for g in frame.grasps}) >= 4
    for grasp in frame.grasps:
        mesh, pose = meshes[grasp.instance_id], grasp.T_world_grasp
        middle, opening = np.array(pose.translation_m), pose.rotation()[:, 1]
        need = 0.0
        for side in (1.0, -1.0):
            start = middle + side * opening * (0.5 * grasp.width_m + 0.002)
            distance_m, normal = cast(mesh, start, -side * opening)
            assert distance_m == pytest.approx(0.002, abs=1e-4)
            cosine = abs(float(normal @ opening))
            need = max(need, float(np.sqrt(max(0.0, 1.0 - cosine**2))) / cosine)
        assert grasp.score == pytest.approx(min(1.0, 1.1 - need), abs=0.01)
        assert need <= SETTINGS.friction + 0.01
        assert grasp.width_m + 2 * SETTINGS.clearance_m <= SETTINGS.opening_m + 1e-6


@pytest.mark.slow
def test_open_grippers_touch_nothing() -> None:
    """Points sampled on all surfaces, tables and walls included, are outside fingers and palm."""
    _, frame, meshes = settled()
    points = np.concatenate([m.sample(40_000, seed=1) for m in meshes.values()])
    thick_m, height_m, length_m = SETTINGS.finger_m
    for grasp in frame.grasps or ():
        x, y, z = grasp.T_world_grasp.inverse().apply(points).T
        inner = 0.5 * grasp.width_m + SETTINGS.clearance_m
        # Points on a lattice of 4 mm may miss a corner by half a cell.
        slack = 0.002
        fingers = (x > -length_m + slack) & (x < SETTINGS.reach_m - slack)
        fingers &= (np.abs(y) > inner + slack) & (np.abs(y) < inner + thick_m - slack)
        fingers &= np.abs(z) < 0.5 * height_m - slack
        assert not fingers.any(), grasp


@pytest.mark.slow
def test_suctions_are_on_flat_places_that_face_up() -> None:
    """The rim of the cup meets the object everywhere within the seal's tolerance."""
    _, frame, meshes = settled()
    assert frame.suctions
    for suction in frame.suctions:
        normal, point = np.array(suction.normal), np.array(suction.point_m)
        assert normal[2] > 0.0
        assert 0.0 < suction.score <= 1.0
        helper = np.cross(normal, [0.3, 0.5, 0.1])
        u = helper / np.linalg.norm(helper)
        for angle in np.arange(0.0, 6.28, 0.5):
            radial = np.cos(angle) * u + np.sin(angle) * np.cross(normal, u)
            start = point + SETTINGS.cup_m * radial + 0.003 * normal
            distance_m, _ = cast(meshes[suction.instance_id], start, -normal)
            assert distance_m == pytest.approx(0.003, abs=1.5 * SETTINGS.seal_m)


@pytest.mark.slow
def test_only_loose_annotated_things_are_grasped_best_first() -> None:
    """No furniture, no robot; at most as many as asked for."""
    scene, frame, _ = settled()
    loose = {b.instance_id for b in scene.bodies if b.motion == "dynamic"}
    annotated = {i.instance_id for i in scene.instances if i.annotated}
    for found in (frame.grasps or (), frame.suctions or ()):
        assert {g.instance_id for g in found} <= loose & annotated
        for number in {g.instance_id for g in found}:
            scores = [g.score for g in found if g.instance_id == number]
            assert scores == sorted(scores, reverse=True)
            assert len(scores) <= SETTINGS.most
