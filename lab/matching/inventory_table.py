"""Files of a folder that were read, and files that were skipped, by reason, as rows of text."""

from gen_data.lab.matching.real_files import Inventory

KINDS = ("photographs", "scans", "label files")


def inventory_rows(inventory: Inventory) -> tuple[tuple[str, ...], ...]:
    """Kind, numbers found, read and skipped, and a remark; a further row for every reason."""
    rows: list[tuple[str, ...]] = []
    for kind in KINDS:
        found, used = inventory.found[kind], inventory.used[kind]
        reasons = [(why, n) for (of, why), n in inventory.skipped.most_common() if of == kind]
        skipped = sum(n for _, n in reasons)
        remark = inventory.notes.get(kind, "")
        if found > used + skipped:
            remark = f"chosen evenly; {remark}".removesuffix("; ")
        rows.append((kind, str(found), str(used), str(skipped), remark))
        rows += [
            ("", "", "", str(n), f"{why}: {inventory.examples[kind, why]}") for why, n in reasons
        ]
    return tuple(rows)
