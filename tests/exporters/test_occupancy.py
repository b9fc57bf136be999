"""Occupancy grids on disk, read by the formulas of their users."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.core.asset_types import SURFACES
from gen_data.core.sample import EgoTruth, Occupancy, Sample
from gen_data.exporters.nuscenes import NuScenes
from gen_data.exporters.occupancy import OccupancyGrids
from tests.exporters.datasets import made_of
from tests.exporters.drives import drive_info
from tests.exporters.label_readers import json_lines
from tests.survival import assert_survives

LOW_M, VOXEL_M, SHAPE = (0.0, -8.0, -2.4), 0.4, (64, 40, 16)
EXPORTER = OccupancyGrids(layouts=("occ3d", "surroundocc", "openoccupancy", "semantickitti"))
CAR, PEDESTRIAN, ROAD, TERRAIN_FREE = 4, 7, 11, 17
"""Classes of Occ3D-nuScenes, from its page."""


def gridded(world: Any) -> tuple[Any, list[Sample]]:
    """The drive with the voxels of its boxes in the scanner's frame, on a road 1.7 m below.

    The car's inner voxels are interior, as is the land; the camera sees the first half.
    """
    samples = []
    for sample in world.drive():
        T_world_frame = sample.scene.lidar("top").T_world_lidar
        centers = np.indices(SHAPE).transpose(1, 2, 3, 0) * VOXEL_M + 0.5 * VOXEL_M + LOW_M
        p_world = T_world_frame.apply(centers)
        state, ids = np.zeros(SHAPE, np.uint8), np.zeros(SHAPE, np.uint16)
        road = int((-1.73 - LOW_M[2]) // VOXEL_M)
        state[:, :, road], state[:, :, :road] = 1, 2
        surface = np.where(state == 1, SURFACES.index("asphalt"), 0).astype(np.uint8)
        for instance in sample.scene.instances:
            p = instance.T_world_instance.inverse().apply(p_world)
            inside = ((p >= instance.box_min_m) & (p <= instance.box_max_m)).all(axis=-1)
            state[inside], ids[inside], surface[inside] = 1, instance.instance_id, 0
            if instance.category == "car":
                state[inside & (np.abs(p[..., 1]) < 0.3)] = 2
        half = np.broadcast_to(np.arange(SHAPE[0])[:, None, None] < 32, SHAPE)
        observed = {"left": half, "right": half, "top": state < 2}
        grid = Occupancy(T_world_frame, LOW_M, VOXEL_M, state, ids, surface, observed)
        samples.append(replace(sample, frame=EgoTruth("ego", occupancy=grid)))
    return drive_info(world), samples


@pytest.fixture
def grids(world: Any) -> list[Sample]:
    return gridded(world)[1]


folder = made_of(EXPORTER, gridded)


def of(sample: Sample) -> Occupancy:
    assert sample.frame is not None
    assert sample.frame.occupancy is not None
    return sample.frame.occupancy


def unpacked(path: Path) -> NDArray[np.bool_]:
    """Flags as semantic-kitti-api's ``unpack`` reads them: the first one is the highest bit."""
    packed = np.fromfile(path, np.uint8)
    flags = np.zeros(8 * len(packed), np.uint8)
    for k in range(8):
        flags[k::8] = packed >> (7 - k) & 1
    return flags.reshape(SHAPE).astype(bool)


def problems(folder: Path, grids: list[Sample]) -> list[str]:
    """Facts in the files that are not as in the samples."""
    found = []
    rows = json_lines(folder / "frames.jsonl")
    for sample, row in zip(grids, rows, strict=True):
        grid, scene = of(sample), sample.scene
        stored = np.load(folder / f"grids/{sample.index:09d}.npz")
        kinds = {0: 0} | {i.instance_id: i.category_id for i in scene.instances}
        truth = {
            "state": grid.state,
            "instance_id": grid.instance_id,
            "surface": grid.surface,
            "category_id": np.vectorize(kinds.get)(grid.instance_id),
            **{f"observed_{name}": mask for name, mask in grid.observed.items()},
        }
        found += [f"{row['index']}: {k}" for k, v in truth.items() if (stored[k] != v).any()]
        if not np.allclose(row["T_world_frame"], grid.T_world_frame.matrix(), atol=1e-9):
            found.append(f"{row['index']}: pose")
        own = stored["instance_id"][tuple(stored["moving"].T)]
        for instance in scene.instances:
            told = stored["velocity_m_s"][own == instance.instance_id]
            speed = np.linalg.norm(instance.twist.velocity_m_s)
            if len(told) and abs(np.linalg.norm(told, axis=1) - speed).max() > 1e-4:
                found.append(f"{row['index']}: velocity of {instance.name}")
    return found


def test_grids_are_those_of_the_samples(folder: Path, grids: list[Sample]) -> None:
    assert problems(folder, grids) == []
    names = json.loads((folder / "classes.json").read_text())
    assert names["categories"][1:] == ["car", "crate", "pedestrian"]
    assert names["surfaces"][SURFACES.index("asphalt")] == "asphalt"


