"""Tests of saved paths and malicious files."""

import dataclasses
import errno
import io
import json
import os
import pickle
import random
import struct
import tracemalloc
import zipfile

import kreisel as kr
import numpy as np
import pytest
from tops import FREE, LAGRANGE

TOP = kr.scenes.asymmetric
LOWEST = kr.events.nutation(direction=1)
DAMPED = LAGRANGE.replace(damping=(0.1, 0.2, 0.3))
SOME = ("nutation", "frame", "energy")


def make_failed_path():
    with pytest.raises(kr.Error) as error:
        kr.solve(TOP, [0.5, 1.0, 9.0], max_steps=3)
    return error.value.path


def stream_part(**words):
    return list(kr.stream(TOP, [0.0, 1.0, 2.0, 3.0, 4.0], chunk=2, **words))[1]


def continue_run():
    run = kr.start(TOP, "strang", step=0.01, back=True)
    run.to(-1.0)
    return run.to(-2.0, every=10)


PATHS = {
    "states": lambda: kr.solve(TOP, [1.0, 2.0, 2.0]),
    "empty": lambda: kr.solve(TOP, []),
    "empty, wanted": lambda: kr.solve(TOP, [], want=SOME),
    "back": lambda: kr.solve(TOP, -2.0, "strang", step=0.1, every=3),
    "tolerance": lambda: kr.solve(TOP, 3.0, "extrap", tol=1e-6, step=0.1),
    "20 digits": lambda: kr.solve(TOP, [1.0, 2.0], digits=20),
    "30 digits back": lambda: kr.solve(TOP, -2.0, digits=30),
    "wanted": lambda: kr.solve(TOP, [1.0, 2.0], want=SOME),
    "wanted with low words": lambda: kr.solve(TOP, [1.0], digits=30, want=("q", "q_low")),
    "events": lambda: kr.solve(TOP, 20.0, events=[kr.events.loop(), LOWEST]),
    "events, wanted": lambda: kr.solve(TOP, 20.0, events=[LOWEST], want=SOME),
    "events with 30 digits": lambda: kr.solve(TOP, 20.0, events=[LOWEST], digits=30),
    "no event met": lambda: kr.solve(TOP, 0.1, events=[LOWEST]),
    "damped": lambda: kr.solve(DAMPED, -2.0, digits=20, events=[LOWEST]),
    "geometric": lambda: kr.solve(LAGRANGE, 5.0, "geometric", error=1e-6),
    "geometric, wanted": lambda: kr.solve(TOP, 5.0, "geometric", error=1e-6, want=SOME),
    "closed form": lambda: kr.exact(FREE)([3.0, -1.0]),
    "map": lambda: kr.exact(LAGRANGE, map="bobenko_suris", step=-0.01)([3, 1]),
    "failed": make_failed_path,
    "streamed": stream_part,
    "streamed, wanted": lambda: stream_part(want=SOME, digits=20),
    "led on": continue_run,
    "some": lambda: kr.solve(TOP, np.linspace(0.0, 1.0, 9), digits=20)[::-3],
    "between": lambda: kr.solve(TOP, 9.0)([3.0, 2.0]),
    "only": lambda: kr.solve(TOP, 9.0).only(("q", "apex")),
}


def data_without_quantities(value):
    """Return the dataclass fields of `value` as a dictionary."""
    names = [field.name for field in dataclasses.fields(value)]
    return {name: getattr(value, name, None) for name in names}


def same(a, b):
    """Return True if two values are equal; arrays must be equal bit for bit, and `b` read-only."""
    if isinstance(a, np.ndarray):
        bits = (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes())
        return bits and not b.flags.writeable
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[name], b[name]) for name in a)
    if isinstance(a, (kr.Path, kr.Events)):
        return type(a) is type(b) and same(data_without_quantities(a), data_without_quantities(b))
    return type(a) is type(b) and a == b


@pytest.fixture
def file(tmp_path):
    return tmp_path / "any name"


@pytest.mark.parametrize("kind", PATHS)
def test_a_path_is_loaded_bit_for_bit(kind, file):
    path = PATHS[kind]()
    path.save(str(file))
    again = kr.load(file)
    assert same(path, again) and repr(path) == repr(again)
    assert again.plan == path.plan and same(path, pickle.loads(pickle.dumps(again)))
    again.save(file)
    assert same(path, kr.load(str(file)))
    if path.want is None:
        assert again.error == path.error and same(path.energy, again.energy)


