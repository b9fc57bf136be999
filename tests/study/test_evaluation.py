"""Average precision is COCO's; misses and false alarms are those of COCO's matching."""

import contextlib
import io
from pathlib import Path

import numpy as np
import pytest
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from gen_data.core.errors import ConfigError
from gen_data.lab.study.evaluation import evaluate, match_objects, read_results
from gen_data.lab.study.real_pictures import RealSet, read_real
from tests.study.conftest import draw_results, write_coco


def official_stats(real: RealSet, rows: list[dict[str, object]]) -> list[float]:
    """The twelve figures that COCO's own evaluation prints."""
    with contextlib.redirect_stdout(io.StringIO()):
        truth = COCO()
        truth.dataset = real.to_coco()
        truth.createIndex()
        judged = COCOeval(truth, truth.loadRes(rows), "bbox")
        judged.evaluate()
        judged.accumulate()
        judged.summarize()
    return [float(value) for value in judged.stats]


def test_ap_and_ap50_are_cocos_figures_also_of_resampled_pictures(drawn_set: RealSet) -> None:
    """Over all areas, with at most 100 detections per picture."""
    rows = draw_results(drawn_set, 1)
    found = evaluate(drawn_set, rows).summary()
    assert found == pytest.approx(official_stats(drawn_set, rows)[:2], abs=1e-12)
    assert 0.1 < found[0] < 0.9
    # All pictures twice give the same; some pictures give what they give alone.
    rows = draw_results(drawn_set, 2)
    evaluation = evaluate(drawn_set, rows)
    some = np.array([3, 4, 8, 9, 17])
    alone = evaluate(drawn_set, rows, [drawn_set.pictures[k] for k in some])
    twice = evaluation.summary(np.repeat(np.arange(30), 2))
    assert twice == pytest.approx(evaluation.summary(), abs=1e-12)
    assert evaluation.summary(some) == pytest.approx(alone.summary(), abs=1e-12)
    # The truth itself, and an empty list.
    perfect = [
        {
            "image_id": picture.image_id,
            "category_id": drawn_set.category_ids[thing.name],
            "bbox": [x0, y0, x1 - x0, y1 - y0],
            "score": 0.9,
        }
        for picture in drawn_set.pictures
        for thing in picture.objects
        for x0, y0, x1, y1 in [thing.box]
        if not thing.is_ignored
    ]
    assert evaluate(drawn_set, perfect).summary() == pytest.approx([1.0, 1.0])
    assert evaluate(drawn_set, []).summary().tolist() == [0.0, 0.0]


@pytest.mark.slow
def test_objects_are_found_missed_or_ignored(tmp_path: Path) -> None:
    """A hit, a miss, a crowd, a false alarm; detections below the best F1 do not count."""
    write_coco(
        tmp_path,
        [
            [{"bbox": [5, 5, 20, 20]}, {"bbox": [40, 5, 20, 20]}],
            [{"bbox": [0, 0, 30, 30], "iscrowd": 1}, {"bbox": [34, 10, 20, 20]}],
        ],
    )
    real = read_real(tmp_path)

    def row(image_id: int, box: list[float], score: float) -> dict[str, object]:
        return {"image_id": image_id, "category_id": 7, "bbox": box, "score": score}

    rows = [
        *(row(10, [5, 5, 20, 20], 0.9), row(11, [34, 10, 20, 20], 0.7)),  # hits
        row(10, [0, 30, 9, 9], 0.8),  # false alarm
        row(11, [2, 2, 10, 10], 0.6),  # inside the crowd
        *(row(k, [50, 40, 5, 5], 0.1) for k in (10, 11)),  # false alarms below the best F1
    ]

    matches, least = match_objects(evaluate(real, rows))

    assert least == 0.7
    found = sorted((m.picture, m.thing is None, m.box is None) for m in matches)
    assert found == [(0, False, False), (0, False, True), (0, True, False), (1, False, False)]


ROW = '[{"image_id": %s, "category_id": 7, "bbox": %s, "score": %s}]'
OTHER = "has results of another data set: none of its image_id values, such as 500, is in "


@pytest.mark.parametrize(
    ("text", "fact"),
    [(ROW % (500, "[0, 0, 4, 4]", 0.5), f": {OTHER}.*/annotations/instances_val.json$"),
     *((text, "expected a list of") for text in ("", "{}", "[1]", '[{"image_id": 10}]')),
     *((text, "expected a list of") for text in ('[{"bbox": "x"}]', ROW % (10, "[0, 0, 4]", 1))),
     (ROW % (10, "[0, 0, 4, NaN]", "0.5"), "expected a list of"),
     (ROW % (10, "[0, 0, 4, 4]", "NaN"), "expected a list of")],
)  # fmt: skip
def test_files_without_results_of_them_are_refused(text: str, fact: str, tmp_path: Path) -> None:
    """With the expected form, or an example of other ids."""
    write_coco(tmp_path, [[{"bbox": [5, 5, 20, 20]}]])
    path = tmp_path / "results.json"
    path.write_text(text)
    with pytest.raises(ConfigError, match=f"^{path}.*{fact}"):
        read_results(path, read_real(tmp_path))
