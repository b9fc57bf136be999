"""Draws of layouts and views, repeated with the next streams until one is accepted.

A layout is accepted if it is valid and every view of it can be drawn. Streams of views do not
depend on the attempt at the layout: a view keeps its draws where the layout is drawn again.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

from gen_data.core import errors
from gen_data.core.interfaces import AssetLibrary, DatasetInfo, Randomizer, Stage
from gen_data.core.scene import LABEL_IDS_MAX, Scene
from gen_data.core.streams import Streams

T = TypeVar("T")


def first_accepted(scene_index: int, attempts_max: int, draw: Callable[[int], T]) -> T:
    """Result of the first attempt, from 0, that is not rejected.

    Raises:
        SceneRejected: all are rejected.
    """
    rejections: list[errors.Rejection] = []
    for attempt in range(attempts_max):
        try:
            return draw(attempt)
        except errors.LayoutRejected as refused:
            rejections.append(refused.rejection)
    raise errors.SceneRejected(scene_index, tuple(rejections))


def draw_view(
    scene: Scene,
    scene_index: int,
    view_index: int,
    randomizers: Sequence[Randomizer],
    info: DatasetInfo,
    assets: AssetLibrary,
    attempts_max: int,
) -> tuple[Scene, Streams]:
    """A view of a settled scene as its randomizers draw it, and the streams that drew it.

    Raises:
        LayoutRejected: all attempts at the view are rejected; another layout may have room for it.
    """

    def draw(attempt: int) -> tuple[Scene, Streams]:
        streams = info.view_streams(scene_index, view_index, attempt)
        twin = scene.twin(info.twin(view_index))
        return randomize(twin, randomizers, Stage.VIEW, assets, streams), streams

    try:
        return first_accepted(scene_index, attempts_max, draw)
    except errors.SceneRejected as refused:
        left = info.views_per_scene - view_index
        rejection = _rejection_of_view(view_index, refused.rejections, left)
        raise errors.LayoutRejected(rejection) from None


def _rejection_of_view(
    view_index: int, rejections: Sequence[errors.Rejection], left: int
) -> errors.Rejection:
    """The most frequent rejection of a view; ``left`` views of the layout are not drawn."""
    counts = Counter(rejection.reason for rejection in rejections)
    ((reason, _),) = counts.most_common(1)
    rejection = next(one for one in rejections if one.reason == reason)
    detail = f"all {len(rejections)} draws of view {view_index} are rejected"
    if rejection.detail:
        detail = f"{detail}: {rejection.detail}"
    return replace(rejection, detail=detail, excess=float(left))


def randomize(
    scene: Scene,
    randomizers: Sequence[Randomizer],
    stage: Stage,
    assets: AssetLibrary,
    streams: Streams,
) -> Scene:
    """Apply the randomizers of a stage.

    Raises:
        ConfigError: there are too many instances, or a draw does not fit the scene.
        LayoutRejected: a randomizer found no place.
    """
    for randomizer in randomizers:
        if randomizer.stage == stage:
            scene = randomizer(scene, assets, streams.rng(f"randomizer/{randomizer.name}"))
    if len(scene.instances) > LABEL_IDS_MAX:
        raise errors.ConfigError(
            f"scene {streams.scene}: {len(scene.instances)} instances, but label images have "
            f"room for {LABEL_IDS_MAX}; place fewer objects"
        )
    return scene
