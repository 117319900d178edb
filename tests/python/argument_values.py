"""Valid and invalid values for the parameters of the public API."""

import fractions
import itertools

import kreisel as kr
import numpy as np
import pandas
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy
from tops import CORNER, FREE, GENERAL, LAGRANGE, TILT

TOP = kr.scenes.asymmetric
DAMPED = LAGRANGE.replace(damping=(0.1, 0.2, 0.3))
MADE_UP = kr.Body(1, (1, 1, 0.5), (0, 0, 3), unphysical=True)
PLATE = kr.Body(1, (1, 2, 3), (0, 0, 0))
MOVED = GENERAL.replace(turning=(0.1, 0.2, 0.3), shaking=(0.1, 5.0, 0.3), friction=0.1)
SCENES = [TOP, LAGRANGE, GENERAL, FREE, DAMPED, MOVED, kr.Scene(MADE_UP, (0, 0, 0), gravity=-1)]
BODIES = [
    kr.Bodies.symmetric(1, i1=[2, 3], i3=1, height=0.5),
    kr.Bodies.cuboid(half=[[(1, 1, 1)], [(1, 2, 3)]], pivot=(0.1, 0.2, 0)),
    kr.Bodies(1, (2, 2, 1), (0, 0, 0.5)),
]
ENSEMBLES = [
    LAGRANGE.vary(spin=[[1.0], [2.0]], tilt=[0.0, 0.5, 1.0]),
    kr.Ensemble(BODIES[0], momentum=np.ones((3, 1, 3)), damping=0.1, gravity=1),
    kr.Ensemble.of([TOP, FREE]),
    kr.Ensemble(TOP.body, momentum=np.empty((0, 3)), gravity=1),
    TOP.vary(gravity=2.0),
]
LOW = kr.events.nutation(direction=1)
WANTED = kr.solve(TOP, [0.0, 0.5], want=("energy", "apex"))
PATHS = [
    kr.solve(TOP, [0.0, 1.0, 2.0]),
    kr.solve(LAGRANGE, 1, "strang", step=0.125, every=2),
    kr.solve(TOP, 5, events=[LOW]),
    WANTED,
    kr.solve(TOP, []),
    kr.solve(FREE, -1, digits=20),
    kr.exact(LAGRANGE, map="bobenko_suris", step=0.1)([0, 1]),
    kr.solve(DAMPED, 1),
    kr.solve(TOP, [0.0, 1.0], tangents=("start", "gravity")),
]
MANY = [
    kr.solve(ENSEMBLES[0], [0.0, 1.0]),
    kr.solve(ENSEMBLES[2], [0.5, 1.0], want=("energy", "apex")),
    kr.solve(ENSEMBLES[2], [4.0, 5.0], events=[LOW]),
    kr.solve(ENSEMBLES[2], [4.0, 5.0], "taylor", max_steps=3),
    kr.solve(ENSEMBLES[3], 1.0),
    kr.solve(ENSEMBLES[0], [0.0, 1.0], tangents="start"),
]
SECTIONS = [kr.section(ENSEMBLES[i], LOW, 2, max_wait=20) for i in (0, 2, 3, 4)]
SWAY = kr.solve(LAGRANGE, np.linspace(0, 50, 101))
KEEPING = {"nutation": ("min", "max"), "apex": "where_max", "m_x": ["mean", "variance"]}
REDUCED = [kr.reduce(tops, [0.5, 1.0], KEEPING) for tops in ENSEMBLES]
SOURCES = [
    kr.Source.grid(LAGRANGE, spin=[1.0, 2.0, 3.0], tilt=[0.0, 0.5]),
    kr.Source.random(TOP, 5, seed=1, gravity=(0.5, 1)),
    kr.Source.scatter(TOP, 5, attitude=0.1),
    *(kr.Source.of(tops) for tops in ENSEMBLES if tops.size),
]
RECORDS = [
    kr.Record(SWAY.t[:12], {"body_velocity": SWAY.body_velocity[:12]}, 0.01, free="bias"),
    kr.Record(SWAY.t[:12], {"q": SWAY.q[:12], "nutation": SWAY.nutation[:12]}, 0.1),
]
FITS = [
    kr.fit(LAGRANGE, RECORDS[0]),
    kr.fit(LAGRANGE, RECORDS[1], ("start", "lever"), loss="soft"),
    kr.fit(LAGRANGE, RECORDS[1], ("start", "moments"), pieces=2),
]
TABLE = pandas.DataFrame({"t": [0.0, 0.1], "spin": [1.0, 2.0]})
MOST = 300  # number of steps after which a run ends
CHECKPOINT = kr.start(TOP, max_steps=MOST).checkpoint
TOML = TOP.to_toml()
FLAGS = [True, False, np.True_]
COUNTS = [1, 2, np.int64(3)]
SIZES = [1, 0.5, np.float32(2)]
VECTORS = [(0, 0, 1), [1.0, -2.0, 0.5], np.array([0.1, 0.2, 0.3], np.float32)]
INERTIAS = [(1, 2, 2.5), np.diag([3, 2, 4])]
ATTITUDES = [(1, 0, 0, 0), TILT, np.array(TILT)]
TIMES = [0.5, [0.0, 0.25, 0.5], np.array([0.5, 1]), -0.5, 0, []]
FUNCTIONS = ["apex_z", {"m_x": 2.0, "apex_z*apex_z": 1, "1": -0.5}]
FILES = ["top.npz", "top.toml", "top.run", "top.csv", "top.html", "new"]

