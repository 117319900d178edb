"""Tests that saved paths and runs are read back bit for bit, and that damaged files are refused.

The environment variable KREISEL_CALLS sets how many randomly damaged files each test tries.
"""

import io
import json
import os
import pickle
import re
import struct
import tracemalloc
import zipfile
import zlib

import kreisel as kr
import numpy as np
import pytest
from drawn_tops import assert_same_bits, assert_same_path
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tops import FREE, LAGRANGE

CALLS = os.environ.get("KREISEL_CALLS")
EXAMPLES = settings(
    max_examples=int(CALLS or 40),
    derandomize=not CALLS,
    deadline=None,
    database=None,
    suppress_health_check=list(HealthCheck),
)
pytestmark = pytest.mark.filterwarnings(
    "ignore:no body has this inertia", "ignore:.*unphysical", "ignore:.*only up to rounding"
)
TOP = kr.scenes.asymmetric
LOWEST = kr.events.nutation(direction=1)
MOVED = TOP.replace(turning=(0.1, 0.2, 0.3), shaking=(0.1, 5.0, 0.3), friction=0.1)
SOME = ("nutation", "frame", "energy")
MOST = 300  # number of steps after which a run of a damaged file ends


def make_failed_path():
    with pytest.raises(kr.Error) as error:
        kr.solve(TOP, [0.5, 1.0, 9.0], max_steps=3)
    return error.value.path


def list_pieces(**words):
    return list(kr.stream(TOP, [0.0, 1.0, 2.0, 3.0, 4.0], chunk=2, **words))


def continue_run():
    run = kr.start(TOP, "strang", step=0.01, back=True)
    run.to(-1.0)
    return run.to(-2.0, every=10)


PATHS = {  # paths that do not come from a plain call of kreisel.solve, and those of damaged files
    "states": lambda: kr.solve(TOP, [1.0, 2.0, 2.0]),
    "20 digits": lambda: kr.solve(TOP, [1.0, 2.0], digits=20),
    "events": lambda: kr.solve(TOP, 20.0, events=[kr.events.loop(), LOWEST], digits=20),
    "wanted": lambda: kr.solve(TOP, 20.0, events=[LOWEST], want=SOME),
    "tangents": lambda: kr.solve(MOVED, [0.0, 1.0], tangents=("start", "gravity")),
    "geometric": lambda: kr.solve(LAGRANGE, 5.0, "geometric", error=1e-6, want=SOME),
    "empty": lambda: kr.solve(TOP, [], want=SOME),
    "closed form": lambda: kr.exact(FREE)([3.0, -1.0]),
    "failed": make_failed_path,
    "streamed": lambda: list_pieces(want=SOME, digits=20)[1],
    "continued": continue_run,
    "selected": lambda: kr.solve(TOP, np.linspace(0.0, 1.0, 9), digits=20)[::-3],
    "between": lambda: kr.solve(TOP, 9.0)([3.0, 2.0]),
    "only": lambda: kr.solve(TOP, 9.0).only(("q", "apex")),
}


def check_same_paths(path, again):
    """Check that a path was read back with all of its numbers, options and events."""
    assert_same_path([again], path)
    names = "scene", "method", "step", "tol", "digits", "start_time", "plan"
    assert all(getattr(again, name) == getattr(path, name) for name in names)
    assert repr(path) == repr(again) and not again.t.flags.writeable
    assert len(path.events) == 0 or again.events.path.scene == path.scene
    if hasattr(path, "tangents"):
        assert_same_bits(again.tangents, path.tangents)


@pytest.fixture
def file(tmp_path):
    return tmp_path / "any name"


@pytest.mark.parametrize("kind", PATHS)
def test_a_saved_or_pickled_path_is_equal_bit_for_bit(kind, file):
    path = PATHS[kind]()
    path.save(file)
    for again in (kr.load(file), pickle.loads(pickle.dumps(path))):
        check_same_paths(path, again)
        assert path.want or again.error == path.error


def test_a_path_can_be_read_with_numpy(file):
    path = PATHS["events"]()
    path.save(file)
    with np.load(file) as arrays:
        for name in ("t", "q", "m", "q_low", "m_low"):
            assert np.array_equal(arrays[name], getattr(path, name))
        assert np.array_equal(arrays["events_m_low"], path.events.path.m_low)
        assert str(arrays["scene"]) == TOP.to_toml()
        assert json.loads(str(arrays["head"]))["stats"] == [*path.stats]


