"""Move a top by the C library through ctypes, without the Python package kreisel.

python ctypes_top.py [LIBRARY]      libkreisel.so of the system by default
"""

import ctypes
import ctypes.util
import math
import sys
from ctypes import POINTER, byref, c_char_p, c_double, c_int, c_int64, c_uint64, c_void_p


def structure(name, **members):
    """Return a structure of C with these members."""
    return type(name, (ctypes.Structure,), {"_fields_": list(members.items())})


Vec3 = structure("Vec3", x=c_double, y=c_double, z=c_double)
Quat = structure("Quat", w=c_double, x=c_double, y=c_double, z=c_double)
Given = structure("Given", inertia=9 * c_double, com=Vec3, rotor=Vec3)
Body = structure(
    "Body",
    mass=c_double,
    inertia=Vec3,
    com=Vec3,
    axes=Quat,
    rounded=c_double,
    rotor=Vec3,
    given=Given,
)
State = structure("State", t=c_double, q=Quat, m=Vec3)
Shaking = structure("Shaking", amplitude=c_double, rate=c_double, phase=c_double)
Wheel = structure("Wheel", axis=Vec3, rate=c_double)
Scene = structure(
    "Scene",
    body=Body,
    gravity=c_double,
    start=State,
    damping=Vec3,
    turning=Vec3,
    shaking=Shaking,
    friction=c_double,
    wheels=3 * Wheel,
    gradient=c_double,
)
Config = structure(
    "Config",
    step=c_double,
    tol=c_double,
    max_steps=c_int64,
    poll=c_void_p,  # None: no callback
    context=c_void_p,
    digits=c_int,
    skip_heading=c_int,
    tangents=c_uint64,
)


def load_library(path):
    """Return the library, with the types of the functions that this program calls."""
    library = ctypes.CDLL(path)
    types = {
        "kr_status_text": (c_char_p, [c_int]),
        "kr_body_symmetric": (c_int, [*4 * [c_double], POINTER(Body)]),
        "kr_method_find": (c_void_p, [c_char_p]),
        "kr_top_create": (c_int, [POINTER(Scene), c_void_p, Config, POINTER(c_void_p)]),
        "kr_top_advance": (c_int, [c_void_p, c_double]),
        "kr_top_state": (State, [c_void_p]),
        "kr_top_free": (None, [c_void_p]),
        "kr_state_nutation": (c_double, [POINTER(Scene), POINTER(State)]),
    }
    for name, (result, arguments) in types.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


def main(path):
    kreisel = load_library(path)

    def check(status):
        if status:
            raise RuntimeError(kreisel.kr_status_text(status).decode())

    tilt, momentum = math.radians(60), 314.159 * 6.25e-4  # spin times moment, in SI units
    scene = Scene(gravity=9.81)
    check(kreisel.kr_body_symmetric(0.5, 7.5125e-3, 6.25e-4, 0.12, byref(scene.body)))
    scene.start.q = Quat(math.cos(tilt / 2), math.sin(tilt / 2), 0, 0)
    scene.start.m = Vec3(0, -momentum * math.sin(tilt), momentum * math.cos(tilt))

    top = c_void_p()
    method = kreisel.kr_method_find(b"taylor")
    check(kreisel.kr_top_create(byref(scene), method, Config(), byref(top)))
    try:
        check(kreisel.kr_top_advance(top, 1.0))
        state = kreisel.kr_top_state(top)
        print(f"t = {state.t}: tilt {kreisel.kr_state_nutation(byref(scene), byref(state)):.9f}")
        check(kreisel.kr_top_advance(top, 0.5))
    except RuntimeError as error:
        print("refused:", error)
    finally:
        kreisel.kr_top_free(top)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else ctypes.util.find_library("kreisel"))
