"""Tests of the programs that draw the pictures of README.md and the theory pages."""

import subprocess
import sys

import kreisel as kr
import numpy as np
import pytest
from toolbox import need

from validation.report import page_picture, section_picture, sweep_picture


def test_the_sweep_picture_resumes_an_existing_sweep(tmp_path):
    spins, tilts = np.linspace(0.0, 8.0, 5), np.linspace(0.1, 1.5, 3)
    sweep = sweep_picture.run_sweep(tmp_path / "runs", spins, tilts)
    assert sweep.dims == ("spin", "tilt") and sweep.shape == (5, 3)
    top = kr.Scene.from_euler(
        sweep_picture.BODY, angles=(0.0, tilts[1], 0.0), rates=(0.0, 0.0, spins[3]), gravity=1
    )
    alone = kr.solve(top, sweep_picture.TIMES, tol=1e-9).nutation.max()
    assert float(sweep[3, 1]) == pytest.approx(alone, rel=1e-9)
    files = {file: file.stat().st_mtime_ns for file in (tmp_path / "runs").iterdir()}
    sweep_picture.draw_sweep(
        sweep_picture.run_sweep(tmp_path / "runs", spins, tilts), tmp_path / "map.png"
    )
    assert all(file.stat().st_mtime_ns == time for file, time in files.items())
    assert (tmp_path / "map.png").stat().st_size > 10_000


def test_the_section_picture_shows_all_tops_at_their_energy(tmp_path):
    sections = section_picture.compute_sections(tops=4, points=5)
    for gravity, cuts in sections.items():
        assert sorted(cuts.top) == sorted([0, 1, 2, 3] * 5), gravity
        assert np.ptp(cuts.energy) < 1e-10, gravity
    section_picture.draw_sections(sections, tmp_path / "section.png")
    assert (tmp_path / "section.png").stat().st_size > 10_000


def test_the_viewer_picture_is_rendered(tmp_path):
    need("chromium", "npm")
    # Runs in a separate process. A process can run only one playwright, and the tests of the viewer
    # may already use it in this process.
    subprocess.run([sys.executable, page_picture.__file__, tmp_path / "page.png"], check=True)
    assert (tmp_path / "page.png").stat().st_size > 50_000