def test_load_recognizes_scenes_and_runs(file):
    TOP.to_toml(file)
    assert kr.load(file) == TOP
    run = kr.start(TOP, "strang", step=0.01)
    run.to(1.0)
    run.save(file)
    again = kr.load(file)
    assert isinstance(again, kr.Run)
    check_same_paths(run.to(2.0), again.to(2.0))


# Files that are not what they seem


@pytest.mark.parametrize(
    "data",
    [b"", b"PK", b"PK\x05\x06" + bytes(18), b"\x00" * 99, b"\xff\xfe\xfd", b"t,q\n1,2\n", b"a = 1",
     b"kreisel run\n", b"kreisel run\n00000000\n{}\n", b"momentum = 3\n[body]\nmass = 'x'",
     b"\x93NUMPY\x01\x00", b"\x80\x04K\x01.", b"a = " + b"[" * 9999 + b"]" * 9999, b"#" * 2**21],
)  # fmt: skip
def test_files_of_other_programs_are_refused(data, file):
    file.write_bytes(data)
    with pytest.raises(ValueError, match="any name"):
        kr.load(file)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_pipes_devices_and_folders_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for name in (tmp_path / "pipe", "/dev/zero"):
        with pytest.raises(ValueError, match="not a regular file"):
            kr.load(name)
    for name, error in ((tmp_path, OSError), (tmp_path / "none", FileNotFoundError)):
        with pytest.raises(error):
            kr.load(name)


def unpack(path, file):
    """Save a path, and return the members of the archive."""
    path.save(file)
    with zipfile.ZipFile(file) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def encode(text):
    """Return the bytes of a NumPy file that contains `text`."""
    out = io.BytesIO()
    np.save(out, np.array(text))
    return out.getvalue()


def decode_head(members):
    return json.loads(str(np.load(io.BytesIO(members["head.npy"]))))


def check_refusal(file, members, word="any name", compress=zipfile.ZIP_STORED):
    with zipfile.ZipFile(file, "w", compress) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    with pytest.raises(ValueError, match=word):
        kr.load(file)


@pytest.fixture
def members(tmp_path):
    """Return the members of the archive of a path with events."""
    return unpack(PATHS["events"](), tmp_path / "good")


WRONG = [None, True, 0, -1, 2, 1.5, 10**400, float("nan"), "", "taylr", [], [1], {}, [["q"]]]
WRONG += [["gravity", "start"]]
NUMBERS, NONE, TEXTS = [0, 2], [None], ["", "taylr"]
ENTRIES = {  # a path, the keys of an entry of its header, and those values of WRONG that are valid
    **{("20 digits", name): [] for name in ("format", "method", "stats")},
    **{("20 digits", name): NONE for name in ("tol", "want", "choice")},
    ("20 digits", "step"): [None, -1, 2, 1.5],
    ("20 digits", "digits"): [None, 2],
    ("20 digits", "low"): [True],
    ("20 digits", "asked"): TEXTS,
    ("events", "events"): NONE,
    **{("states", "stats", i): NUMBERS for i in range(4)},
    ("tangents", "tangents", "by"): [],
    ("geometric", "choice", "method"): TEXTS,
    ("geometric", "choice", "step"): [1.5, float("nan")],
}


@pytest.mark.parametrize("entry", ENTRIES)
def test_invalid_header_entries_are_refused(entry, file):
    kind, *keys, last = entry
    members = unpack(PATHS[kind](), file)
    head = table = decode_head(members)
    for key in keys:
        table = table[key]
    allowed = list(map(repr, ENTRIES[entry]))
    for value in [value for value in WRONG if repr(value) not in allowed]:
        table[last] = value
        check_refusal(file, members | {"head.npy": encode(json.dumps(head))})
    del table[last]
    check_refusal(file, members | {"head.npy": encode(json.dumps(head))})


