"""Drawn values of all parameters, beside the distributions that the configuration declares.

Randomizers are pure functions of (configuration, seed, scene), so that their draws are repeated
here instead of being kept in every data set: scenes are drawn and settled again, without rendering,
by distributions that record their values. Repeated scenes are compared with the stored ones.
"""

from __future__ import annotations

import copy
import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from pydantic import BaseModel

from gen_data.generator.assemble.config import Config, load_config
from gen_data.generator.assemble.pipeline_factory import scene_source
from gen_data.generator.assets.library import Library, open_library
from gen_data.generator.config.distributions import Constant, Distribution, Numeric
from gen_data.generator.config.shared_values import Shared, read_shared
from gen_data.generator.config.yaml_scalars import to_flow_yaml
from gen_data.generator.core.errors import LayoutRejected, VerificationError
from gen_data.generator.core.interfaces import PhysicsEngine, Randomizer, Stage
from gen_data.generator.core.scene import Scene
from gen_data.generator.core.scene_time import place_sensors
from gen_data.generator.core.serialization import canonical_json
from gen_data.generator.core.streams import Rng, Streams
from gen_data.generator.physics import open_engine
from gen_data.generator.pipeline.finalize_scene import finalize_scene
from gen_data.generator.runner.stored import StoredSamples

EXPECTED_DRAWS = 50_000
"""Draws that represent a declared distribution."""

Draw = tuple[str, Distribution[Any], Any]
"""Name of a parameter, its distribution, and a drawn value."""


@dataclass
class Parameter:
    """All drawn values of one parameter.

    Attributes:
        name: Name of the randomizer and the path of the field: ``orbit.distance_m``.
        values: Drawn values, in order.
        declared: Distributions that drew them, as YAML, with their numbers of draws. There are
            several where a field depends on shared values.
        expected: Values drawn from the declared distributions, in these proportions.
        limits: Smallest and largest possible value; None where there are none.
    """

    name: str
    values: list[Any] = field(default_factory=list)
    declared: Counter[str] = field(default_factory=Counter)
    expected: list[Any] = field(default_factory=list)
    limits: tuple[float, float] | None = None


@dataclass(frozen=True)
class DrawnParameters:
    """Parameters and rejections of some scenes of a data set.

    Attributes:
        parameters: Sorted by name.
        scenes: Number of scenes that were drawn again.
        different: Number of these whose first view differs from the stored scene.
        rejections: Numbers of rejected attempts by reason and remedy.
    """

    parameters: tuple[Parameter, ...]
    scenes: int
    different: int
    rejections: Mapping[tuple[str, str], int]


@dataclass(frozen=True)
class Drawn:
    """A draw of a stored data set.

    Attributes:
        name: Name of the parameter.
        distribution: The distribution that drew the value.
        samples: Numbers of the samples that it is for: all of a scene, or those of a view.
    """

    name: str
    distribution: Distribution[Any]
    value: Any
    samples: range


