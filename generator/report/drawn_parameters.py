"""Drawn values of all parameters, next to the distributions that the configuration declares.

Randomizers are pure functions of (configuration, seed, scene). Their draws are repeated here
instead of being kept in every data set: scenes are drawn and settled again, without rendering, by
distributions that record their values. Repeated scenes are compared with the stored ones.
"""

import copy
import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice, starmap
from typing import Any

from pydantic import BaseModel

from gen_data.assemble.config import Config, load_config
from gen_data.assemble.pipeline_factory import scene_source
from gen_data.assets.library import Library
from gen_data.config import shared_values, yaml_scalars
from gen_data.config.distributions import Constant, Distribution, Numeric
from gen_data.core.errors import LayoutRejected
from gen_data.core.interfaces import PhysicsEngine, Randomizer, Stage
from gen_data.core.scene import Scene
from gen_data.core.serialization import canonical_json, to_plain
from gen_data.core.streams import Rng, Streams
from gen_data.packs.provision import open_assets
from gen_data.physics import open_engine
from gen_data.pipeline import attempts
from gen_data.pipeline.scene_stages import finish_settled, finish_view
from gen_data.runner import plan, provenance
from gen_data.runner.stored import StoredSamples

ROUNDING = 1e-5
"""Numbers of a scene that differ by less are equal: processors may differ in last bits, and poses
are rounded to a micrometre."""

EXPECTED_PER_DRAW, EXPECTED_MIN, EXPECTED_MAX = 100, 2_000, 50_000
"""Draws that represent a declared distribution: as many for each drawn value, within limits. A
hundred times the values widen the limit of the comparison, ``sqrt(1/n + 1/m)``, by 0.5 %."""

Draw = tuple[str, Distribution[Any], Any]
"""Name of a parameter, its distribution, and a drawn value."""