RIGHT = {
    **dict.fromkeys(["attitude", "attitude_xyzw", "q", "a", "b"], ATTITUDES),
    **dict.fromkeys(
        ["com", "pivot", "by", "normal", "v", "point", "momentum", "velocity", "impulse"], VECTORS
    ),
    **dict.fromkeys(["body_momentum", "body_velocity", "angles", "rates"], VECTORS),
    **dict.fromkeys(["inertia", "inertia_about_com"], INERTIAS),
    **dict.fromkeys(["mass", "radius", "height", "density", "length", "i1", "i3"], SIZES),
    **dict.fromkeys(["inner", "outer", "gravity", "spin", "tilt", "precession"], SIZES),
    **dict.fromkeys(["energy", "vertical", "speed", "within", "offset", "nutation"], SIZES),
    **dict.fromkeys(["thickness", "elevation", "azimuth"], SIZES),
    **dict.fromkeys(["unphysical", "shell", "degrees", "steady", "fast", "unwrap"], FLAGS),
    **dict.fromkeys(["back", "open", "terminal"], FLAGS),
    **dict.fromkeys(
        ["n", "every", "max_count", "i", "k", "which", "chunk", "fps", "repeats"], COUNTS
    ),
    **dict.fromkeys(["function", "where"], FUNCTIONS),
    **dict.fromkeys(["file", "source", "path"], FILES),
    "t": TIMES,
    "inertia_rtol": [0.0, 1e-3],
    "keep": ["momentum", "velocity"],
    "damping": [0.1, (0.1, 0.2, 0.3)],
    "rotor": [(0.0, 0.0, 0.5), (0.1, -0.2, 0.3)],
    "turning": [(0.0, 0.0, 0.5), (0.1, -0.2, 0.3)],
    "shaking": [(0.1, 5.0, 0.3), (0.0, 0.0, 0.0)],
    "friction": [0.1, 0],
    "axis": [(0.0, 0.0, 1.0), (1.0, -2.0, 0.5)],
    "body": [TOP.body, LAGRANGE.body, CORNER, MADE_UP, PLATE],
    "scene": SCENES,
    "what": [*SCENES, PATHS[1]],
    "method": ["auto", "strang", "taylor", "rk4", "exact", "extrap", "geometric", *kr.methods],
    "methods": ["strang", ["rk4", "taylor"], None],
    "step": [0.125, 0.01],
    "steps": [[0.1], (0.125, 0.25)],
    "tol": [1e-6, 1e-12],
    "tols": [[1e-6], (1e-3, 1e-6)],
    "digits": [16, 20, 30],
    "max_steps": [MOST, 10],
    "error": [1e-3, 1e-6],
    "want": [["energy"], ("nutation", "q"), ()],
    "names": ["energy", "apex", "nutation"],
    "quantity": ["energy", "apex", "q"],
    "progress": [lambda *_: None, None],
    "events": [[LOW], [kr.events.loop(), kr.events.plane((0, 1, 0))], []],
    "truth": ["auto", "exact", PATHS[0]],
    "checkpoint": [CHECKPOINT, "top.run"],
    "grid": [None, [[0.1, 0.2], [0.3, 0.4]]],
    "event": [None, LOW],
    "max_wait": [None, 20.0, -5],
    "seed": [0, 7],
    "map": ["bobenko_suris", None],
    "rotation": [PATHS[0].rotation[0]],
    "direction": [1, -1, 0],
    "of": ["apex", "m"],
    "name": ["thesis", "energy", "asymmetric"],
    "size": [16, 32],
    "axes": [None],
    "x": ["spin_angle", "t"],
    "y": ["axial_momentum", "q_w"],
    "indicator": [None],
    "time_unit": ["s", "T"],
    "length_unit": ["m", "T"],
    "colour": [None, "red"],
    "message": ["it stopped"],
    "status": ["ERR_LIMIT"],
    "table": [None],
    "key": ["taylor", "rk4"],
    "threads": [None, 1, 2],
    "executor": [None],
    "reduce": [None, KEEPING, {"spin": "last"}],
    "reductions": [KEEPING, {"spin": "last"}],
    "out": [None],
    "index": [0, 1, (0, 1)],
    "tangents": [None, "start", ["gravity", "start"]],
    "paths": MANY,
    "scenes": [[TOP, LAGRANGE], [[TOP], [FREE]]],
    "shape": [-1, 1, (1, -1)],
    "tops": [*SOURCES, *ENSEMBLES],
    "part_size": [None, 1, 7],
    "task": ["solve", "lyapunov", "section"],
    "parts": [None, range(1), range(0)],
    "folder": ["swept", "half", "runs1"],
    "partial": FLAGS,
    "sweep": [None],
    "records": [*RECORDS, RECORDS],
    "free": [("start", "moments"), "velocity", ["start", "lever"]],
    "loss": ["linear", "soft"],
    "pieces": [None, 1, 2],
    "max_evaluations": [1, 30],
    "values": [{"spin": np.zeros(3)}, {"apex_x": [0.0] * 3, "energy": [1.0] * 3}],
    "sigma": [None, 0.1],
    "columns": [None, {"spin": "spin"}],
    "frame": [TABLE],
    "fit": [None, FITS[0]],
}
WORDS = {  # the keywords that a function accepts through **more, **changes, **words or **arguments
    "more": ["direction", "where", "max_count", "terminal"],
    "changes": [
        *["body", "momentum", "attitude", "gravity", "velocity", "damping"],
        *["turning", "shaking", "friction"],
    ],
    "words": ["spin", "tilt", "steady", "angles", "momentum", "mass", "body", "gravity", "degrees"],
}
WORDS["arguments"] = [name for name in WORDS["words"] if name != "body"]
PLACES = [0, -1, slice(None), (0, ...), ..., None, [0, 0], np.array([0]), (slice(1), 0), ()]
PARTICULAR = {  # values of parameters whose meaning differs from call to call
    **{f"Record{name}.free": [(), "bias", ["delay"]] for name in ("", ".from_csv", ".from_pandas")},
    **{f"Record.{name}.t": ["t"] for name in ("from_csv", "from_pandas")},
    "Record.t": [[0.0, 0.5, 1.0]],
    "Record.from_csv.file": ["record.csv"],
    "fit.scene": [LAGRANGE, TOP, ENSEMBLES[0]],
    "Fit.error_of.function": [lambda scene: scene.gravity, lambda scene: scene.body.moments],
    **dict.fromkeys(["apex.path", "rod.path", "Event.value.path"], PATHS),
    **dict.fromkeys(["events.crossing.value", "events.kinetic.value"], SIZES),
    "plot.path": [*PATHS, PATHS[:2]],
    "plot.more": PATHS,
    "Body.cuboid.half": VECTORS,
    "Body.ellipsoid.half": VECTORS,
    "section.tops": [*SCENES, *ENSEMBLES],
    "reduce.tops": ENSEMBLES,
    "frequencies.path": [SWAY, *PATHS],
    **{f"{verb}.scene": [TOP, LAGRANGE, *ENSEMBLES] for verb in ("lyapunov", "megno", "oli")},
    **{f"{verb}.t": [1.0, [0.5, 2.0], -1.0] for verb in ("lyapunov", "megno", "oli")},
    **{f"{verb}.direction": [None, [0.1] * 6] for verb in ("lyapunov", "megno", "oli")},
    "ExactGoryachevChaplygin.__call__.tangents": [None, "gravity"],  # those of "start" take 1 s
    "exact.scene": [*SCENES, SCENES[:2], *ENSEMBLES],
    "compare.t": [0.5, [0.25, 0.5]],
    **{f"{name}.__getitem__.key": PLACES for name in ("Bodies", "Ensemble", "Paths", "Section")},
    "Reductions.__getitem__.key": ["nutation", "m_x", *PLACES],
    **{f"{verb}.scene": [*SCENES, *ENSEMBLES] for verb in ("solve", "stream", "plan")},
    **{f"Bodies.{name}.mass": [1, [1, 2]] for name in ("cone", "cuboid", "symmetric")},
    **{f"Ensemble{name}.body": [TOP.body, *BODIES] for name in ("", ".from_euler", ".spinning")},
    **{
        f"Bodies.{name}.half": [(1, 2, 3), [(1, 1, 2), (3, 2, 1)]]
        for name in ("cuboid", "ellipsoid")
    },
    "Bodies.unphysical": [True, [True, False]],
    "Ensemble.momentum": [(0, 0, 1), np.ones((2, 3)), np.ones((3, 1, 3))],
    "Ensemble.gravity": [1.0, [1.0, 2.0], -1],
    "Ensemble.spinning.tilt": [0.5, [0.0, 0.5]],
    "Scene.scatter.momentum": [0.1, (0.1, 0, 0)],
    "Scene.scatter.attitude": [0.1, (0.1, 0, 0)],
    "Source.scatter.momentum": [0.1, (0.1, 0, 0)],
    "Source.scatter.attitude": [0.1, (0.1, 0, 0)],
    "Source.columns.file": ["tops.parquet"],
    "sweep.folder": [f"runs{i}" for i in range(40)],
    "Source.of.tops": ENSEMBLES,
    "Source.__getitem__.key": [0, -1, slice(1, 3), slice(None)],
    "SweepResult.__getitem__.name": ["status", "nutation_min", "top"],
    "SweepResult.part.i": [0, 1],
}


