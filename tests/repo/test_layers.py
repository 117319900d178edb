"""Tests that source files depend only on lower layers, or on files of their layer and folder."""

import pytest
from layers import PLAN, circle, files, layer, layers, targets
from toolbox import ROOT

TREES = sorted(layers())
FILES = [
    pytest.param(tree, file, id=str(file.relative_to(ROOT)))
    for tree in TREES
    for file in files(tree)
]


def test_the_layers_cover_all_trees():
    assert TREES == ["csrc", "python/kreisel", "python/viewer", "tests", "validation"]


@pytest.mark.parametrize(("tree", "file"), FILES)
def test_a_file_uses_only_lower_layers_or_its_own_folder(tree, file):
    own_layer = layer(file, tree)
    assert own_layer is not None, f"{file.name} needs one layer in {PLAN.name}"
    for other in targets(file, tree):
        other_layer = layer(other, tree)
        is_beside = other.parent == file.parent and other_layer == own_layer
        assert is_beside or other_layer < own_layer, (
            f"{file.relative_to(ROOT)} uses {other.relative_to(ROOT)}"
        )


@pytest.mark.parametrize("tree", TREES)
def test_there_are_no_cycles_of_files(tree):
    assert circle({file: targets(file, tree) for file in files(tree)}) == []


def test_architecture_md_is_short():
    assert len(PLAN.read_text().splitlines()) <= 100


def test_cycles_are_detected():
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c"]
    assert circle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


@pytest.mark.parametrize("tree", TREES)
def test_every_name_in_the_layers_exists(tree):
    names = [name for row in layers()[tree] for name in row]
    assert [name for name in names if not (ROOT / tree / name).exists()] == []
