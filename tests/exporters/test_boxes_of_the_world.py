"""Boxes in the world are where objects are at the step, whatever the delays of the cameras."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.core.sample import Sample
from gen_data.core.scene_time import scene_at
from gen_data.exporters.mcap import Mcap
from gen_data.exporters.rerun import Rerun
from gen_data.preview.rerun_recording import boxes_3d
from tests.exporters.drives import drive_info
from tests.exporters.test_mcap import messages
from tests.exporters.test_rerun import tables

DELAYS_S = {"left": 0.05, "right": 0.02}
CAR_M_S = 8.0
"""Speed of the car of the drive along its x axis, 0.05 rad left of the world's."""
Centres = Mapping[int, np.ndarray]


def delayed(sample: Sample) -> Sample:
    """The sample with labels of cameras that read after its instant."""
    scene, truth, instants = sample.scene, {}, {}
    for name, labels in sample.truth.items():
        then = instants[name] = scene_at(scene, scene.time_s + DELAYS_S[name])
        boxes = {thing.instance_id: thing.box3d for thing in then.instances}
        objects = [replace(t, box3d_world=boxes[t.instance.instance_id]) for t in labels.objects]
        truth[name] = replace(labels, objects=tuple(objects))
    return replace(sample, truth=truth, instants=instants)


def of_mcap(folder: Path, samples: list[Sample]) -> list[Centres]:
    (path,) = folder.glob("train/*.mcap")
    found = [m for topic, _, _, m in messages(path) if topic == "/objects"]
    assert len(found) == len(samples)
    places = [{e.id: e.cubes[0].pose.position for e in message.entities} for message in found]
    return [{int(k): np.array([p.x, p.y, p.z]) for k, p in place.items()} for place in places]


def of_rerun(folder: Path, samples: list[Sample]) -> list[Centres]:
    (path,) = folder.glob("train/*.rrd")
    centres = tables(path)["/world/boxes"]["Boxes3D:centers"]
    ids = sorted({t.instance.instance_id for t in samples[0].truth["left"].objects})
    return [dict(zip(ids, np.array(centres[s.index]), strict=True)) for s in samples]


def of_preview(folder: Path, samples: list[Sample]) -> list[Centres]:
    del folder
    ids = sorted({t.instance.instance_id for t in samples[0].truth["left"].objects})
    found = (boxes_3d(sample).centers.as_arrow_array().to_pylist() for sample in samples)
    return [dict(zip(ids, map(np.array, centres), strict=True)) for centres in found]


READERS = {"mcap": (Mcap(), of_mcap), "rerun": (Rerun(), of_rerun), "preview": (None, of_preview)}


@pytest.mark.parametrize("name", READERS)
def test_cubes_are_where_objects_are_at_the_instant_of_their_message(
    name: str, world: Any, tmp_path: Path
) -> None:
    """A car at 8 m/s is 0.4 m on when a camera with a delay of 50 ms sees it."""
    exporter, read = READERS[name]
    samples = [delayed(s) for s in world.drive() if s.split == "train"]
    folder = tmp_path
    if exporter is not None:
        folder = world.export(exporter, drive_info(world), samples, tmp_path)
    first_m = np.array(world.drive()[0].scene.instance(1).box3d.T_frame_box.translation_m)
    along = CAR_M_S * np.array([np.cos(0.05), np.sin(0.05), 0.0])
    for sample, centres in zip(samples, read(folder, samples), strict=True):
        expected_m = first_m + along * sample.scene.time_s
        np.testing.assert_allclose(centres[1], expected_m, atol=1e-4)