def test_invalid_headers_and_scenes_are_refused(file, members):
    for text in ("", "[]", "3", "{", "[" * 9000, '{"format": 1}', "\0", "null"):
        check_refusal(file, members | {"head.npy": encode(text)})
    for text in ("", "x = 1", "momentum = 3", "[body]", "[" * 9000, TOP.to_toml() * 2):
        check_refusal(file, members | {"scene.npy": encode(text)})
    for name, value in (("which", -1), ("direction", 0), ("direction", 2)):
        array = np.load(io.BytesIO(members[f"events_{name}.npy"]))
        wrong = encode(np.full(array.shape, value, np.int32))
        check_refusal(file, members | {f"events_{name}.npy": wrong}, "events are damaged")


def test_damaged_results_of_many_tops_are_refused(file):
    tops = kr.scenes.cusps.vary(gravity=[0.5, 1.0])
    members = unpack(kr.solve(tops, [0.0, 20.0], events=[LOWEST]), file)
    for change in ({"names": []}, {"times": [3, 2]}, {"last": [[0, 3, 8]]}):
        head = encode(json.dumps(decode_head(members) | change))
        check_refusal(file, members | {"head.npy": head})
    for name in ("status", "done", "events_top", "events_which"):
        array = np.load(io.BytesIO(members[f"{name}.npy"]))
        check_refusal(file, members | {f"{name}.npy": encode(np.full_like(array, -99))})


def npy(descr, shape, data, order="False"):
    header = f"{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data


class Evil:
    def __reduce__(self):
        return os.mkdir, ("harmed",)


def test_invalid_arrays_are_refused(file, members, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = len(np.load(io.BytesIO(members["t.npy"])))
    number = npy("'<f8'", "()", bytes(8))
    evil = io.BytesIO()
    np.save(evil, np.array([Evil()], dtype=object), allow_pickle=True)
    bad = [
        b"", b"x", evil.getvalue(), members["q.npy"][:-1], members["q.npy"] + b"x", number,
        npy("'<f8'", "(1000000000000,)", b""), npy("'<f8'", f"({rows}, 4)", b""),
        npy("'<f8'", "(0, 99999999999999999999999999)", b""),
        npy("'|O'", "(1,)", pickle.dumps(Evil())), npy("'<U99999999999'", "()", b""),
        npy("'<f8'", "(-1, 4)", b""), npy("'>f8'", f"({rows}, 4)", bytes(32 * rows)),
        npy("'<f8'", f"({rows}, 4)", bytes(32 * rows), "True"), npy("'<f8'", "(" * 9000, b""),
        npy("'<i4'", f"({rows}, 4)", bytes(16 * rows)), npy("'<U1'", "()", b"\x00\xd8\x00\x00"),
        npy("'<f8'", f"({rows}, 5)", bytes(40 * rows)), npy("'<f8'", "(1, 4)", bytes(32)),
        b"\x93NUMPY\x01\x00\xff\xff{" + bytes(99),
    ]  # fmt: skip
    for name in members:
        for data in bad:
            if not (name in ("t.npy", "events_t.npy") and data == number):
                check_refusal(file, members | {name: data})
        rest = {other: members[other] for other in members if other != name}
        if name not in ("q_low.npy", "events_q_low.npy"):
            check_refusal(file, rest, "it has no member ")
    assert not (tmp_path / "harmed").exists()


@pytest.mark.parametrize("compress", [zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA, zipfile.ZIP_STORED])
def test_a_decompression_bomb_is_refused_before_it_is_read(compress, file, members):
    with zipfile.ZipFile(file, "w", compress) as archive:
        for name, data in (members | {"q.npy": bytes(1 << 24 if compress else 1 << 16)}).items():
            archive.writestr(name, data)
        if not compress:  # members may share their bytes
            archive.filelist += archive.infolist() * 200
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match="compressed" if compress else "larger than the file"):
            kr.load(file)
        # [bytes]; reading the whole file would take 2^24
        assert tracemalloc.get_traced_memory()[1] < 1 << 21
    finally:
        tracemalloc.stop()


def seal_checkpoint(body):
    """Return the bytes of a checkpoint with the checksum of its body."""
    return b"kreisel run\n%08x\n" % zlib.crc32(body) + body


