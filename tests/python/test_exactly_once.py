"""The way to keep results exactly once that help(kreisel.start) tells, under kills."""

import inspect
import itertools
import textwrap

import kreisel as kr
import numpy as np
import pytest
from toolbox import python

END, CHUNK = 40.0, 100


def example():
    """The last piece of code in the docstring, on a shorter way."""
    told = inspect.getdoc(kr.start)
    code = textwrap.dedent(told[told.index('    file, begun = pathlib.Path("run.kreisel")') :])
    assert "1e6, every=100" in code
    return code.replace("1e6, every=100", f"{END}, every=5, chunk={CHUNK}")


def lives(folder, kill):
    """How often it takes to reach the end where the call of this name kills each run the third time
    it is called, whatever is in the file then."""
    code = f"""
import os, pathlib, kreisel as kr, numpy as np
scene = kr.scenes.asymmetric
calls = []
def dies(call, *words):
    calls.append(call)
    if len(calls) == 3:
        os._exit(9)
    return call(*words)
real = {kill}
def deadly(*words):
    return dies(real, *words)
{kill} = deadly
"""
    for life in itertools.count(1):
        done = python(code + example(), cwd=folder)
        assert done.returncode in (0, 9), done.stderr
        if done.returncode == 0:
            return life
        with open(folder / "states", "ab") as states:  # as of a write cut short
            states.write(b"half a row")


@pytest.mark.parametrize("kill", ["os.fsync", "kr.Run.save"], ids=["kept", "saved"])
def test_each_state_is_kept_once(kill, tmp_path):
    whole = kr.solve(kr.scenes.asymmetric, END, "strang", step=0.01, every=5)
    chunks = -(-len(whole) // CHUNK)
    assert lives(tmp_path, kill) > chunks / 3
    kept = np.fromfile(tmp_path / "states").reshape(-1, 8)
    assert np.array_equal(kept, whole.states)