def test_occ3d_has_nuscenes_classes_under_the_tokens_of_the_nuscenes_export(
    world: Any, folder: Path, grids: list[Sample], tmp_path: Path
) -> None:
    """Truth as prediction has a mean IoU of 1 by Occ3D's formula; classes are from its page."""
    nuscenes = world.export(NuScenes(), drive_info(world), world.drive(), tmp_path / "nuscenes")
    tables = nuscenes / "v1.0-mini"
    scenes = {s["token"]: s["name"] for s in json.loads((tables / "scene.json").read_text())}
    for row in json.loads((tables / "sample.json").read_text()):
        assert (
            folder / f"occ3d/gts/{scenes[row['scene_token']]}/{row['token']}/labels.npz"
        ).exists()

    row = json_lines(folder / "frames.jsonl")[0]
    labels = np.load(folder / f"occ3d/gts/gen-scene-000000/{row['sample_token']}/labels.npz")
    semantics, grid = labels["semantics"], of(grids[0])
    expected = np.full(SHAPE, TERRAIN_FREE)
    expected[grid.surface == SURFACES.index("asphalt")] = ROAD
    for number, kind in {1: CAR, 2: PEDESTRIAN, 4: 0}.items():
        expected[grid.instance_id == number] = kind
    assert (semantics == expected).all()
    assert {CAR, PEDESTRIAN, ROAD} < set(semantics.ravel().tolist())
    assert (labels["mask_camera"] == grid.observed["left"]).all()
    assert (labels["mask_lidar"] == grid.observed["top"]).all()
    # The scanner's frame itself moves at 10 m/s; flow is of the objects in the world.
    car = labels["flow"][grid.instance_id == 1].astype(float)
    assert np.linalg.norm(car, axis=1) == pytest.approx(8.0, abs=0.02)
    assert not labels["flow"][grid.instance_id == 0].any()

    rows = np.load(folder / f"surroundocc/{row['sample_token']}.npy")
    dense = np.full(SHAPE, TERRAIN_FREE)
    dense[tuple(rows[:, :3].T)] = rows[:, 3]
    assert (dense == np.where(grid.state == 1, expected, TERRAIN_FREE)).all()


def test_openoccupancy_has_the_same_voxels_from_z_to_x_under_tokens_of_the_nuscenes_export(
    world: Any, folder: Path, tmp_path: Path
) -> None:
    nuscenes = world.export(NuScenes(), drive_info(world), world.drive(), tmp_path / "nuscenes")
    tables = nuscenes / "v1.0-mini"
    scenes = {
        s["token"]: s["scene_token"] for s in json.loads((tables / "sample.json").read_text())
    }
    scans = [
        scan
        for scan in json.loads((tables / "sample_data.json").read_text())
        if scan["is_key_frame"] and "LIDAR_TOP" in scan["filename"]
    ]
    assert len(scans) > 1
    for scan in scans:
        sample = scan["sample_token"]
        path = folder / f"openoccupancy/scene_{scenes[sample]}/occupancy/{scan['token']}.npy"
        other = np.load(folder / f"surroundocc/{sample}.npy")
        assert np.load(path)[:, [2, 1, 0, 3]].tolist() == other.tolist()


def test_scene_completion_has_the_layout_of_semantickitti(
    folder: Path, grids: list[Sample]
) -> None:
    """Flags and labels of voxels, x the slowest; moving car 252, moving person 254, road 40."""
    voxels = folder / "semantickitti/sequences/00/voxels"
    assert sorted(p.name for p in voxels.glob("000000.*")) == [
        "000000.bin", "000000.invalid", "000000.label", "000000.occluded",
    ]  # fmt: skip
    labels = np.fromfile(voxels / "000000.label", np.uint16).reshape(SHAPE)
    grid = of(grids[0])
    assert set(labels[grid.instance_id == 1]) == {252}
    assert set(labels[grid.instance_id == 2]) == {254}
    assert set(labels[(grid.instance_id == 0) & (grid.state == 1)]) == {40}
    assert set(labels[(grid.instance_id == 0) & (grid.state != 1)]) == {0}
    assert (unpacked(voxels / "000000.invalid") == (grid.state == 2)).all()
    assert (unpacked(voxels / "000000.occluded") == ~grid.observed["top"]).all()
    points = grids[0].capture.clouds["top"].points["position_m"].astype(float)
    cells = np.floor((points - LOW_M) / VOXEL_M).astype(int)
    inside = ((cells >= 0) & (cells < SHAPE)).all(axis=1)
    assert {tuple(c) for c in cells[inside].tolist()} == {
        tuple(c) for c in np.argwhere(unpacked(voxels / "000000.bin")).tolist()
    }


def test_annotations_survive_their_line_of_labels(grids: list[Sample]) -> None:
    assert_survives(of(grids[0]))