@pytest.mark.parametrize(
    "changes",
    [
        *({"t": "soon"}, {"t": 7.0}, {"t": float("nan")}, {"stats": [1, 2]}, {"stats": None}),
        *({"stats": [1, 2, 3, -4]}, {"fresh": "no"}, {"scene": 3}, {"scene": "a = " + "[" * 5000}),
        *({"method": []}, {"want": 5}, {"back": None}, {"kernel": 5}, {"max_steps": {}}),
    ],
)
def test_a_checkpoint_with_a_forged_header_is_refused(changes):
    run = kr.start(TOP, "strang", step=0.1)
    run.to(1.0)
    line, _, memory = run.checkpoint.split(b"\n", 2)[2].partition(b"\n")
    assert kr.resume(seal_checkpoint(line + b"\n" + memory)).t == 1.0
    line = json.dumps(json.loads(line) | changes).encode()
    with pytest.raises(ValueError, match="not a checkpoint of a run"):
        kr.resume(seal_checkpoint(line + b"\n" + memory))


# Files that are changed at random


SCENES = [TOP.to_toml(), MOVED.to_toml(), kr.scenes.thesis.replace(damping=0.1).to_toml()]
TOKENS = ["nan", "-inf", "-1", "0", "1e400", "1e308", "5e-324", "[]", "{}", "true", '"x"', "[[1]]"]
TOKENS += [
    "9" * 400,
    "[" * 500,
    "\0",
    "\udce9",
    "[0, 0, 1]",
    "",
    *["1979-05-27", "é", "mass", "[body]"],
]
VALUES = [None, True, -1, 0, 1, 2.5, 1e308, 5e-324, 10**30, "", "x", "taylor", [], [1], {}, [[]]]
VALUES += [{"x": 1}, ["energy"], float("nan"), float("inf"), "9" * 5000, [None] * 4, "state", "1"]
ARCHIVED = ["20 digits", "events", "wanted", "geometric", "tangents"]
LETTERS = 1000  # largest length of an error message


def start_checkpoint(**words):
    run = kr.start(TOP, max_steps=MOST, **words)
    run.to(0.5)
    return run.checkpoint


CHECKPOINTS = [
    start_checkpoint(),
    start_checkpoint(method="strang", step=0.125),
    start_checkpoint(events=[LOWEST], digits=20),
]


@st.composite
def corrupt_bytes(draw, data):
    """Return `data` with up to four random changes."""
    for _ in range(draw(st.integers(1, 4))):
        begin = draw(st.integers(0, len(data)))
        end = min(len(data), begin + draw(st.integers(0, 40)))
        piece = data[begin:end]
        new = [piece[::-1], b"", piece * 2, draw(st.binary(max_size=9)), bytes(len(piece))]
        data = data[:begin] + draw(st.sampled_from(new)) + data[end:]
    return data


@st.composite
def corrupt_text(draw, text):
    """Return TOML text with a few random changes."""
    for _ in range(draw(st.integers(1, 3))):
        words = list(re.finditer(r"[\w.+-]+|\[.*\]|=|\n", text)) or [re.match("", text)]
        word = draw(st.sampled_from(words))
        text = text[: word.start()] + draw(st.sampled_from(TOKENS)) + text[word.end() :]
    return text


@st.composite
def corrupt_header(draw, head):
    """Return a JSON object with one key removed or one value changed."""
    head = json.loads(json.dumps(head))
    table = draw(st.sampled_from([head, *(v for v in head.values() if v and type(v) is dict)]))
    word = draw(st.sampled_from(sorted(table)))
    if draw(st.booleans()) and isinstance(table[word], list) and table[word]:
        index = draw(st.integers(0, len(table[word]) - 1))
        table[word][index] = draw(st.sampled_from(VALUES))
    elif draw(st.integers(0, 9)):
        table[word] = draw(st.sampled_from(VALUES))
    else:
        del table[word]
    return head


def read_and_use(load, use):
    """Read a file and process its contents, and check that any error message is short."""
    try:
        use(load())
    except (TypeError, ValueError, MemoryError, OSError, kr.Error) as error:
        assert len(str(error)) < LETTERS


def use_scene(scene):
    assert kr.Scene.from_toml(scene.to_toml()) == scene
    use_path(kr.solve(scene, [0.0, 0.125], max_steps=MOST))


def use_path(path):
    assert isinstance(repr(path), str) and isinstance(repr(path.plan), str)
    for name in path.want or ("energy", "nutation", "precession_angle", "frame"):
        assert len(getattr(path, name)) == len(path)
    assert len(path.events.t) == len(path.events.which) == len(path.events)


