"""Tests of the command kreisel sweep."""

import os
import pty
import re
import signal
import subprocess
import sys
import threading
from concurrent.futures import InvalidStateError
from functools import partial

import kreisel as kr
import numpy as np
import pyarrow as pa
import pyarrow.csv as text
import pyarrow.parquet as parquet
import pytest
from cli_helpers import call, join_lines, make_raiser
from distributed import LocalCluster
from kreisel._cli import sweep_command
from sweeps import SOCKETS_LEFT, hash_rows
from toolbox import HANG, HEEDING

PLAN = """
t = [1.0, 4.0]
part_size = 64
max_steps = 14
scene = "asymmetric"
[reduce]
nutation = ["min", "max"]
[grid]
spin = { from = 0, to = 9, n = 12 }
gravity = { from = -1, to = 1, n = 25 }
"""


@pytest.fixture
def plan(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plan.toml").write_text(PLAN)
    return tmp_path


@pytest.fixture
def plan_hash(plan):
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
    assert "part 3 computed again, damaged" in join_lines(call("sweep plan.toml --folder runs"))
    output = call("sweep status runs")
    assert "5 of 5 parts" in output and "missing" not in output and "damaged" not in output
    failures = int((kr.read_sweep("runs")["status"] != 0).sum())
    assert failures > 1 and f"failed: {failures} tops" in output
    assert hash_rows(plan / "runs") == plan_hash
    assert kr.read_sweep("runs").hash == kr.read_sweep("expected").hash


def test_status_lists_the_first_ranges_of_missing_parts(plan):
    small = PLAN.replace("n = 12", "n = 14").replace("n = 25", "n = 1").replace("64", "1")
    (plan / "plan.toml").write_text(small)
    call("sweep plan.toml --folder runs")
    for i in (0, 2, 3, 5, 7, 9, 11):
        (plan / f"runs/part-{i:06}.parquet").unlink()
    ranges = "0:1, 2:4, 5:6, 7:8, 9:10, 11:12"
    assert f"missing: 7 parts, {ranges}\n" in call("sweep status runs")
    (plan / "runs/part-000013.parquet").unlink()
    assert f"missing: 8 parts, {ranges}, ...\n" in call("sweep status runs")


@pytest.mark.filterwarnings(SOCKETS_LEFT)
def test_processes_and_a_cluster_compute_the_parts(plan, plan_hash):
    call("sweep plan.toml --folder processes --workers 2")
    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0"
    ) as cluster:
        call(f"sweep plan.toml --folder cluster --dask {cluster.scheduler_address}")
    for name in ("processes", "cluster"):
        assert hash_rows(plan / name) == plan_hash


@pytest.mark.parametrize(
    ("more", "number"), [([], signal.SIGINT), (["--workers", "2"], signal.SIGTERM)]
)
def test_an_interrupted_sweep_is_reported_and_resumed(plan, more, number):
    (plan / "plan.toml").write_text(PLAN.replace("n = 25", "n = 2500").replace("4.0", "400.0"))
    start = f"{HEEDING}from kreisel._cli import main\nmain()"
    command = [sys.executable, "-c", start, "sweep", "plan.toml", "--folder", "runs", *more]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as run:
        while run.poll() is None and not list(plan.glob("runs/part-*")):
            os.sched_yield()
        run.send_signal(number)
        _, output = run.communicate()
    assert run.returncode == 130, output
    assert (
        "of 469 parts are left; repeating the call resumes the sweep in" in output
        and "Traceback" not in output
    )
    sweep = kr.read_sweep("runs", partial=True).check()
    assert 0 < len(sweep.present) < 469
    call("sweep plan.toml --folder runs --parts 0:2")


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGTERM, 130), (signal.SIGINT, 130), (signal.SIGKILL, -9)]
)
def test_no_worker_outlives_a_sweep_and_no_worker_ends_before_it(plan, number, code):
    (plan / "plan.toml").write_text(PLAN.replace("n = 25", "n = 2500").replace("4.0", "400.0"))
    start = f"{HEEDING}from kreisel._cli import main\nmain()"
    words = ["sweep", "plan.toml", "--folder", "runs", "--workers", "2"]
    with subprocess.Popen(
        [sys.executable, "-c", start, *words],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as run:
        while run.poll() is None and not list(plan.glob("runs/part-*")):
            os.sched_yield()
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


def test_a_terminal_shows_progress_and_the_time_left(plan):
    call("sweep plan.toml --folder runs --parts 0:3")
    terminal, run_side = pty.openpty()
    command = [sys.executable, "-m", "kreisel", "sweep", "plan.toml", "--folder", "runs"]
    with os.fdopen(terminal, "rb", buffering=0) as screen:
        run = subprocess.Popen(command, stderr=run_side, stdout=subprocess.DEVNULL)
        os.close(run_side)
        output = b"".join(iter(partial(read, screen), b"")).decode()
    assert run.wait() == 0
    assert re.search(r"100%\S* \S*0:00:00", output), output


def read(screen):
    """Return the bytes written since the last call, or b"" at the end of the stream."""
    try:
        return screen.read(4096)
    except OSError:
        return b""


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("plan.toml", "Missing option '--folder'"),
        ("none.toml --folder runs", "none.toml"),
        ("plan.toml --folder .", "not a folder of a sweep, and not empty: it contains 'plan.toml'"),
        ("plan.toml --folder runs --parts 3", "'3' is not a range of parts such as 0:100"),
        ("plan.toml --folder runs --parts 4:3", "'4:3' is not a range of parts"),
        ("plan.toml --folder runs --parts 0:9", "--parts must lie between 0 and 5, not 0 to 9"),
        ("plan.toml --folder runs --workers 0", "--workers"),
        ("plan.toml --folder runs --workers 1 --dask x", "either --workers or --dask"),
        ("wrong.toml --folder runs", "unknown key in a plan: 'tt'; did you mean 't'?"),
        ("status none", "there is no folder"),
        ("status .", "not a folder of a sweep: it has no plan.json"),
    ],
)
def test_errors_are_reported_before_anything_runs(plan, line, message):
    (plan / "wrong.toml").write_text("tt = 1")
    output = call(f"sweep {line}", code=2)
    assert message in join_lines(output) and "Traceback" not in output
    assert output.count("\n") == 1
    assert not (plan / "runs").exists()


