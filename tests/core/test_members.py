"""Members of object groups: names, instance ids, labels."""

from gen_data.core.members import Member, add_members, free_instance_ids, remove_members
from gen_data.core.scene import Instance, ObjectGroup, Scene
from gen_data.core.se3 import SE3
from tests.randomizers.doubles import FakeAssets

GROUP = ObjectGroup("things", (), ("brick", "bottle"), 0, "drop", annotated=False)
MEMBERS = (Member("brick", SE3((1.0, 0.0, 0.0)), 2.0), Member("bottle", SE3(), collides=False))


def scene_with_ids(*ids: int) -> Scene:
    """A scene whose instances have these ids and no body."""
    return Scene("test", instances=tuple(Instance(k, f"thing{k}", "c", 0, "a") for k in ids))


def test_free_ids_are_the_smallest_positive_numbers_that_nothing_has() -> None:
    assert free_instance_ids(scene_with_ids(), 2) == [1, 2]
    assert free_instance_ids(scene_with_ids(1, 3, 6), 4) == [2, 4, 5, 7]
    assert free_instance_ids(scene_with_ids(1), 0) == []


def test_every_member_becomes_a_body_and_the_instance_that_labels_it() -> None:
    """Numbered within the group; the category is the asset's, the labels are the group's."""
    scene = add_members(scene_with_ids(2), GROUP, MEMBERS, FakeAssets(), first=5)

    assert [(b.name, b.asset, b.scale, b.collides, b.group) for b in scene.bodies] == [
        ("things/5", "brick", 2.0, True, "things"),
        ("things/6", "bottle", 1.0, False, "things"),
    ]
    assert [b.instance_id for b in scene.bodies] == [1, 3]
    assert [(i.instance_id, i.name, i.category, i.annotated) for i in scene.instances[1:]] == [
        (1, "things/5", "brick", False),
        (3, "things/6", "bottle", False),
    ]


def test_members_leave_with_their_instances_and_nothing_else_does() -> None:
    before = scene_with_ids(1, 2)

    assert remove_members(add_members(before, GROUP, MEMBERS, FakeAssets()), "things") == before
