"""The command kreisel sweep: plans, status, workers and signals."""

import os
import signal
import subprocess
from contextlib import suppress

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import PLAN, call, join_lines, make_raiser, start_process
from sweeps import SOCKETS_LEFT, hash_rows
from toolbox import HANG

LONG_PLAN = PLAN.replace("n = 25", "n = 2500").replace("4.0", "400.0")


@pytest.fixture
def plan(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plan.toml").write_text(PLAN)
    return tmp_path


@pytest.fixture
def plan_hash(plan):
    """Return the hash of the rows that kr.sweep computes."""
    tops = kr.Source.grid(
        kr.scenes.asymmetric, spin=np.linspace(0, 9, 12), gravity=np.linspace(-1, 1, 25)
    )
    words = {"reduce": {"nutation": ["min", "max"]}, "max_steps": 14, "part_size": 64}
    kr.sweep(tops, [1, 4], folder=plan / "expected", **words)
    return hash_rows(plan / "expected")


@pytest.mark.filterwarnings("default")  # a warning must appear as a line of the output
def test_a_plan_runs_and_status_reports_its_parts(plan, plan_hash):
    output = call("sweep plan.toml --folder runs --parts 0:0")
    assert "runs: 0 of 5 parts, 300 tops in all, 0 MB; plan " in output
    call("sweep plan.toml --folder runs --parts 3:5")
    call("sweep run plan.toml --folder runs --parts 1:2")
    output = call("sweep status runs")
    assert "3 of 5 parts" in output and "missing: 2 parts, 0:1, 2:3" in output
    (plan / "runs/part-000003.parquet").write_bytes(b"")
    (plan / "runs/.0123456789abcdef.new").write_bytes(b"x")
    output = call("sweep status runs")
    assert "damaged: 1 part, 3:4" in output and "also 1 file .*.new" in output
    told = join_lines(call("sweep plan.toml --folder runs"))
    assert "Warning: " in told and "part 3 computed again, damaged" in told
    size = sum(file.stat().st_size for file in (plan / "runs").glob("part-*"))
    output = call("sweep status runs")
    assert f"5 of 5 parts, 300 tops in all, {1e-6 * size:.3g} MB" in output
    assert "missing" not in output and "damaged" not in output
    failures = int((kr.read_sweep("runs")["status"] != "OK").sum())
    assert failures > 1 and f"failed: {failures} tops" in output
    assert hash_rows(plan / "runs") == plan_hash
    assert kr.read_sweep("runs").hash == kr.read_sweep("expected").hash
    assert kr.read_sweep("runs").hash[:16] in output


@pytest.mark.filterwarnings(SOCKETS_LEFT)
def test_processes_and_a_cluster_compute_the_parts(plan, plan_hash):
    call("sweep plan.toml --folder processes --workers 2")
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0"
    ) as cluster:
        call(f"sweep plan.toml --folder cluster --dask {cluster.scheduler_address}")
    for name in ("processes", "cluster"):
        assert hash_rows(plan / name) == plan_hash


@pytest.mark.parametrize(
    ("more", "number", "code"),
    [
        ("", signal.SIGINT, 130),
        ("--workers 2", signal.SIGTERM, 130),
        ("--workers 2", signal.SIGKILL, -9),
    ],
)
def test_a_stopped_sweep_leaves_no_worker_and_can_be_resumed(plan, more, number, code):
    (plan / "plan.toml").write_text(LONG_PLAN)
    with start_process(f"sweep plan.toml --folder runs {more}", start_new_session=True) as run:
        while run.poll() is None and not list(plan.glob("runs/part-*")):
            with suppress(subprocess.TimeoutExpired):
                run.wait(0.02)
        if number == signal.SIGKILL:
            run.kill()
        else:
            os.killpg(run.pid, number)  # as terminals and batch systems do
        try:
            _, output = run.communicate(timeout=HANG)  # until all workers have closed the pipe
        except subprocess.TimeoutExpired:
            os.killpg(run.pid, signal.SIGKILL)
            raise
    assert run.returncode == code, output
    if code == 130:
        assert "of 469 parts are left" in output and output.count("\n") == 1
    assert 0 < len(kr.read_sweep("runs", partial=True).check().present) < 469
    call("sweep plan.toml --folder runs --parts 0:2")


def test_an_error_of_a_worker_takes_one_line(plan, monkeypatch):
    monkeypatch.setattr("pyarrow.parquet.ParquetWriter", make_raiser(RuntimeError("part 3 failed")))
    assert call("sweep plan.toml --folder runs", code=1) == "Error: part 3 failed\n"


def test_another_plan_is_refused_with_the_differences(plan):
    call("sweep plan.toml --folder runs --parts 0:1")
    (plan / "plan.toml").write_text(PLAN.replace("64", "32"))
    output = call("sweep plan.toml --folder runs", code=2)
    assert "is of another plan" in output and "part_size: 64 there, 32 here" in output
    assert len(list(plan.glob("runs/part-*"))) == 1