def test_a_path_can_be_read_with_numpy(file):
    path = kr.solve(TOP, 20.0, digits=20, events=[LOWEST])
    path.save(file)
    with np.load(file) as arrays:
        states = ["t", "q", "m", "q_low", "m_low"]
        event_names = [f"events_{name}" for name in (*states, "which", "direction")]
        assert arrays.files == ["head", "scene", *states, *event_names]
        assert all(np.array_equal(arrays[name], getattr(path, name)) for name in states)
        assert np.array_equal(arrays["events_m_low"], path.events.path.m_low)
        assert np.array_equal(arrays["events_which"], path.events.which)
        assert str(arrays["scene"]) == TOP.to_toml()
        head = json.loads(str(arrays["head"]))
    assert head["method"] == "taylor" and head["digits"] == 20 and head["stats"] == [*path.stats]


def test_equal_paths_give_equal_files(tmp_path):
    for name in "ab":
        kr.solve(TOP, 2.0).save(tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_load_recognizes_scenes_and_runs(file):
    TOP.to_toml(file)
    assert kr.load(file) == TOP
    run = kr.start(TOP, "strang", step=0.01)
    run.to(1.0)
    run.save(file)
    again = kr.load(file)
    assert isinstance(again, kr.Run) and same(again.to(2.0).states, run.to(2.0).states)


@pytest.mark.parametrize(
    "data",
    [b"", b"PK", b"PK\x05\x06" + bytes(18), b"\x00" * 99, b"\xff\xfe\xfd", b"t,q\n1,2\n", b"a = 1",
     b"kreisel run\n", b"kreisel run\n00000000\n{}\n", b"momentum = 3\n[body]\nmass = 'x'",
     b"\x93NUMPY\x01\x00", b"\x80\x04K\x01.", b"a = " + b"[" * 9999, b"#" * 2**21],
)  # fmt: skip
def test_files_of_other_programs_are_refused(data, file):
    file.write_bytes(data)
    with pytest.raises(ValueError, match="any name"):
        kr.load(file)


def test_missing_files_and_invalid_names_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError):
        kr.load(tmp_path / "none")
    with pytest.raises(OSError):
        kr.load(tmp_path)
    for value in (None, 3, b"name", kr.solve(TOP, 1.0)):
        with pytest.raises(TypeError):
            kr.load(value)


@pytest.fixture
def parts(tmp_path):
    """Return the files in the archive of a saved path."""
    kr.solve(TOP, 20.0, digits=20, events=[LOWEST]).save(tmp_path / "good")
    with zipfile.ZipFile(tmp_path / "good") as archive:
        return {info.filename: archive.read(info) for info in archive.infolist()}


def text(words):
    out = io.BytesIO()
    np.save(out, np.array(words))
    return out.getvalue()


def head_of(parts):
    return json.loads(str(np.load(io.BytesIO(parts["head.npy"]))))


def check_refusal(file, parts, match="any name", compress=zipfile.ZIP_STORED):
    with zipfile.ZipFile(file, "w", compress) as archive:
        for name, data in parts.items():
            archive.writestr(name, data)
    with pytest.raises(ValueError, match=match):
        kr.load(file)


WRONG = [
    *(None, True, 0, -1, 1.5, 10**400, float("nan")),
    *("", "taylr", [], [1], {}, {"want": 3}, [["q"]]),
]
WORDS = [
    "format",
    "method",
    "asked",
    "step",
    "tol",
    "digits",
    "want",
    "low",
    "stats",
    "choice",
    "events",
]
ALLOWED = {  # the values of WRONG that are valid in the header of a path
    "tol": (None,), "step": (None, -1, 1.5), "want": (None,), "choice": (None,), "events": (None,),
    "digits": (None,), "low": (True,), "asked": ("", "taylr"),
}  # fmt: skip


@pytest.mark.parametrize("word", WORDS)
def test_invalid_header_entries_are_refused(word, file, parts):
    head = head_of(parts)
    check_refusal(
        file, parts | {"head.npy": text(json.dumps({k: head[k] for k in head if k != word}))}
    )
    for value in WRONG:
        values = ALLOWED.get(word, ())
        if not any(type(value) is type(other) and value == other for other in values):
            check_refusal(file, parts | {"head.npy": text(json.dumps(head | {word: value}))})


