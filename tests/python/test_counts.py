"""Tests of numbers with their nouns in messages."""

import kreisel as kr
import numpy as np
import pytest
from kreisel._utils.counts import format_count


@pytest.mark.parametrize(
    ("number", "text"), [(0, "0 steps"), (1, "1 step"), (2, "2 steps"), (np.int64(1), "1 step")]
)
def test_one_is_singular(number, text):
    assert format_count(number, "step") == text


def test_paths_with_one_state_and_one_step_are_singular():
    scene = kr.scenes.thesis
    path = kr.solve(scene, [0.01], method="strang", step=0.01)
    assert "1 state," in repr(path) and "1 step>" in repr(path)
    paths = kr.solve(scene.scatter(2, seed=1, momentum=0.1), [0.01], method="strang", step=0.01)
    assert "1 state each" in repr(paths)
