"""Tests of event constructors such as kreisel.events.cusp."""

import dataclasses
import math

import kreisel as kr
import pytest
from kreisel import events

TOP = kr.scenes.asymmetric


def test_the_tolerance_of_cusps_has_a_lower_bound():
    assert kr.events.cusp(within=1e-7)
    with pytest.raises(ValueError, match="within must be at least 1e-7"):
        kr.events.cusp(within=math.nextafter(1e-7, 0.0))


def test_the_separatrix_without_gravity_is_that_of_the_free_body():
    free = TOP.replace(gravity=0.0)
    assert kr.events.separatrix(free) == kr.events.separatrix(
        TOP.replace(body=kr.Body(TOP.body.mass, TOP.body.inertia, (0, 0, 0)))
    )


def test_a_separatrix_under_gravity_has_its_own_direction():
    for gravity, direction in ((1.0, -1), (-1.0, 1)):
        scene = TOP.replace(gravity=gravity)
        assert kr.events.separatrix(scene).direction == direction
        with pytest.raises(TypeError, match="leave direction out"):
            kr.events.separatrix(scene, direction=1)


def test_an_event_cannot_be_changed():
    event = events.nutation()
    with pytest.raises(dataclasses.FrozenInstanceError):
        event.direction = 1