def test_a_later_format_is_refused(file, parts):
    later = parts | {"head.npy": text(json.dumps(head_of(parts) | {"format": 2}))}
    check_refusal(file, later, "its format 2 belongs to a later version of kreisel")


@pytest.mark.parametrize("by", ["start", [], ["gravity", "start"], ["start", "start"], ["x"]])
def test_invalid_columns_of_tangents_are_refused(file, by):
    kr.solve(TOP, [0.0, 1.0], tangents=("start", "gravity")).save(file)
    with zipfile.ZipFile(file) as archive:
        parts = {info.filename: archive.read(info) for info in archive.infolist()}
    head = head_of(parts)
    assert head["tangents"]["by"] == ["start", "gravity"]
    head["tangents"]["by"] = by
    wrong = parts | {"head.npy": text(json.dumps(head))}
    check_refusal(file, wrong, "its tangents have the invalid columns")


@pytest.mark.parametrize("value", [None, "x", -1, True, [1], 10**400])
@pytest.mark.parametrize("i", range(4))
def test_invalid_stats_are_refused(i, value, file, parts):
    head = head_of(parts)
    head["stats"][i] = value
    check_refusal(file, parts | {"head.npy": text(json.dumps(head))})


def test_invalid_choices_are_refused(file):
    path = PATHS["geometric"]()
    path.save(file)
    with zipfile.ZipFile(file) as archive:
        parts = {info.filename: archive.read(info) for info in archive.infolist()}
    head = head_of(parts)
    for name in [field.name for field in dataclasses.fields(kr.StepChoice)]:
        for value in (None, [], {}):
            choice = head["choice"] | {name: value}
            check_refusal(file, parts | {"head.npy": text(json.dumps(head | {"choice": choice}))})


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_pipes_and_devices_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for name in (tmp_path / "pipe", "/dev/zero"):
        with pytest.raises(ValueError, match="not a regular file"):
            kr.load(name)


def npy(descr, shape, data, order="False"):
    header = f"{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data


class Evil:
    def __reduce__(self):
        return os.mkdir, ("harmed",)