@dataclass(frozen=True)
class Drawn:
    """A draw of a stored data set.

    Attributes:
        name: Name of the parameter.
        distribution: The distribution that drew the value.
        samples: Numbers of the samples that it applies to: all of a scene, or of a view.
    """

    name: str
    distribution: Distribution[Any]
    value: Any
    samples: range


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
        firsts: The first value of every scene, or of every view, in its first attempt, with its
            distribution: layouts that were rejected later have no influence on these.
    """

    name: str
    values: list[Any] = field(default_factory=list)
    declared: Counter[str] = field(default_factory=Counter)
    expected: list[Any] = field(default_factory=list)
    limits: tuple[float, float] | None = None
    firsts: list[tuple[Distribution[Any], Any]] = field(default_factory=list)


@dataclass(frozen=True)
class DrawnParameters:
    """Parameters and rejections of some scenes of a data set.

    Attributes:
        parameters: Sorted by name.
        scenes: Number of scenes that were drawn again.
        different: Number of these that differ from the stored scenes.
        rejections: Numbers of rejected attempts by reason and remedy.
    """

    parameters: tuple[Parameter, ...]
    scenes: int
    different: int
    rejections: Mapping[tuple[str, str], int]


def draw_parameters(stored: StoredSamples, scenes_max: int) -> DrawnParameters:
    """Repeat the draws of some scenes, and represent their distributions by drawn values.

    Raises:
        ConfigError, AssetError: the configuration or an asset of the data set is not available.
    """
    replay = replay_scenes(stored, scenes_max)
    # Some parameters are drawn in rejected attempts only.
    drawn = (replay.parameters[name] for name in sorted(replay.parameters))
    parameters = tuple(parameter for parameter in drawn if parameter.values)
    for parameter in parameters:
        declared = {text: replay.distributions[parameter.name, text] for text in parameter.declared}
        parameter.expected = _expected_values(parameter, declared)
        parameter.limits = _limits(declared.values())
    return DrawnParameters(parameters, replay.scenes, len(replay.differences), replay.rejections)


def replay_scenes(stored: StoredSamples, scenes_max: int) -> "Replay":
    """Draw some scenes again, chosen evenly, and all their views.

    Raises:
        ConfigError, AssetError: the configuration or an asset of the data set is not available.
    """
    config = load_config(str(stored.folder))
    library = open_assets(config.asset_folders)
    replay = Replay(stored, config, library)
    count = -(-stored.plan.n // replay.per_scene)
    partial = {failure.index // replay.per_scene for failure in stored.failed}
    whole = [scene for scene in range(count) if scene not in partial] if partial else range(count)
    places = {k * len(whole) // scenes_max for k in range(scenes_max)} if whole else set()
    chosen = [whole[place] for place in sorted(places)]
    with open_engine(library, config.general.physics) as physics:
        for scene in chosen:
            try:
                replay.draw_scene(scene, physics)
            except LayoutRejected as refused:
                text = f"scene {scene}, drawn again: the accepted layout is rejected ({refused})"
                replay.differences.append(text)
    return replay


class Replay:
    """Draws scenes again, and keeps the values and the rejections.

    Attributes:
        parameters: By name, without ``expected`` and ``limits``; without ``values`` if rejected
            attempts alone drew them.
        distributions: Declared distributions by parameter and YAML.
        rejections: Numbers of rejected attempts by reason and remedy.
        per_scene: Samples of a scene.
        scenes: Number of scenes that were drawn.
        differences: The first difference of each scene that is not the stored one, in words.
        draws: All draws of accepted attempts, in order, but for constants.
    """

    def __init__(self, stored: StoredSamples, config: Config, library: Library) -> None:
        self.parameters: dict[str, Parameter] = {}
        self.distributions: dict[tuple[str, str], Distribution[Any]] = {}
        self.rejections: Counter[tuple[str, str]] = Counter()
        self.scenes = 0
        self.differences: list[str] = []
        self.draws: list[Drawn] = []
        self.per_scene = stored.info.views_per_scene * stored.info.steps_per_scene
        self._stored, self._config, self._library = stored, config, library
        self._open_scene = scene_source(config, library)
        self._category_ids = {name: i for i, name in enumerate(stored.info.categories, 1)}

    def draw_scene(self, number: int, physics: PhysicsEngine) -> None:
        """Draw a scene and its views, and compare them with the stored ones.

        Raises:
            LayoutRejected: the attempt that the data set accepted.
        """
        self.scenes += 1
        info = self._stored.info
        first = number * self.per_scene
        log: list[Draw] = []

        def settle(attempt: int) -> tuple[Scene, Sequence[Randomizer]]:
            streams = Streams(info.seed, number, attempt=attempt, index=number)
            nominal, randomizers, _ = self._open_scene(streams)
            log.extend(shared_draws(self._config, nominal))
            observed = tuple(observe_randomizer(randomizer, log) for randomizer in randomizers)
            drawn = attempts.randomize(nominal, observed, Stage.BUILD, self._library, streams)
            settled = physics.settle(drawn)
            if settled.rejection is not None:
                raise LayoutRejected(settled.rejection)
            scene = finish_settled(settled.scene, self._library, self._category_ids)
            if attempt < accepted:
                self._draw_views(number, scene, randomizers)
            return scene, observed

        samples = range(first, min(first + self.per_scene, self._stored.plan.n))
        accepted = self._stored.kept_scene(first).attempts - 1
        scene, observed = self._accept(accepted, settle, log, samples)
        views = []
        for view in range(min(info.views_per_scene, self._views_left(first))):
            index = number * info.views_per_scene + view
            begin = index * info.steps_per_scene
            samples = range(begin, min(begin + info.steps_per_scene, self._stored.plan.n))
            kept = self._stored.kept_scene(begin)

            def draw_view(attempt: int, view: int = view) -> Scene:
                streams = info.view_streams(number, view, attempt)
                twin = scene.twin(info.twin(view))
                drawn = attempts.randomize(twin, observed, Stage.VIEW, self._library, streams)
                return finish_view(drawn, self._library, self._category_ids)

            views.append((kept, self._accept(kept.view_attempts - 1, draw_view, log, samples)))
        self.differences += islice(filter(None, starmap(_first_difference, views)), 1)

    def _views_left(self, first: int) -> int:
        return -(-(self._stored.plan.n - first) // self._stored.info.steps_per_scene)

    def _draw_views(self, number: int, scene: Scene, randomizers: Sequence[Randomizer]) -> None:
        """Draw all views of a layout. Raises LayoutRejected if it leaves no place for one."""
        info, most = self._stored.info, self._config.general.physics.layout_attempts_max
        for view in range(info.views_per_scene):
            attempts.draw_view(scene, number, view, randomizers, info, self._library, most)

    def _accept(
        self, accepted: int, draw: Callable[[int], Any], log: list[Draw], samples: range
    ) -> Any:
        """Result of the attempt that the data set accepted; counts the ones before it.

        Attempts leave their draws in the log.
        """
        for attempt in range(accepted + 1):
            log.clear()
            try:
                result = draw(attempt)
            except LayoutRejected as refused:
                if attempt == accepted:
                    raise
                self.rejections[(refused.rejection.reason, refused.rejection.remedy)] += 1
            if attempt == 0:
                self._keep_firsts(log)
        self._keep(log, samples)
        return result

    def _keep(self, draws: Sequence[Draw], samples: range) -> None:
        for name, distribution, value in draws:
            if isinstance(distribution, Constant):
                continue
            self.draws.append(Drawn(name, distribution, value, samples))
            text = yaml_scalars.to_flow_yaml(distribution.to_yaml())
            self.distributions.setdefault((name, text), distribution)
            parameter = self._parameter(name)
            parameter.values.append(value)
            parameter.declared[text] += 1

    def _keep_firsts(self, draws: Sequence[Draw]) -> None:
        firsts = {name: (distribution, value) for name, distribution, value in reversed(draws)}
        for name, (distribution, value) in firsts.items():
            if not isinstance(distribution, Constant):
                self._parameter(name).firsts.append((distribution, value))

    def _parameter(self, name: str) -> Parameter:
        return self.parameters.setdefault(name, Parameter(name))


def _first_difference(kept: provenance.KeptScene, drawn: Scene) -> str:
    """The first difference of a scene from the one that was drawn again; empty if equal."""
    if canonical_json(drawn) == canonical_json(kept.scene):
        return ""
    was, now = to_plain(kept.scene), to_plain(drawn)
    found = next((line for line in plan.differences("", was, _snap(was, now))), "")
    return found and f"sample {kept.index}, drawn again: {found}"


def _snap(was: Any, now: Any) -> Any:
    """The plain value ``now`` with those numbers of ``was`` that are the same but for rounding."""
    if isinstance(was, dict) and isinstance(now, dict):
        return {k: _snap(was[k], v) if k in was else v for k, v in now.items()}
    if isinstance(was, list) and isinstance(now, list) and len(was) == len(now):
        return [_snap(left, right) for left, right in zip(was, now, strict=True)]
    if isinstance(was, float) and isinstance(now, float):
        return was if math.isclose(was, now, rel_tol=ROUNDING, abs_tol=ROUNDING) else now
    return now


def shared_draws(config: Config, scene: Scene) -> Iterator[Draw]:
    """Values of the section ``shared`` of a scene, with their distributions."""
    values: shared_values.Shared = dict(scene.shared)
    if values:
        section = config.document.entries["shared"]
        for name, distribution in shared_values.read_shared(section, values).items():
            yield f"shared.{name}", distribution, values[name]


def observe_randomizer(
    randomizer: Randomizer, log: list[Draw], pinned: Mapping[str, Any] | None = None
) -> Randomizer:
    """A randomizer with the same results that records its draws.

    Args:
        randomizer: One without distributions is returned as it is.
        log: Receives the draws.
        pinned: Values by name that replace those drawn. A draw still takes its random numbers: all
            others stay as they are.
    """
    if not isinstance(randomizer, BaseModel):
        return randomizer
    observed: Randomizer = _observe(randomizer, randomizer.name, log, pinned or {})
    return observed


def _observe(value: Any, name: str, log: list[Draw], pinned: Mapping[str, Any]) -> Any:
    """The value with all distributions in it replaced by equal ones that record their draws."""
    if isinstance(value, Distribution):
        return _observe_distribution(value, name, log, pinned)
    if isinstance(value, BaseModel):
        changed = {
            key: _observe(item, f"{name}.{key}", log, pinned)
            for key, item in value
            if isinstance(item, (Distribution, BaseModel, tuple, list, Mapping))
        }
        return value.model_copy(update=changed)
    if type(value) in (tuple, list):
        return type(value)(
            _observe(item, f"{name}[{k}]", log, pinned) for k, item in enumerate(value)
        )
    if isinstance(value, Mapping):
        return {key: _observe(item, f"{name}.{key}", log, pinned) for key, item in value.items()}
    return value


def _observe_distribution(
    distribution: Distribution[Any], name: str, log: list[Draw], pinned: Mapping[str, Any]
) -> Distribution[Any]:
    def draw(rng: Rng) -> Any:
        value = distribution.draw(rng)
        value = pinned.get(name, value)
        log.append((name, distribution, value))
        return value

    observed = copy.copy(distribution)
    # An attribute of the instance hides the method of its frozen class; the copy stays equal.
    object.__setattr__(observed, "draw", draw)
    return observed


def _expected_values(parameter: Parameter, declared: Mapping[str, Distribution[Any]]) -> list[Any]:
    """Values of the declared distributions, in proportion to their numbers of draws, at least 1."""
    total = parameter.declared.total()
    wanted = min(max(EXPECTED_PER_DRAW * total, EXPECTED_MIN), EXPECTED_MAX)
    values: list[Any] = []
    for text, count in parameter.declared.items():
        rng = Streams(0, 0).rng(f"report/{parameter.name}/{text}")
        for turn in range(max(1, round(wanted * count / total))):
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