def use_run(run):
    use_path(run.to(run.t + (-0.125 if run.t < 0.0 else 0.125)))
    assert kr.resume(run.checkpoint).t == run.t


@EXAMPLES
@given(st.sampled_from(SCENES).flatmap(corrupt_text))
def test_any_text_is_a_scene_or_is_refused(text):
    read_and_use(lambda: kr.Scene.from_toml(text + "\n"), use_scene)


@EXAMPLES
@given(st.data())
def test_any_checkpoint_with_a_correct_checksum_is_a_run_or_is_refused(data):
    line, _, memory = data.draw(st.sampled_from(CHECKPOINTS)).split(b"\n", 2)[2].partition(b"\n")
    part = data.draw(st.sampled_from(["words", "line", "memory"]))
    if part == "words":
        line = json.dumps(data.draw(corrupt_header(json.loads(line)))).encode()
    elif part == "line":
        line = data.draw(corrupt_bytes(line))
    else:
        memory = data.draw(corrupt_bytes(memory))
    whole = seal_checkpoint(line + b"\n" + memory)
    read_and_use(lambda: kr.resume(whole, max_steps=MOST), use_run)


@EXAMPLES
@given(data=st.data())
def test_any_archive_with_correct_checksums_is_a_path_or_is_refused(data, tmp_path_factory):
    file = tmp_path_factory.mktemp("archive") / "any"
    contents = unpack(PATHS[data.draw(st.sampled_from(ARCHIVED))](), file)
    name = data.draw(st.sampled_from(["head.npy", "head.npy", "scene.npy", *contents]))
    if name == "head.npy":
        contents[name] = encode(json.dumps(data.draw(corrupt_header(decode_head(contents)))))
    elif name == "scene.npy":
        text = str(np.load(io.BytesIO(contents[name])))
        contents[name] = encode(data.draw(corrupt_text(text)).encode("utf-8", "replace").decode())
    else:
        contents[name] = data.draw(corrupt_bytes(contents[name]))
    with zipfile.ZipFile(file, "w") as archive:
        for each, content in contents.items():
            archive.writestr(each, content)
    read_and_use(lambda: kr.load(file), use_path)


@EXAMPLES
@given(data=st.data())
def test_damaged_bytes_of_a_path_are_refused_or_change_nothing(data, tmp_path_factory):
    file = tmp_path_factory.mktemp("path") / "any"
    path = PATHS[data.draw(st.sampled_from(ARCHIVED))]()
    path.save(file)
    file.write_bytes(data.draw(corrupt_bytes(file.read_bytes())))
    # a damaged byte that is not noticed belongs to metadata such as a date
    read_and_use(lambda: kr.load(file), lambda again: check_same_paths(path, again))


@pytest.mark.parametrize(
    "words",
    [
        {},
        {"want": ("nutation", "q")},
        {"digits": 20, "max_steps": 9},
        {"tangents": "start"},
        {"events": kr.events.nutation()},
        {"method": "geometric", "error": 1e-3},
    ],
)
def test_the_path_of_many_tops_is_loaded_as_it_was_saved(tmp_path, words):
    tops = kr.scenes.asymmetric.vary(gravity=[0.5, 1.0], spin=[[5.0], [6.0], [7.0]], tilt=0.3)
    saved = kr.solve(tops, [0.0, 1.0, 9.0], **words)
    saved.save(tmp_path / "tops.npz")
    path = kr.load(tmp_path / "tops.npz")
    assert path.scene.axes == tops.axes and path.scene[2, 1] == tops[2, 1]
    assert path.to_pandas("q").equals(saved.to_pandas("q"))
    assert path.status.tolist() == saved.status.tolist() and path.want == saved.want
    assert [path[i, 0].stats for i in range(3)] == [saved[i, 0].stats for i in range(3)]
    assert path.message((2, 1)) == saved.message((2, 1))
    assert path.events.states.tobytes() == saved.events.states.tobytes()
    if "digits" in words:
        assert path.q_low.tobytes() == saved.q_low.tobytes()
    if "tangents" in words:
        assert path.tangents.tobytes() == saved.tangents.tobytes()
