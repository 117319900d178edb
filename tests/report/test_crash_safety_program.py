"""Tests that killed writers leave intact files, and that a partly written file is detected."""

import random

import pytest

from validation.mutation import crash_safety

KINDS = ["run", "path", "table", "scene", "page", "part"]


@pytest.fixture(scope="module")
def writers(tmp_path_factory):
    folder = tmp_path_factory.mktemp("killed")
    return {
        name: (folder / file, ways)
        for name, (file, ways) in crash_safety.make_writers(folder).items()
    }


def test_every_writer_is_tested(writers):
    assert list(writers) == KINDS


@pytest.mark.parametrize("kind", KINDS)
def test_a_killed_writer_leaves_the_old_file_or_a_new_one(writers, kind):
    found = crash_safety.count_outcomes(*writers[kind], 8, random.Random(kind))
    assert found[crash_safety.OLD] + found[crash_safety.WHOLE] == 8
    assert not found[crash_safety.TORN] + found[crash_safety.STRANGE] + found[crash_safety.ENDED]


def test_files_written_in_place_are_detected_as_torn(tmp_path):
    ways = [lambda file, n=n: file.write_bytes(b"x" * n) for n in (1 << 24, (1 << 24) + 1)]
    chance = random.Random(1)
    tries = (crash_safety.count_outcomes(tmp_path / "file", ways, 12, chance) for _ in range(50))
    assert any(found[crash_safety.TORN] for found in tries)