class Unit:
    """A number with a unit."""

    unit = "m"

    def __float__(self):
        return 1.0


class Array:
    """An object whose conversion to a numpy array fails."""

    def __array__(self, dtype=None, copy=None):
        raise ValueError("no array today")


KNOT = []
KNOT.append(KNOT)
LONG = "x" * 100_000
ODD = [
    *(None, True, False, np.False_, 0, -0.0, -1, 0.5, 2**31, 2**63, 2**64, -(2**63), 10**400),
    *(float("nan"), float("inf"), -float("inf"), 5e-324, 1e-308, 1e-160, 1e160, 1e308, 1j),
    *("", "x", "nan", "0", LONG, "a\0b", "\udce9", "a*b*c", "apex_z", "m_x*m_x", b"", b"PK", b"kr"),
    *((), [], {}, set(), object(), int, len, ..., KNOT, [KNOT], {"x": KNOT}, {LONG: 1}, {1: 2}),
    *(range(3), range(10**12), iter([1.0, 2.0]), itertools.count(), fractions.Fraction(1, 3)),
    *([0, 0, 0], [0] * 4, [1, 2], [1] * 9, ["a", "b", "c"], [[1, 2], [3]], [None] * 3, [0.1] * 50),
    *([5e-324] * 3, [1e308] * 3, [1e308] * 4, [1, float("nan"), 1], [1e-200, 1, 1e200], [LONG]),
    *(slice(None), slice(0, 10**30, 0), Unit(), Array(), memoryview(b"abcdefgh"), lambda: None),
    *(TOP, MADE_UP, PATHS[0], WANTED, LOW, kr.methods["rk4"], kr.events, kr.Body, kr.Scene),
    *(np.array(1.0), np.array("x"), np.array(None), np.array([], int), np.zeros((0, 3)), np.eye(3)),
    *(np.zeros((2, 3, 4)), np.array([1, "x"], object), np.ma.array([1, 2, 3], mask=[0, 1, 0])),
    *(np.float16(1), np.longdouble(3), np.complex64(1), np.int8(-1), np.uint64(2**64 - 1)),
    *(np.str_("x"), np.datetime64("2026-01-01"), np.zeros(3, "i4,f8"), np.broadcast_to(1.0, 10**6)),
    *(
        np.full(3, np.nan),
        np.zeros(3, bool),
        np.zeros(3, "S3"),
        np.zeros(6)[::-2],
        np.zeros(3, ">f8"),
    ),
]
SCALARS = st_numpy.scalar_dtypes() | st_numpy.unicode_string_dtypes(max_len=4)
SHAPES = st_numpy.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4)
HOSTILE = st.one_of(
    st.sampled_from(ODD),
    st.sampled_from(ODD),
    st.sampled_from([value for values in RIGHT.values() for value in values]),
    st.floats(),
    st.integers(),
    st.text(st.characters(exclude_characters="/."), max_size=6),
    st.lists(st.floats(), max_size=5),
    st_numpy.arrays(SCALARS, SHAPES),
)
