"""The end of every run that finishes a data set: labels that it was to have and lacks."""

import warnings
from typing import TYPE_CHECKING

from gen_data.core import errors, urls

if TYPE_CHECKING:
    from gen_data.runner.progress import Summary


def check_label_gaps(summary: "Summary") -> "Summary":
    """Warn of sensors and classes without labels in a data set that was just finished.

    Data sets at URLs, whose shards would have to be fetched, and unfinished ones are not checked.

    Returns:
        The summary itself.

    Raises:
        NoLabels: no camera and no laser scanner has a label; the data set is finished all the same.

    Warns:
        ConfigWarning: once for each sensor, and each class of the label map, without a label.
    """
    if not summary.dataset_id or urls.is_url(summary.folder):
        return summary
    from gen_data.report.label_gaps import find_label_gaps
    from gen_data.runner.stored import StoredSamples

    gaps = find_label_gaps(StoredSamples(summary.folder))
    for line in gaps.lines():
        warnings.warn(line, errors.ConfigWarning, stacklevel=3)
    if gaps.is_total:
        raise errors.NoLabels(
            f"{summary.folder}: finished, but none of its {summary.samples} samples has a label. "
            "Compare the poses of the sensors with the scene's (gen-data contact-sheet), and the "
            "label map with the categories; without annotations and exporters, images alone are "
            "made on purpose",
            summary,
        )
    return summary
