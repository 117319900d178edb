"""Valid and invalid values for the parameters of the public API."""

import fractions
import inspect
import itertools
from pathlib import Path

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
    kr.Body.symmetric(1, i1=[2, 3], i3=1, height=0.5),
    kr.Body.cuboid(half=[[(1, 1, 1)], [(1, 2, 3)]], pivot=(0.1, 0.2, 0)),
    kr.Body(1, (2, 2, 1), (0, 0, 0.5)),
]
ENSEMBLES = [
    LAGRANGE.vary(spin=[[1.0], [2.0]], tilt=[0.0, 0.5, 1.0]),
    kr.Scene(BODIES[0], momentum=np.ones((3, 1, 3)), damping=0.1, gravity=1),
    kr.Scene.stack([TOP, FREE]),
    kr.Scene(TOP.body, momentum=np.empty((0, 3)), gravity=1),
    TOP.vary(gravity=2.0),
]
WHEELED = kr.Scene(
    GENERAL.body.with_wheel(inertia=0.1, axis=(1, 0, 0), rate=2), momentum=(0, 1, 1), gravity=1
)
LOW = kr.events.nutation(direction=1)
WANTED = kr.solve(TOP, [0.0, 0.5], want=("energy", "apex"))
PATHS = [
    kr.solve(TOP, [0.0, 1.0, 2.0]),
    kr.solve(LAGRANGE, 1, "strang", step=0.125, every=2),
    kr.solve(TOP, 5, events=[LOW]),
    WANTED,
    kr.solve(TOP, []),
    kr.solve(FREE, -1, digits=20),
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
MOTIONS = [{"t": SWAY.t[:12], "q": SWAY.q[:12], "w": SWAY.velocity[:12]}]
MOTIONS += [{"t": SWAY.t[:3], "q_xyzw": SWAY.q[:3, [1, 2, 3, 0]]}]
MOST = 300  # number of steps after which a run ends
CHECKPOINT = kr.start(TOP, max_steps=MOST).checkpoint
FLAGS = [True, False, np.True_]
COUNTS = [1, 2, np.int64(3)]
SIZES = [1, 0.5, np.float32(2)]
VECTORS = [(0, 0, 1), [1.0, -2.0, 0.5], np.array([0.1, 0.2, 0.3], np.float32)]
INERTIAS = [(1, 2, 2.5), np.diag([3, 2, 4])]
ATTITUDES = [(1, 0, 0, 0), TILT, np.array(TILT)]
TIMES = [0.5, [0.0, 0.25, 0.5], np.array([0.5, 1]), -0.5, 0, []]
FUNCTIONS = ["apex_z", {"m_x": 2.0, "apex_z*apex_z": 1, "1": -0.5}]
FILES = ["top.npz", "top.toml", "top.run", "top.csv", "top.html", "new"]


class Metres(np.ndarray):
    """An array with a unit that NumPy drops silently."""

    unit = "m"


NAN, INF = float("nan"), float("inf")
LONG = "x" * 100_000
MANY_ROWS = np.full((300, 5), 0.123456789)
NO_NUMBERS = [NAN, INF, -INF, "1", True, 1j, None, 10**400, LONG, MANY_ROWS]
NOT_POSITIVE = [*NO_NUMBERS, 0, -1.5]
NO_VECTORS = [(1, 2), (0, 1, NAN), (0, -INF, 0), "abc", {1, 2, 3}, (1, 2, 2 + 1j), MANY_ROWS]
NO_VECTORS += [np.ma.array([1.0, 2.0, 3.0], mask=[False, True, False]), np.ones(3).view(Metres)]
NO_SIDES = [*NO_VECTORS, (1, 0, 1), (1, -1, 1)]
NO_INERTIAS = [(1, 2), np.ones((3, 2)), (1, 2, NAN), (1, 2, "3"), ((1, 2), (3,)), MANY_ROWS]
NO_INERTIAS += [((2, 0.1, 0), (0.2, 2, 0), (0, 0, 2))]
NO_MOMENTS = [(1, 2, 0), (1, -2, 2), (1, 2, 3.1), np.zeros((3, 3))]
NO_ATTITUDES = [(1, 0, 0), (1, 1, 0, 0), (0, 0, 0, 0), (0.7071, 0, 0, 0.7071), (1, 0, 0, NAN)]
NO_ATTITUDES += ["abcd", 3, MANY_ROWS]
NO_FLAGS = [1, "yes", MANY_ROWS]
NO_COUNTS = [-1, 1.5, "2", True, 2**70, LONG]
NO_TIMES = [NAN, [1, INF], "10", None, True, [1, 2j], [[1, 2], 3], [1, 3, 2], [1, -1], [-1, -0.5]]
NO_TIMES += [np.ma.array([1.0, 2.0], mask=[False, True]), ["soon"] * 100_000]
NO_OBJECTS = [3, None, LONG, kr.Body, {}]
NO_NAMES = ["qqq", "", 4, LONG]
# The names of parameters, values that they may have, and values that are refused.
PARAMETERS = [
    ("q a b", ATTITUDES, ["abcd", 3, (1, 0, 0)]),
    ("attitude attitude_xyzw", ATTITUDES, NO_ATTITUDES),
    ("com pivot normal point momentum impulse angles", VECTORS, NO_VECTORS),
    ("velocity body_momentum body_velocity rates", VECTORS, NO_VECTORS),
    ("by v", VECTORS, [(1, 2), "abc"]),
    ("inertia inertia_about_com", INERTIAS, [*NO_INERTIAS, *NO_MOMENTS]),
    ("mass radius length density i1 i3 speed fps", SIZES, NOT_POSITIVE),
    ("height outer gravity spin tilt precession energy vertical axial value", SIZES, NO_NUMBERS),
    ("offset within thickness elevation azimuth", SIZES, NO_NUMBERS),
    ("inner", SIZES, [*NO_NUMBERS, -1, 3]),
    ("nutation", SIZES, [LONG, 1j]),
    ("unphysical shell degrees steady fast lower unwrap back terminal partial", FLAGS, NO_FLAGS),
    ("open", FLAGS, []),
    ("n", COUNTS, NO_COUNTS),
    ("every max_count chunk repeats", COUNTS, [*NO_COUNTS, 0]),
    ("max_evaluations", [1, 30], [*NO_COUNTS, 0]),
    ("part_size pieces threads", [None, 1, 2], [*NO_COUNTS, 0]),
    ("seed", [0, 7], NO_COUNTS),
    ("max_steps", [300, 10], NO_COUNTS),
    ("i k which", COUNTS, [1.5, "2"]),
    ("index", [0, 1, (0, 1)], []),
    ("digits", [16, 20, 30], [0, 31, 20.5, "20", True, 10**6]),
    ("size", [16, 32], [*NO_COUNTS, 0]),
    ("step tol", [0.125, 1e-6], NOT_POSITIVE),
    ("steps tols", [[0.1], (0.125, 0.25)], [0.1, ["a"], [0], [NAN]]),
    ("error", [1e-3, 1e-6], [NAN, "1", 0, -1]),
    ("inertia_rtol", [0.0, 1e-3], [NAN, -5e-324, 1, "1", True, LONG]),
    ("sigma", [None, 0.1], [NAN, 0, -1, "x"]),
    ("max_wait", [None, 20.0, -5], [NAN, "1", 0]),
    ("damping", [0.1, (0.1, 0.2, 0.3)], [NAN, -1, "1", (1, 2), (0, 0, -1)]),
    ("friction", [0.1, 0], [NAN, -1, "1", True]),
    ("rotor turning", [(0.0, 0.0, 0.5), (0.1, -0.2, 0.3)], NO_VECTORS),
    ("wheels", [[(0, 0, 1, 5.0, 0.1)], np.zeros((2, 5))], [NAN, 1, (0, 0, 1), np.ones((4, 5))]),
    ("rate gradient", SIZES, NO_NUMBERS),
    ("shaking", [(0.1, 5.0, 0.3), (0.0, 0.0, 0.0)], [*NO_VECTORS, (0.1, -5.0, 0.3)]),
    ("axis", [(0.0, 0.0, 1.0), (1.0, -2.0, 0.5)], [*NO_VECTORS, (0, 0, 0)]),
    ("profile", [[(0, 0), (1, 1), (0, 2)]], ["abc", 3, [(0, 0), (1, NAN), (0, 2)]]),
    ("mesh", ["part.stl"], [3, np.ones((2, 3, 3))]),
    ("scale", SIZES, NOT_POSITIVE),
    ("half", [(1, 2, 3), np.ones(3)], NO_SIDES),
    ("t", TIMES, NO_TIMES),
    ("body", [TOP.body, LAGRANGE.body, CORNER, MADE_UP, PLATE], [*NO_OBJECTS, TOP]),
    ("scene", SCENES, [*NO_OBJECTS, TOP.body]),
    ("what", [*SCENES, PATHS[1]], NO_OBJECTS),
    ("scenes", [[TOP, LAGRANGE], [[TOP], [FREE]]], [3, [TOP, 3], [[TOP], [TOP, FREE]]]),
    ("paths", MANY, []),
    ("axes", [None], [[1, 2, 3], True]),
    ("sweep table executor out message status colour result", [None, "red"], []),
    ("records", [*RECORDS, RECORDS], [3, [], [3]]),
    ("fit", [None, FITS[0]], []),
    ("results", MOTIONS, [3, None, {}, [], {"t": [0.0]}, [MOTIONS[0], 3], TABLE]),
    ("case", ["tumble", TOP], ["tumbl", 3, ENSEMBLES[0], LONG]),
    ("level", ["engine", "science", 0.1], ["good", *NOT_POSITIVE]),
    ("frame", [TABLE], []),
    ("method", ["auto", "strang", "taylor", "rk4", "exact", "extrap", *kr.methods], NO_NAMES),
    ("methods", ["strang", ["rk4", "taylor"], None], [["rk5"], ["rk4", LONG], 4]),
    ("task", ["solve", "chaos", "section"], NO_NAMES),
    ("loss", ["linear", "soft"], NO_NAMES),
    ("keep", ["momentum", "velocity"], NO_NAMES),
    ("truth", ["auto", "exact", PATHS[0]], NO_NAMES),
    ("want", [["energy"], ("nutation", "q"), ()], ["energi", [LONG], 3]),
    ("tangents", [None, "start", ["gravity", "start"]], ["starts", 3, [], LONG]),
    ("names quantity", ["energy", "apex", "nutation"], ["energi", LONG]),
    ("free", [("start", "moments"), "velocity", ["start", "lever"]], ["lenght", 3, LONG]),
    ("events", [[LOW], [kr.events.loop(), kr.events.plane((0, 1, 0))], []], [3, "loop", [3]]),
    ("event", [None, LOW], [3, "loop"]),
    ("function where", FUNCTIONS, ["m_q", 3, {}, LONG, {"m_x": NAN}]),
    ("of", ["apex", "m"], ["apexx", 3, LONG]),
    ("direction", [1, -1, 0], [2, 0.5, "up"]),
    ("reduce reductions", [None, KEEPING, {"spin": "last"}], [3, {"spinn": "last"}, {"spin": "x"}]),
    ("parts", [None, range(1), range(0)], [3.5, "x"]),
    ("progress", [lambda *_: None, None], []),
    ("checkpoint", [CHECKPOINT, "top.run"], [b"x"]),
    ("grid", [None, [[0.1, 0.2], [0.3, 0.4]]], [3, (3, 3, 3, 3), (3, 0), (3, 1.5)]),
    ("rotation", [PATHS[0].rotation[0]], [3]),
    ("values", [{"spin": np.zeros(3)}, {"apex_x": [0.0] * 3, "energy": [1.0] * 3}], [3, {}]),
    ("columns", [None, {"spin": "spin"}], [3]),
    ("name", ["energy", "thesis", "asymmetric"], []),
    ("x y", ["spin_angle", "t", "axial_momentum", "q_w"], ["qqq"]),
    ("chaos", [None], ["x"]),
    ("indicator", ["megno", "oli", "lyapunov"], ["x"]),
    ("time_unit length_unit", ["s", "T"], [3]),
    ("key", ["taylor", "rk4"], []),
    ("shape", [-1, 1, (1, -1)], []),
    ("file source path folder", FILES, []),
]
RIGHT = {name: right for names, right, _ in PARAMETERS for name in names.split()}
WRONG = {name: wrong for names, _, wrong in PARAMETERS for name in names.split()}
WORDS = {  # the keywords that a function accepts through **more, **changes, **words or **arguments
    "more": ["direction", "where", "max_count", "terminal"],
    "changes": ["body", "momentum", "attitude", "gravity", "damping", "turning", "friction"],
    "words": ["spin", "tilt", "steady", "angles", "momentum", "mass", "body", "degrees"],
}
WORDS["arguments"] = [name for name in WORDS["words"] if name != "body"]
PLACES = [0, -1, slice(None), (0, ...), ..., None, [0, 0], np.array([0]), (slice(1), 0), ()]


def spread(table):
    """Return a dictionary whose keys are the words of the keys of a table."""
    return {name: value for names, value in table.items() for name in names.split()}


# Values of parameters whose meaning differs from call to call
PARTICULAR = spread(
    {
        "Record.free Record.from_csv.free Record.from_pandas.free": [(), "bias", ["delay"]],
        "Record.from_csv.t Record.from_pandas.t": ["t"],
        "Record.t": [[0.0, 0.5, 1.0]],
        "Record.from_csv.file": ["record.csv"],
        "fit.scene": [LAGRANGE, TOP, ENSEMBLES[0]],
        "Fit.error_of.function": [lambda scene: scene.gravity, lambda scene: scene.body.moments],
        "apex.path rod.path Event.value.path plot.more": PATHS,
        "plot.path": [*PATHS, PATHS[:2]],
        "section.scene solve.scene stream.scene plan.scene": [*SCENES, *ENSEMBLES],
        "reduce.scene Source.of.scene": ENSEMBLES,
        "frequencies.path": [SWAY, *PATHS],
        "chaos.scene": [TOP, LAGRANGE, *ENSEMBLES],
        "chaos.t": [1.0, [0.5, 2.0], -1.0],
        "chaos.direction": [None, [0.1] * 6],
        "ExactTorus.__call__.tangents": [None, "gravity"],  # "start" takes 1 s
        "events.wheel_rate.scene": [WHEELED],
        "enclose.scene": [FREE, TOP, DAMPED, LAGRANGE],
        "enclose.digits Path.verify.digits": [30, 20],
        "Enclosure.compare.path": [PATHS[0]],
        "exact.scene": [*SCENES, SCENES[:2], *ENSEMBLES],
        "citation.result": [
            None,
            "strang",
            kr.methods["exact"],
            *PATHS,
            FITS[0],
            kr.exact(LAGRANGE),
        ],
        "compare.t": [0.5, [0.25, 0.5]],
        "score.steps": [None, [0.1]],
        "Body.__getitem__.key Scene.__getitem__.key": PLACES,
        "Chaos.__getitem__.key Exact.__getitem__.key Section.__getitem__.key": PLACES,
        "Reductions.__getitem__.key": ["nutation", "m_x", *PLACES],
        "Body.cone.mass Body.cuboid.mass Body.symmetric.mass": [1, [1, 2]],
        "Scene.body Scene.from_euler.body Scene.spinning.body": [TOP.body, *BODIES],
        "Body.cuboid.half Body.ellipsoid.half": [(1, 2, 3), [(1, 1, 2), (3, 2, 1)]],
        "Body.from_model.path": ["model.xml"],
        "Body.from_model.name": ["top"],
        "Body.unphysical": [True, [True, False]],
        "Scene.momentum": [(0, 0, 1), np.ones((2, 3)), np.ones((3, 1, 3))],
        "Scene.gravity": [1.0, [1.0, 2.0], -1],
        "Scene.spinning.tilt": [0.5, [0.0, 0.5]],
        "Scene.scatter.momentum Scene.scatter.attitude": [0.1, (0.1, 0, 0)],
        "Source.scatter.momentum Source.scatter.attitude": [0.1, (0.1, 0, 0)],
        "Source.columns.file": ["tops.parquet"],
        "sweep.scene": [*SOURCES, *ENSEMBLES],
        "sweep.folder": [f"runs{i}" for i in range(40)],
        "Source.__getitem__.key": [0, -1, slice(1, 3), slice(None)],
        "SweepResult.__getitem__.name": ["status", "nutation_min", "top"],
        "SweepResult.part.i": [0, 1],
    }
)
UNORDERED = NO_TIMES[:7]  # the times of closed forms may have any order
NO_WIDTHS = [NAN, -1, "1", (1, 2), True]
PARTICULAR_WRONG = spread(
    {
        "Exact.__call__.t ExactTorus.__call__.t": UNORDERED,
        "Path.modified_energy.step Path.modified_energy4.step": NO_NUMBERS,
        "Scene.scatter.momentum Scene.scatter.attitude": NO_WIDTHS,
        "Source.scatter.momentum Source.scatter.attitude": NO_WIDTHS,
        "Body.with_wheel.inertia": NO_NUMBERS,
        "enclose.digits Path.verify.digits": [0, 251, 20.5, "20", True, 10**6],
        "chaos.direction": [(1, 2), "up", [NAN] * 6, [0] * 6],
        "Record.from_csv.t Record.from_pandas.t sweep.direction scenes.name_of.scene": [],
        "Source.of.scene sweep.scene": NO_OBJECTS[:2],
        "citation.result": [3, "strange", TOP, LONG, [PATHS[0]]],
        "score.steps": [["a"], [0], [NAN]],
    }
)
# Further arguments of valid calls, for which the first valid values are not enough
FURTHER = spread(
    {
        "Body.cone Body.cylinder Body.ellipsoid Body.sphere Body.tube": {"mass": 1},
        "Body.from_mesh Body.from_profile": {"mass": 1},
        "Body.rod": {"pivot": (1, 0, 0)},
        "Body": {"com": (0, 0, 0.5), "inertia": (1, 2, 2.5)},
        "Body.shift": {"by": (0, 0, 1e-3)},
        "Body.turn": {"by": TILT},
        "Body.with_rotor Body.with_wheel": {"inertia": 0.1},
        "Scene": {"momentum": (0.1, 0.2, 0.3), "gravity": 1},
        "steady": {"body": LAGRANGE.body, "rate": 2.0, "gravity": 1},
        "Scene.from_integrals": {"body": LAGRANGE.body, "energy": 9.0, "gravity": 1},
        "Scene.from_euler": {"body": LAGRANGE.body, "gravity": 1},
        "Scene.spinning": {"spin": 2.0, "body": LAGRANGE.body, "gravity": 1},
        "Scene.from_toml": {"source": "top.toml"},
        "Scene.scatter Source.scatter": {"attitude": 0.1},
        "Source.grid": {"spin": [1, 2]},
        "Source.random": {"spin": (1, 2)},
        "Chaos.message Reductions.message Section.message": {"index": (0, 0)},
        "Run.change": {"gravity": 2},
        "Run.reset": {"momentum": (1, 2, 3)},
        "Run.stream stream": {"t": [0.5, 1.0]},
        "Table.__getitem__": {"i": 0},
        "compare": {"methods": ["taylor"], "tols": [0.1], "steps": [0.1]},
        "exact": {"scene": LAGRANGE},
        "load": {"file": "top.run"},
        "read_sweep": {"folder": "swept"},
        "reduce": {"reductions": KEEPING},
        "rod": {"path": PATHS[1]},
        "scenes.get_scene": {"name": "thesis"},
        "score": {"case": TOP},
        "starts": {"energy": 5, "vertical": 1, "n": 2, "gravity": 1},
        "sweep": {"t": [1.0]},
    }
)
VARIABLE = inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD


def get_valid_values(name, word):
    return PARTICULAR.get(f"{name}.{word}") or RIGHT[word]


def get_wrong_values(name, word):
    """Return values of a parameter that a function refuses."""
    values = PARTICULAR_WRONG.get(f"{name}.{word}", WRONG[word])
    if name.startswith(("Body", "Scene")):  # which may have an array of each number
        return [value for value in values if value is not MANY_ROWS]
    return values


def get_arguments(name, parameters):
    """Return the arguments of a valid call by name."""
    required = [p.name for p in parameters if p.default is p.empty and p.kind not in VARIABLE]
    arguments = {word: get_valid_values(name, word)[0] for word in required}
    if any(p.name == "max_steps" for p in parameters):
        arguments["max_steps"] = MOST
    return arguments | FURTHER.get(name, {})


def write_files():
    """Write the files that valid arguments name to the working directory."""
    kr.solve(TOP, [1, 2]).save("top.npz")
    TABLE.to_csv("record.csv", index=False)
    kr.scenes.thesis.to_toml("top.toml")
    kr.start(TOP).save("top.run")
    for folder, parts in {"swept": None, "half": range(1)}.items():
        words = {"part_size": 3, "parts": parts, "reduce": {"nutation": "min"}}
        kr.sweep(SOURCES[0], [1.0], folder=folder, **words)
    tops = pandas.DataFrame({"spin": [1.0, 2.0], "tilt": [0.1, 0.2]})
    tops.to_parquet("tops.parquet")
    corners = "0 0 0", "1 0 0", "0 1 0", "0 0 1"
    faces = (0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)
    Path("part.stl").write_text(" ".join(f"vertex {corners[i]}" for face in faces for i in face))
    inertial = '<inertial pos="0 0 1" mass="1" diaginertia="1 2 2.5"/>'
    Path("model.xml").write_text(f'<mujoco><body name="top">{inertial}</body></mujoco>')


KNOT = []
KNOT.append(KNOT)
ODD = [
    *(None, True, False, np.False_, 0, -0.0, -1, 0.5, 2**31, 2**63, 2**64, -(2**63), 10**400),
    *(float("nan"), float("inf"), -float("inf"), 5e-324, 1e-308, 1e-160, 1e160, 1e308, 1j),
    *("", "x", "nan", "0", LONG, "a\0b", "\udce9", "a*b*c", "apex_z", "m_x*m_x", b"", b"PK", b"kr"),
    *((), [], {}, set(), object(), int, len, ..., KNOT, [KNOT], {"x": KNOT}, {LONG: 1}, {1: 2}),
    *(range(3), range(10**12), iter([1.0, 2.0]), itertools.count(), fractions.Fraction(1, 3)),
    *([0, 0, 0], [0] * 4, [1, 2], [1] * 9, ["a", "b", "c"], [[1, 2], [3]], [None] * 3, [0.1] * 50),
    *([5e-324] * 3, [1e308] * 3, [1e308] * 4, [1, float("nan"), 1], [1e-200, 1, 1e200], [LONG]),
    *(slice(None), slice(0, 10**30, 0), NO_VECTORS[-1], memoryview(b"abcdefgh"), lambda: None),
    *(TOP, MADE_UP, PATHS[0], WANTED, LOW, kr.methods["rk4"], kr.events, kr.Body, kr.Scene),
    *(np.array(1.0), np.array("x"), np.array(None), np.array([], int), np.zeros((0, 3)), np.eye(3)),
    *(np.zeros((2, 3, 4)), np.array([1, "x"], object), np.ma.array([1, 2, 3], mask=[0, 1, 0])),
    *(np.float16(1), np.longdouble(3), np.complex64(1), np.int8(-1), np.uint64(2**64 - 1)),
    *(np.str_("x"), np.datetime64("2026-01-01"), np.zeros(3, "i4,f8"), np.broadcast_to(1.0, 10**6)),
    *(np.zeros(3, bool), np.zeros(3, "S3"), np.zeros(6)[::-2], np.zeros(3, ">f8")),
]
SCALARS = st_numpy.scalar_dtypes() | st_numpy.unicode_string_dtypes(max_len=4)
SHAPES = st_numpy.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4)
HOSTILE = st.one_of(
    st.sampled_from(ODD),
    st.sampled_from([value for values in RIGHT.values() for value in values]),
    st.floats(),
    st.integers(),
    st.text(st.characters(exclude_characters="/."), max_size=6),
    st.lists(st.floats(), max_size=5),
    st_numpy.arrays(SCALARS, SHAPES),
)
