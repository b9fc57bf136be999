"""Machines that compute differently take no part in a data set, unless that is accepted."""

import json
from collections.abc import Mapping
from pathlib import Path

import pytest

from gen_data.core.errors import NumericsError
from gen_data.runner.numerics_guard import admit_numerics
from gen_data.runner.shard import Job
from gen_data.runner.store import LocalStore
from gen_data.runner.supervisor import Supervisor
from gen_data.runner.worker_events import Assign, Failed, Note, Ready
from tests.runner.doubles import FakeFactory, FakePipeline, Trouble, fake_plan


class Machine(FakePipeline):
    def __init__(self, kind: str) -> None:
        super().__init__(10, Trouble())
        object.__setattr__(self, "kind", kind)

    def numerics(self) -> Mapping[str, str]:
        return {"draws": "equal", "render": self.kind}  # type: ignore[attr-defined]


def make_job(out: Path, allow: bool = False) -> Job:
    store = LocalStore(out)
    if not out.exists():
        with store.locked():
            store.prepare(fake_plan())
    return Job(fake_plan(), store, FakeFactory(10), allow_mixed_numerics=allow)


def test_a_machine_that_computes_differently_is_refused_by_name_or_recorded(tmp_path: Path) -> None:
    """The message names the difference and the remedy; equal machines are admitted."""
    job = make_job(tmp_path / "out")
    admit_numerics(job, Machine("cpu"))
    admit_numerics(job, Machine("cpu"))
    with pytest.raises(NumericsError, match=r"(?s)\(render\): processor was .*--allow-mixed"):
        admit_numerics(job, Machine("gpu"))
    # Once accepted, the second kind of machine is known.
    admit_numerics(make_job(tmp_path / "out", allow=True), Machine("gpu"))
    admit_numerics(make_job(tmp_path / "out"), Machine("gpu"))
    lines = (tmp_path / "out/run/numerics.json").read_text().splitlines()
    assert [json.loads(line)["digests"]["render"] for line in lines] == ["cpu", "gpu"]


def test_the_run_goes_on_without_a_worker_that_computes_differently() -> None:
    """Its shards go to the others; the last one standing ends the run."""
    supervisor = Supervisor(range(4), lambda s: range(s, s + 1), 2, str)
    supervisor.start(0.0)
    error = NumericsError("this machine computes differently")
    supervisor.handle(Ready(0), 0.0)
    actions = supervisor.handle(Failed(1, error), 0.0)
    assert [type(action) for action in actions] == [Note]
    assert "takes no work" in actions[0].text  # type: ignore[union-attr]
    assert supervisor.error is None
    supervisor.handle(Failed(0, error), 0.0)
    assert supervisor.error is error
    assert not any(isinstance(action, Assign) for action in actions)