def replay_draws(stored: StoredSamples) -> list[Drawn]:
    """Repeat all draws of a data set that are not constant, in order.

    Raises:
        ConfigError, AssetError: the configuration or an asset of the data set is not available.
        VerificationError: a scene that is drawn again differs from the stored one.
    """
    config = load_config(str(stored.folder))
    library = open_library(config.asset_folders)
    log: list[Drawn] = []

    def keep(draws: Sequence[Draw], samples: range) -> None:
        log.extend(Drawn(*draw, samples) for draw in draws if not isinstance(draw[1], Constant))

    replayed = _Replay(stored, config, library, keep)
    with open_engine(library, config.general.physics) as physics:
        for scene in range(-(-stored.n // replayed.per_scene)):
            if not replayed.draw_scene(scene, physics):
                raise VerificationError(
                    f"{stored.folder}: scene {scene} is different when it is drawn again; expected "
                    "the version of gen-data that made the data set"
                )
    return log


def draw_parameters(stored: StoredSamples, scenes_max: int) -> DrawnParameters:
    """Repeat the draws of some scenes, chosen evenly, and of all their views.

    Raises:
        ConfigError, AssetError: the configuration or an asset of the data set is not available.
    """
    config = load_config(str(stored.folder))
    library = open_library(config.asset_folders)
    kept = _Kept()
    replayed = _Replay(stored, config, library, kept.keep)
    count = -(-stored.n // replayed.per_scene)
    chosen = sorted({k * count // scenes_max for k in range(scenes_max)}) if scenes_max else []
    with open_engine(library, config.general.physics) as physics:
        different = sum(not replayed.draw_scene(scene, physics) for scene in chosen)
    parameters = tuple(kept.parameters[name] for name in sorted(kept.parameters))
    for parameter in parameters:
        declared = {text: kept.distributions[parameter.name, text] for text in parameter.declared}
        parameter.expected = _expected_values(parameter, declared)
        parameter.limits = _limits(declared.values())
    return DrawnParameters(parameters, len(chosen), different, replayed.rejections)


class _Kept:
    """Drawn values by parameter.

    Attributes:
        distributions: Declared distributions by parameter and YAML.
    """

    def __init__(self) -> None:
        self.parameters: dict[str, Parameter] = {}
        self.distributions: dict[tuple[str, str], Distribution[Any]] = {}

    def keep(self, draws: Sequence[Draw], samples: range) -> None:
        del samples
        for name, distribution, value in draws:
            if isinstance(distribution, Constant):
                continue
            text = to_flow_yaml(distribution.to_yaml())
            self.distributions.setdefault((name, text), distribution)
            parameter = self.parameters.setdefault(name, Parameter(name))
            parameter.values.append(value)
            parameter.declared[text] += 1


class _Replay:
    """Draws scenes again, hands the draws over, and keeps the rejections.

    Attributes:
        per_scene: Samples of a scene.
    """

    def __init__(
        self,
        stored: StoredSamples,
        config: Config,
        library: Library,
        keep: Callable[[Sequence[Draw], range], None],
    ) -> None:
        self._keep = keep
        self.per_scene = stored.info.views_per_scene * stored.info.steps_per_scene
        self.rejections: Counter[tuple[str, str]] = Counter()
        self._stored, self._config, self._library = stored, config, library
        self._open_scene = scene_source(config, library)
        self._category_ids = {name: i for i, name in enumerate(stored.info.categories, 1)}

    def draw_scene(self, number: int, physics: PhysicsEngine) -> bool:
        """Draw a scene and its views; return whether the first view equals the stored one."""
        info = self._stored.info
        first = number * self.per_scene
        kept = self._stored.kept_scene(first)
        log: list[Draw] = []

        def settle(attempt: int) -> tuple[Scene, Sequence[Randomizer]]:
            log.clear()
            streams = Streams(info.seed, number, attempt=attempt, index=number)
            nominal, randomizers, _ = self._open_scene(streams)
            observed = tuple(_observe_randomizer(randomizer, log) for randomizer in randomizers)
            drawn = self._randomize(nominal, observed, Stage.BUILD, streams)
            settled = physics.settle(drawn)
            if settled.rejection is not None:
                raise LayoutRejected(settled.rejection)
            return finalize_scene(settled.scene, self._library, self._category_ids), observed

        scene, observed = self._accept(kept.attempts, settle)
        samples = range(first, min(first + self.per_scene, self._stored.n))
        self._keep((*log, *self._shared_draws(scene)), samples)
        equal = True
        for view in range(min(info.views_per_scene, self._views_left(first))):
            index = number * info.views_per_scene + view
            stored_view = self._stored.kept_scene(index * info.steps_per_scene)

            def draw_view(attempt: int, view: int = view, index: int = index) -> Scene:
                log.clear()
                streams = Streams(info.seed, number, view=view, attempt=attempt, index=index)
                return place_sensors(self._randomize(scene, observed, Stage.VIEW, streams))

            placed = self._accept(stored_view.view_attempts, draw_view)
            begin = index * info.steps_per_scene
            self._keep(log, range(begin, min(begin + info.steps_per_scene, self._stored.n)))
            if view == 0:
                equal = canonical_json(placed) == canonical_json(stored_view.scene)
        return equal

    def _views_left(self, first: int) -> int:
        return -(-(self._stored.n - first) // self._stored.info.steps_per_scene)

    def _accept(self, attempts: int, draw: Callable[[int], Any]) -> Any:
        """Result of the attempt that the data set accepted; counts the ones before it."""
        for attempt in range(attempts - 1):
            try:
                draw(attempt)
            except LayoutRejected as refused:
                self.rejections[(refused.rejection.reason, refused.rejection.remedy)] += 1
        return draw(attempts - 1)

    def _randomize(
        self, scene: Scene, randomizers: Sequence[Randomizer], stage: Stage, streams: Streams
    ) -> Scene:
        for randomizer in randomizers:
            if randomizer.stage == stage:
                rng = streams.rng(f"randomizer/{randomizer.name}")
                scene = randomizer(scene, self._library, rng)
        return scene

    def _shared_draws(self, scene: Scene) -> Iterator[Draw]:
        """Values of the section ``shared``."""
        values: Shared = dict(scene.shared)
        if values:
            section = self._config.document.entries["shared"]
            for name, distribution in read_shared(section, values).items():
                yield f"shared.{name}", distribution, values[name]


def _observe_randomizer(randomizer: Randomizer, log: list[Draw]) -> Randomizer:
    if not isinstance(randomizer, BaseModel):
        return randomizer
    observed: Randomizer = _observe(randomizer, randomizer.name, log)
    return observed


def _observe(value: Any, name: str, log: list[Draw]) -> Any:
    """The value with all distributions in it replaced by equal ones that record their draws."""
    if isinstance(value, Distribution):
        return _observe_distribution(value, name, log)
    if isinstance(value, BaseModel):
        changed = {
            key: _observe(item, f"{name}.{key}", log)
            for key, item in value
            if isinstance(item, (Distribution, BaseModel, tuple, list, Mapping))
        }
        return value.model_copy(update=changed)
    if type(value) in (tuple, list):
        return type(value)(_observe(item, f"{name}[{k}]", log) for k, item in enumerate(value))
    if isinstance(value, Mapping):
        return {key: _observe(item, f"{name}.{key}", log) for key, item in value.items()}
    return value


def _observe_distribution(
    distribution: Distribution[Any], name: str, log: list[Draw]
) -> Distribution[Any]:
    def draw(rng: Rng) -> Any:
        value = distribution.draw(rng)
        log.append((name, distribution, value))
        return value

    observed = copy.copy(distribution)
    # An attribute of the instance hides the method of its frozen class; the copy stays equal.
    object.__setattr__(observed, "draw", draw)
    return observed


def _expected_values(parameter: Parameter, declared: Mapping[str, Distribution[Any]]) -> list[Any]:
    """Values of the declared distributions, in proportion to their numbers of draws."""
    total = parameter.declared.total()
    values: list[Any] = []
    for text, count in parameter.declared.items():
        rng = Streams(0, 0).rng(f"report/{parameter.name}/{text}")
        for turn in range(max(1, round(EXPECTED_DRAWS * count / total))):
            # A sequence takes its values in turn.
            rng.index = turn
            values.append(declared[text].draw(rng))
    return values


def _limits(declared: Iterable[Distribution[Any]]) -> tuple[float, float] | None:
    lows, highs = [], []
    for distribution in declared:
        if not isinstance(distribution, Numeric):
            return None
        try:
            low, high = distribution.support()
        except TypeError:
            # A choice of names.
            return None
        lows.append(low)
        highs.append(high)
    limits = (min(lows), max(highs))
    return limits if all(map(math.isfinite, limits)) else None
