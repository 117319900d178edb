"""Tests of the options of kreisel.solve."""

import math

import kreisel as kr
import pytest
from kreisel._options import solve_options, times

TOP = kr.scenes.asymmetric


def test_a_tolerance_is_below_one():
    tol = math.nextafter(1.0, 0.0)
    assert solve_options.validate_tol(kr.methods["taylor"], tol) == tol
    with pytest.raises(ValueError, match=r"tol must be below 1, .* not 1\.0"):
        solve_options.validate_tol(kr.methods["taylor"], 1.0)
    assert solve_options.validate_tol(kr.methods["exact"], 0.5) is None
    assert solve_options.validate_step(kr.methods["exact"], 0.5) is None


def test_equal_options_are_one_object():
    one, other = (
        solve_options.validate_solve_options(TOP, "strang", step=0.1, want=("energy",))
        for _ in range(2)
    )
    assert one is other
    assert solve_options.validate_solve_options(TOP, "strang", step=1).step == 1.0
    assert type(solve_options.validate_solve_options(TOP, "strang", step=1).step) is float
    assert one.get_signed_step(True) == -0.1 and one.get_signed_step(False) == 0.1
    assert solve_options.validate_solve_options(TOP, "taylor").get_signed_step(True) is None
    assert (
        one.max_time_with_exact_step_count == 2.0**52 * 0.1
        and solve_options.validate_solve_options(TOP, "taylor").max_time_with_exact_step_count
        == math.inf
    )
    assert (
        solve_options.validate_solve_options(TOP, "taylor").chunk_size
        > one.chunk_size
        == times.CHUNK_SIZE
    )
    assert (
        solve_options.validate_solve_options(TOP, "taylor", want=("q", "energy")).bytes_per_state
        == 40
    )
    assert solve_options.validate_solve_options(TOP, "taylor").bytes_per_state == 64


def test_the_heading_is_omitted_if_nothing_needs_it():
    def leaves_heading(method="taylor", **more):
        return solve_options.validate_solve_options(TOP, method, **more).can_skip_heading_angle

    assert leaves_heading(want=("energy",)) and leaves_heading(want=("nutation", "energy"))
    assert (
        not leaves_heading()
        and not leaves_heading(want=("energy", "apex"))
        and not leaves_heading(want=("energy",), digits=17)
    )
    assert leaves_heading(want=("energy",), digits=16) and not leaves_heading(
        "strang", want=("energy",), step=0.1
    )
    watched = kr.start(TOP, want=["energy"], events=kr.events.nutation())
    assert not watched._options.can_skip_heading_angle
