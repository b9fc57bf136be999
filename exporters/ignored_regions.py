"""Classes of ignored regions.

Readers compare a region only with detections of its class. A region whose class was left out by the
label map is therefore listed under every class.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import ObjectTruth
from gen_data.core.scene import LABEL_IDS_MAX


def each_class(info: DatasetInfo, objects: Iterable[ObjectTruth]) -> Iterator[ObjectTruth]:
    """Yield objects in order; ignored ones without a class (category id 0) once under each."""
    for thing in objects:
        if thing.instance.category_id:
            yield thing
            continue
        for number, name in enumerate(info.categories, 1):
            instance = replace(thing.instance, category=name, category_id=number)
            yield replace(thing, instance=instance)


def numbered(
    info: DatasetInfo, objects: Sequence[ObjectTruth]
) -> Iterator[tuple[ObjectTruth, int]]:
    """Yield ``each_class`` of objects with numbers unique in the image.

    The number of an object with a class is its instance id.

    Raises:
        ConfigError: there are more regions without a class than numbers.
    """
    last = max((thing.instance.instance_id for thing in objects), default=0)
    free = iter(range(LABEL_IDS_MAX, last, -1))
    for thing in objects:
        for region in each_class(info, [thing]):
            number = thing.instance.instance_id if region is thing else next(free, None)
            if number is None:
                raise ConfigError(
                    f"labels.map.others: 'ignore' makes more than {LABEL_IDS_MAX - last} ignored "
                    "regions in an image; expected `others: drop`, or fewer classes"
                )
            yield region, number
