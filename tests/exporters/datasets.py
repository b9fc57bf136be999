"""Data sets for formats: sources of samples, changes of samples, and fixtures of the exports."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import Sample
from tests.exporters.drives import drive_info

Source = Callable[[Any], tuple[Any, Any]]
"""Description of a data set and its samples, of a world."""


def street(world: Any) -> tuple[Any, Any]:
    """The seven frames of a street."""
    return world.info(7), world.samples


def scanned_street(world: Any) -> tuple[Any, Any]:
    return world.info(7, lidars=("top",)), world.samples


def drive(world: Any) -> tuple[Any, Any]:
    return drive_info(world), world.drive()


def pairs(world: Any) -> tuple[Any, Any]:
    """The same with two cameras that have disparities and flow."""
    info, samples = world.pairs()
    return info, samples


def reach(world: Any) -> tuple[Any, Any]:
    """The drive with an arm that demonstrates a task."""
    return drive_info(world), world.reach()


def made_of(exporter: Any, source: Source = street, assets: Callable[[], Any] | None = None) -> Any:
    """Make a fixture: the folder of a data set in a format, for all tests of a module."""

    @pytest.fixture(scope="module")
    def dataset(world: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
        folder: Path = tmp_path_factory.mktemp(exporter.type)
        return world.export(exporter, *source(world), folder, assets=assets and assets())

    return dataset


def in_scene(sample: Sample, **changes: Any) -> Sample:
    return replace(sample, scene=replace(sample.scene, **changes))


def scanning(sample: Sample, points: Any, **changes: Any) -> Sample:
    """The sample with other points of its only scanner."""
    cloud = replace(sample.capture.clouds["top"], points=points, **changes)
    return replace(sample, capture=replace(sample.capture, clouds={"top": cloud}))


def imaging(sample: Sample, camera: str, images: Mapping[Channel, Any]) -> Sample:
    """The sample with further images of a camera."""
    reading = sample.capture.readings[camera]
    reading = replace(reading, channels={**reading.channels, **images})
    readings = {**sample.capture.readings, camera: reading}
    return replace(sample, capture=replace(sample.capture, readings=readings))


def with_sensor(info: DatasetInfo, name: str, **changes: Any) -> DatasetInfo:
    """The data set with changes of one of its sensors."""
    sensors = (replace(s, **changes) if s.name == name else s for s in info.sensors)
    return replace(info, sensors=tuple(sensors))
