"""Scenes that find no layout: the message names the best attempt and its obstacles."""

import pickle

from gen_data.core.errors import Rejection, SceneRejected


def test_the_best_attempt_is_named_with_its_number_and_objects() -> None:
    """Attempts are counted from one; the smallest excess is best."""
    rejections = (
        Rejection("objects interpenetrate", "fewer objects", "'mug' and 'bowl' overlap by 9 mm", 9),
        Rejection("objects interpenetrate", "fewer objects", "'cup' and 'bowl' overlap by 4 mm", 4),
        Rejection("still moving", "more time"),
    )
    lines = str(SceneRejected(7, rejections)).splitlines()

    assert lines == [
        "scene 7: no valid layout in 3 attempts (2 x objects interpenetrate, 1 x still moving).",
        "  Best: attempt 2: 'cup' and 'bowl' overlap by 4 mm.",
        "  Try: 1. fewer objects 2. more time",
    ]


def test_without_details_there_is_no_best_attempt() -> None:
    """As of plug-ins that give none."""
    text = str(SceneRejected(0, (Rejection("object fell off", "a larger table"),)))

    assert "Best" not in text
    assert str(pickle.loads(pickle.dumps(SceneRejected(0, (Rejection("a", "b", "c", 1.0),)))))
