"""The scheduler of parallel runs, and whether it is still needed."""

import inspect
from collections import OrderedDict

import xdist.remote
from schedule import LONG, MARK, RAYS, REAL_TIME, TRACING, OneHand
from xdist.scheduler import LoadScopeScheduling


def test_xdist_still_names_groups_where_pytest_does_not_look(request):
    """When this fails, `--dist loadgroup` works again: drop schedule.py, as its first lines say, and this file."""
    assert "item._nodeid = " in inspect.getsource(xdist.remote)
    name = request.node.nodeid
    request.node._nodeid = f"{name}@group"  # what xdist does for a marked test
    assert request.node.nodeid == name


def test_a_file_is_a_scope_and_so_is_all_that_is_in_real_time_or_traces_rays(tmp_path):
    plain, marked, tracing = (tmp_path / f"test_{name}.py" for name in ("plain", "marked", "tracing"))
    plain.write_text("def test_one(): ...")
    marked.write_text(f"pytestmark = {MARK}")
    tracing.write_text(f"{TRACING[0]}.tracer import trace")
    scopes = [OneHand._split_scope(None, f"{path}::test_one[a::b]") for path in (plain, marked, tracing)]
    assert scopes == [str(plain), REAL_TIME, RAYS]


def test_real_time_is_sent_first_then_rays_and_long_files_before_others(tmp_path, monkeypatch):
    """Else the files of the most tests: what takes longest is often one test alone."""
    plain, long = (tmp_path / f"test_{name}.py" for name in ("plain", "long"))
    plain.write_text("def test_one(): ...")
    long.write_text(f"@{LONG}\ndef test_one(): ...")
    sent, queue = [], OneHand.__new__(OneHand)
    queue.workqueue = OrderedDict.fromkeys([str(plain), str(long), RAYS, REAL_TIME])
    monkeypatch.setattr(
        LoadScopeScheduling, "_assign_work_unit", lambda self, node: sent.append(self.workqueue.popitem(last=False)[0])
    )
    while queue.workqueue:
        queue._assign_work_unit(None)
    assert sent == [REAL_TIME, RAYS, str(long), str(plain)]