def test_invalid_arrays_are_refused(file, parts, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    buffer = io.BytesIO()
    np.save(buffer, np.array([Evil()], dtype=object), allow_pickle=True)
    rows = len(np.load(io.BytesIO(parts["t.npy"])))
    bad = [
        b"", b"x", buffer.getvalue(), parts["q.npy"][:-1], parts["q.npy"] + b"x",
        npy("'<f8'", "(1000000000000,)", b""), npy("'<f8'", f"({rows}, 4)", b""),
        npy("'<f8'", "(0, 99999999999999999999999999)", b""), npy("'<f8'", "()", bytes(8)),
        npy("'|O'", "(1,)", pickle.dumps(Evil())), npy("'<U99999999999'", "()", b""),
        npy("'<f8'", "(-1, 4)", b""), npy("'>f8'", f"({rows}, 4)", bytes(32 * rows)),
        npy("'<f8'", f"({rows}, 4)", bytes(32 * rows), "True"), npy("'<f8'", "(" * 9000, b""),
        npy("'<i4'", f"({rows}, 4)", bytes(16 * rows)),
        npy("'<f8'", f"({rows}, 5)", bytes(40 * rows)),
        npy("'<f8'", "(1, 4)", bytes(32)), b"\x93NUMPY\x01\x00\xff\xff{" + bytes(99),
    ]  # fmt: skip
    for name in parts:
        for data in bad:
            is_valid = name in ("t.npy", "events_t.npy") and data == npy("'<f8'", "()", bytes(8))
            if not is_valid:
                check_refusal(file, parts | {name: data})
        rest = {other: parts[other] for other in parts if other != name}
        if name not in ("q_low.npy", "events_q_low.npy"):
            check_refusal(file, rest, "it has no member ")
    wide = npy("'<f8'", f"({rows}, 5)", bytes(40 * rows))
    check_refusal(file, parts | {"q.npy": wide}, "its q has the wrong size")
    assert not (tmp_path / "harmed").exists()


def test_invalid_headers_and_scenes_are_refused(file, parts):
    for words in ("", "[]", "3", "{", "[" * 9000, '{"format": 1}', "\0", "null"):
        check_refusal(file, parts | {"head.npy": text(words)})
    for words in ("", "x = 1", "momentum = 3", "[body]", "[" * 9000, TOP.to_toml() * 2):
        check_refusal(file, parts | {"scene.npy": text(words)})
    lone = npy("'<U1'", "()", b"\x00\xd8\x00\x00")
    check_refusal(file, parts | {"head.npy": lone})
    for name, data in (("which", [-1]), ("direction", [0]), ("direction", [2])):
        array = np.load(io.BytesIO(parts[f"events_{name}.npy"]))
        out = io.BytesIO()
        np.save(out, np.resize(np.array(data, np.int32), array.shape))
        check_refusal(file, parts | {f"events_{name}.npy": out.getvalue()}, "events are damaged")


@pytest.mark.parametrize("compress", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_a_decompression_bomb_is_refused_before_it_is_read(compress, file, parts):
    check_refusal(file, parts, "compressed", compress)
    bomb = parts | {"q.npy": bytes(1 << 24)}
    tracemalloc.start()
    try:
        refused_at = file.with_name("any name of a bomb")
        with zipfile.ZipFile(refused_at, "w", compress) as archive:
            for name, data in bomb.items():
                archive.writestr(name, data)
        del bomb, data
        tracemalloc.reset_peak()
        before = tracemalloc.get_traced_memory()[0]
        with pytest.raises(ValueError, match="compressed"):
            kr.load(refused_at)
        # [bytes]; reading the whole file would take 2^24
        assert tracemalloc.get_traced_memory()[1] - before < 1 << 21
    finally:
        tracemalloc.stop()


def test_load_needs_less_memory_than_2_5_times_the_file_size(file):
    kr.exact(LAGRANGE)(np.linspace(0.0, 9.0, 100_000)).save(file)
    kr.load(file)
    tracemalloc.start()
    try:
        kr.load(file)
        assert tracemalloc.get_traced_memory()[1] < 2.5 * file.stat().st_size  # [bytes]
    finally:
        tracemalloc.stop()


def test_members_that_share_their_bytes_are_refused(file, parts):
    with zipfile.ZipFile(file, "w") as archive:
        for name, data in parts.items():
            archive.writestr(name, data)
        archive.writestr("x.npy", bytes(1 << 16))
        member = archive.infolist()[-1]
        archive.filelist += [member] * 1000
    with pytest.raises(ValueError, match="larger than the file"):
        kr.load(file)


def test_damaged_bytes_are_refused_or_change_nothing(file):
    path = PATHS["events with 30 digits"]()
    path.save(file)
    good = file.read_bytes()
    rng = random.Random(1)
    for _ in range(300):
        data = bytearray(good)
        for _ in range(rng.choice((1, 1, 4))):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        file.write_bytes(data)
        try:
            assert same(path, kr.load(file))  # the damaged byte belongs to metadata such as a date
        except ValueError as error:
            assert "any name" in str(error)
    for _ in range(100):
        file.write_bytes(good[: rng.randrange(len(good))])
        with pytest.raises(ValueError, match="any name"):
            kr.load(file)


def test_a_path_is_saved_atomically(tmp_path, monkeypatch):
    path, file = kr.solve(TOP, 1.0), tmp_path / "top"
    with pytest.raises(FileNotFoundError):
        path.save(tmp_path / "none" / "top")
    path.save(file)
    assert os.listdir(tmp_path) == ["top"] and same(path, kr.load(file))
    write, counts = os.write, []

    def write_half_and_fail(descriptor, data):
        if counts:
            raise OSError(errno.ENOSPC, "No space left on device")
        counts.append(write(descriptor, data[: len(data) // 2]))
        return counts[0]

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", write_half_and_fail)
        with pytest.raises(OSError, match="No space left"):
            kr.solve(TOP, 2.0).save(file)
    assert counts[0] > 100 and os.listdir(tmp_path) == ["top"] and same(path, kr.load(file))


def test_a_path_of_an_unknown_method_is_refused(file, parts):
    head = head_of(parts) | {"method": "gsl_of_old", "digits": None}
    check_refusal(file, parts | {"head.npy": text(json.dumps(head))}, "unknown method 'gsl_of_old'")
