"""Tests of the language rules for Python code."""

import pytest
from language import (
    TREES,
    docstrings,
    find_repeated_basenames,
    has_banned_opener,
    is_participle,
    names,
)

FINISHED = ("python/kreisel", "validation", "tests")
OPENERS_MOST = 0.02  # share of docstrings
PARTICIPLES_MOST = 0.01  # share of names


@pytest.mark.parametrize("tree", FINISHED)
def test_few_docstrings_open_without_a_verb_or_noun(tree):
    texts = docstrings(tree)
    found = [place for place, text in texts if has_banned_opener(text)]
    assert len(found) <= OPENERS_MOST * len(texts), found


@pytest.mark.parametrize("tree", FINISHED)
def test_few_names_are_participles(tree):
    entries = names(tree)
    found = [place for place, name in entries if is_participle(name)]
    assert len(found) <= PARTICIPLES_MOST * len(entries), found


@pytest.mark.parametrize("tree", TREES)
def test_file_names_are_unique(tree):
    assert find_repeated_basenames(tree) == {}


def test_openers_and_participles_are_recognized():
    assert has_banned_opener("What the top does.") and has_banned_opener("The same for many.")
    assert not has_banned_opener("Return the state.") and not has_banned_opener("The state.")
    assert is_participle("told") and is_participle("_opened_once") and is_participle("Reduced")
    assert not is_participle("read_part") and not is_participle("seed_tangents")