def test_status_of_a_sweep_without_failures_counts_none(plan):
    (plan / "plan.toml").write_text(PLAN.replace("max_steps = 14", "max_steps = 0"))
    call("sweep plan.toml --folder runs --parts 0:1")
    told = call("sweep status runs")
    assert "1 of 5 parts" in told and "failed" not in told


@pytest.mark.parametrize("words", ["plan.toml --folder runs", "status old"])
def test_a_missing_pyarrow_is_reported_in_one_line(plan, monkeypatch, words):
    call("sweep plan.toml --folder old --parts 0:0")
    for name in [name for name in sys.modules if name.startswith("pyarrow")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, "kreisel._sweep.parquet", raising=False)
    monkeypatch.delattr("kreisel._sweep.parquet", raising=False)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    output = call(f"sweep {words}", code=1)
    assert output.startswith("Error: this needs pyarrow") and output.count("\n") == 1
    assert not (plan / "runs").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="file names need not be UTF-8 on Linux only")
def test_a_folder_whose_name_is_not_utf_8_is_written_and_read(plan):
    folder = os.fsdecode(b"lat\xfcn")
    os.mkdir(folder)
    for options in ([], ["--workers", "1"]):
        call(f"sweep plan.toml --folder {folder}/runs", *options)
        output = call(f"sweep status {folder}/runs")
        assert "5 of 5 parts" in output and "failed: " in output
    result = kr.read_sweep(f"{folder}/runs")
    assert result["spin"].shape == (12, 25)
    for ending in ("parquet", "csv"):
        starts = os.path.join(folder, f"starts.{ending}")
        write = parquet.write_table if ending == "parquet" else text.write_csv
        with open(starts, "wb") as file:
            write(pa.table({"spin": [1.0, 2.0]}), file)
        tops = kr.Source.columns(kr.scenes.asymmetric, starts)
        assert tops[0:2].coords["spin"].tolist() == [1.0, 2.0]


def test_an_error_of_a_worker_takes_one_line(plan, monkeypatch):
    monkeypatch.setattr(sweep_command, "run_sweep", make_raiser(RuntimeError("part 3 failed")))
    assert call("sweep plan.toml --folder runs", code=1) == "Error: part 3 failed\n"


@pytest.mark.parametrize("error, is_shown", [(ValueError("x"), True), (InvalidStateError(), False)])
def test_cancelled_tasks_of_a_pool_are_not_reported(capsys, error, is_shown):
    sweep_command.report_thread_exception(
        threading.ExceptHookArgs((type(error), error, None, None))
    )
    shown = capsys.readouterr().err
    assert shown.endswith("ValueError: x\n") if is_shown else shown == ""


def test_another_plan_is_refused_with_the_differences(plan):
    call("sweep plan.toml --folder runs --parts 0:1")
    (plan / "plan.toml").write_text(PLAN.replace("64", "32"))
    output = call("sweep plan.toml --folder runs", code=2)
    assert "is of another plan" in output and "part_size: 64 there, 32 here" in output
    assert len(list(plan.glob("runs/part-*"))) == 1


def test_help_describes_run_and_status():
    assert "status" in call("sweep --help") and "--dask" in call("sweep run --help")
    assert "sweep" in call("--help")
