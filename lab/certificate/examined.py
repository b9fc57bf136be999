"""The data set under examination, and how much of it is sampled."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gen_data.assemble.config import Config, load_config
from gen_data.assets.library import Library
from gen_data.core import capture, errors, streams
from gen_data.core.reported import copies
from gen_data.core.sample import Sample
from gen_data.packs.provision import open_assets
from gen_data.pipeline.finalize_scene import Timeline
from gen_data.report import drawn_parameters, stored_labels
from gen_data.runner.exports import StoredPipeline
from gen_data.runner.regeneration import Regeneration, plan_regeneration
from gen_data.runner.stored import StoredSamples


@dataclass(frozen=True)
class Scope:
    """How much is examined; everything that is not listed here is examined completely.

    Attributes:
        samples: Samples whose pixels and laser points are compared with an independent ray caster,
            and that are generated again.
        rays: Pixels of every image of these samples, and points of every scan.
        scenes: Scenes whose parameters are drawn again.
        alpha: Probability that a correct data set fails the claim on distributions.
    """

    samples: int = 20
    rays: int = 500
    scenes: int = 100
    alpha: float = 1e-3


@dataclass(frozen=True, eq=False)
class Examined:
    """A finished data set, opened for all claims.

    Attributes:
        stored: Its samples.
        scope: How much is sampled.
    """

    stored: StoredSamples
    scope: Scope

    @cached_property
    def config(self) -> Config:
        """Its configuration; ConfigError if it is not valid here."""
        return load_config(str(self.stored.folder))

    @cached_property
    def library(self) -> Library:
        """The assets of its configuration on this machine."""
        return open_assets(self.config.asset_folders)

    @cached_property
    def replay(self) -> drawn_parameters.Replay:
        """Some of its scenes, drawn again.

        Raises:
            ConfigError, AssetError: the configuration or an asset is not available here.
        """
        return drawn_parameters.replay_scenes(self.stored, self.scope.scenes)

    @cached_property
    def changes(self) -> str:
        """Why this installation does not draw the same scenes; empty if it does."""
        plan = self.stored.plan
        if plan.scenes_of:
            return f"the scenes come from the data set {plan.scenes_of[:16]}: certify that one"
        try:
            changes = self.regeneration.changes
        except errors.GenDataError as error:
            if errors.is_refused(error):
                raise
            return f"the scenes cannot be drawn on this machine: {error}"
        listed = "; ".join(changes[:3]) + ("; ..." if len(changes) > 3 else "")
        return f"this installation differs from the one of the data set: {listed}" * bool(changes)

    @cached_property
    def regeneration(self) -> Regeneration:
        """Plan and pipeline that make its samples again.

        Raises:
            ConfigError, AssetError: the configuration or an asset is not available here.
        """
        return plan_regeneration(self.stored.folder, self.stored.plan)

    def images(self) -> Iterator[stored_labels.ImageLabels]:
        """The labels of every image, in order."""
        return stored_labels.read_images(self.stored)

    def arrived(self, index: int, camera: str) -> bool:
        """Whether exports have an image: a sensor with faults may have lost it."""
        if "lost" not in self.stored.info.sensor(camera).faults:
            return True
        return copies(self.stored.labelled(index).capture.readings[camera]) > 0

    def photograph(self, index: int, camera: str) -> NDArray[np.uint8]:
        """The photograph of a camera in a sample, uint8 [h, w, 3]."""
        reading = self.stored.labelled(index).capture.readings[camera]
        return np.asarray(reading.channels[capture.Channel.RGB], np.uint8)

    def rng(self, name: str) -> streams.Rng:
        """A stream for choosing samples: the same for the same data set."""
        return streams.Streams(0, 0).rng(f"certificate/{self.stored.dataset_id}/{name}")

    def chosen_indices(self) -> list[int]:
        """Numbers of random samples, ascending; all if there are few."""
        count = min(self.scope.samples, self.stored.n)
        chosen = self.rng("samples").permutation(self.stored.n)[:count]
        return sorted(self.stored.indices[int(number)] for number in chosen)

    def chosen_samples(self) -> list[Sample]:
        """The samples of these numbers."""
        pipeline = StoredPipeline(self.stored, {}, self.config.asset_folders, has_points=True)
        return [pipeline.sample(index) for index in self.chosen_indices()]

    def timeline(self, sample: Sample) -> Timeline:
        """The sample's world through time."""
        ids = {name: number for number, name in enumerate(self.stored.categories, 1)}
        return Timeline(sample.scene, self.library, ids)
