"""Tests that randomly modified files are either read or rejected.

The tests change, delete or duplicate bytes of valid files, and replace words in TOML files. Some
tests then recompute the checksum, so that the modified contents are read. The environment variable
KREISEL_CALLS sets how many modified files each test tries.
"""

import io
import json
import re
import zipfile
import zlib

import kreisel as kr
import numpy as np
import pytest
from argument_values import LOW, MOST, TOP
from hypothesis import given
from hypothesis import strategies as st
from test_api_fuzz import EXAMPLES, LETTERS

pytestmark = pytest.mark.filterwarnings(
    "ignore:no body has this inertia", "ignore:.*unphysical", "ignore:.*only up to rounding"
)
SPINNING = """gravity = 2
[spinning]
spin = 8.5
tilt = 0.25
degrees = false
[body.cuboid]
half = [0.5, 1, 2]
pivot = [0, 0, -1]
"""
TEXTS = [TOP.to_toml(), kr.scenes.thesis.replace(damping=0.1).to_toml(), SPINNING]
TOKENS = ["nan", "-inf", "-1", "0", "1e400", "1e308", "5e-324", "[]", "{}", "true", '"x"', "[[1]]"]
TOKENS += [
    "9" * 400,
    "1979-05-27",
    "[" * 500,
    "\0",
    "\udce9",
    "é",
    "mass",
    "[body]",
    "[0, 0, 1]",
    "",
]
VALUES = [None, True, -1, 0, 1, 2.5, 1e308, 5e-324, 10**30, "", "x", "taylor", [], [1], {}, [[]]]
VALUES += [{"x": 1}, ["energy"], float("nan"), float("inf"), "9" * 5000, [None] * 4, "state", "1"]
PATHS = [
    kr.solve(TOP, [1.0, 2.0], digits=20),
    kr.solve(TOP, 20.0, events=[LOW]),
    kr.solve(TOP, [1.0, 2.0], want=("nutation", "frame")),
    kr.solve(kr.scenes.thesis, 2.0, "geometric", error=1e-6),
]


def start_checkpoint(**words):
    run = kr.start(TOP, max_steps=MOST, **words)
    run.to(0.5)
    return run.checkpoint


CHECKPOINTS = [
    start_checkpoint(),
    start_checkpoint(method="strang", step=0.125),
    start_checkpoint(events=[LOW], digits=20),
]


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("files") / "any"


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
    if draw(st.booleans()):
        return draw(corrupt_bytes(text.encode())).decode("utf-8", "surrogateescape")
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
        result = load()
        use(result)
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
@given(st.sampled_from(TEXTS).flatmap(corrupt_text))
def test_any_text_is_a_scene_or_is_refused(text):
    read_and_use(lambda: kr.Scene.from_toml(text + "\n"), use_scene)


@EXAMPLES
@given(st.sampled_from(CHECKPOINTS).flatmap(corrupt_bytes))
def test_any_bytes_are_a_run_or_are_refused(data):
    read_and_use(lambda: kr.resume(data, max_steps=MOST), use_run)


@EXAMPLES
@given(st.data())
def test_any_checkpoint_with_a_correct_checksum_is_a_run_or_is_refused(data):
    start, _, body = data.draw(st.sampled_from(CHECKPOINTS)).partition(b"\n")
    _, _, body = body.partition(b"\n")
    line, _, memory = body.partition(b"\n")
    if data.draw(st.booleans()):
        line = json.dumps(data.draw(corrupt_header(json.loads(line)))).encode()
    else:
        line, memory = data.draw(
            st.tuples(corrupt_bytes(line), st.just(memory))
            | st.tuples(st.just(line), corrupt_bytes(memory))
        )
    body = line + b"\n" + memory
    whole = start + b"\n%08x\n" % zlib.crc32(body) + body
    read_and_use(lambda: kr.resume(whole, max_steps=MOST), use_run)


def members(path, file):
    """Save a path, and return a dictionary of the members of the saved archive."""
    path.save(file)
    with zipfile.ZipFile(file) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def array(text):
    """Return the bytes of a NumPy file that contains `text`."""
    out = io.BytesIO()
    np.save(out, np.array(text))
    return out.getvalue()


@EXAMPLES
@given(data=st.data())
def test_any_archive_is_a_path_or_is_refused(data, file):
    """Check that modified archives with correct checksums are either read or rejected."""
    contents = members(data.draw(st.sampled_from(PATHS)), file)
    name = data.draw(st.sampled_from(["head.npy", "head.npy", "scene.npy", *contents]))
    text = str(np.load(io.BytesIO(contents[name]))) if name in ("head.npy", "scene.npy") else ""
    if name == "head.npy":
        contents[name] = array(json.dumps(data.draw(corrupt_header(json.loads(text)))))
    elif name == "scene.npy":
        contents[name] = array(data.draw(corrupt_text(text)).encode("utf-8", "replace").decode())
    else:
        contents[name] = data.draw(corrupt_bytes(contents[name]))
    with zipfile.ZipFile(file, "w") as archive:
        for each, content in contents.items():
            archive.writestr(each, content)
    read_and_use(lambda: kr.load(file), use_path)


@EXAMPLES
@given(data=st.data())
def test_any_bytes_are_a_path_or_are_refused(data, file):
    data.draw(st.sampled_from(PATHS)).save(file)
    file.write_bytes(data.draw(corrupt_bytes(file.read_bytes())))
    read_and_use(lambda: kr.load(file), lambda result: None)


def test_a_damaged_archive_has_a_short_message(file):
    PATHS[0].save(file)
    data = bytearray(file.read_bytes())
    data[26:28] = (2000).to_bytes(
        2, "little"
    )  # the length of the first name, which then includes binary data
    file.write_bytes(data)
    with pytest.raises(ValueError, match="the archive is damaged: File name in directory") as error:
        kr.load(file)
    assert len(str(error.value)) < 400
