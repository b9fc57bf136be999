"""Classes of ignored regions.

Readers compare a region with the detections of its own class only. A region whose class was left
out by the label map is therefore listed under every class.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from gen_data.generator.core.interfaces import DatasetInfo
from gen_data.generator.core.sample import ObjectTruth


def each_class(info: DatasetInfo, objects: Iterable[ObjectTruth]) -> Iterator[ObjectTruth]:
    """Yield objects in order; ignored ones without a class (category id 0) once under each."""
    for thing in objects:
        if thing.instance.category_id:
            yield thing
            continue
        for number, name in enumerate(info.categories, 1):
            instance = replace(thing.instance, category=name, category_id=number)
            yield replace(thing, instance=instance)
