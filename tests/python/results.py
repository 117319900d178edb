"""What the package gives for many lines of Python, in short: results.txt has the lines, each with a
hash of what is told of its value to six digits. A change that moves any of them is seen.

python tests/python/results.py writes the hashes anew; with a number, it tells all of that line.
"""

import dataclasses
import hashlib
import importlib
import os
import re
import sys
import warnings
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import kreisel as kr
import numpy as np
from click.testing import CliRunner
from inside import cli

FILE = Path(__file__).with_suffix(".txt")
NUMBER = re.compile(r"-?\d+\.\d+(?:e[-+]?\d+)?|-?\d+e[-+]?\d+")
OTHER = re.compile(r"\b(?:avx512|avx2|neon|base)\b|,? gsl_\w+")  # on another machine
SMALLEST = 1e-9  # what is less may be a rounding
SMALLEST_TOLD = 1e-15  # in words
STYLE = "color", "linewidth", "alpha", "zorder", "linestyle", "marker", "markersize"
LEFT_OUT = {"seconds", "folder", "scenes", "checkpoint"}  # times, places, bits; what is long


def told(thing, depth=3):
    """A text that tells a value."""
    if isinstance(thing, str):
        thing = thing.replace(os.getcwd(), "")
        return OTHER.sub("", NUMBER.sub(lambda found: in_short(float(found[0])), thing))
    if isinstance(thing, bool | int | None.__class__ | type | np.dtype):
        return repr(thing)
    if isinstance(thing, Mapping):
        return "{" + ", ".join(f"{key}: {told(thing[key], depth)}" for key in thing) + "}"
    if isinstance(thing, np.ndarray | float | complex | np.generic):
        return of_numbers(np.asarray(thing))
    if isinstance(thing, list | tuple) and not hasattr(thing, "_fields"):
        return "[" + ", ".join(told(part, depth) for part in thing) + "]"
    if hasattr(thing, "get_lines"):
        return of_axes(thing)
    if hasattr(thing, "iloc"):  # a table of pandas, whose text depends on the terminal
        return told([dict(thing.attrs), thing.reset_index().to_dict("list")])
    return of_members(thing, depth)


def in_short(x):
    return f"{0.0 if abs(x) < SMALLEST_TOLD else x:.5g}"


def of_numbers(x):
    if x.dtype.kind not in "fiub":
        return told(x.view(float), 1) if x.dtype.kind == "c" else told(repr(x.tolist()))
    x = x.astype(float)
    largest = float(np.abs(x[np.isfinite(x)]).max(initial=0.0))
    if largest < SMALLEST:
        return f"{x.shape} none, {int(np.isnan(x).sum())} nan"
    shares = np.nan_to_num(1e6 * x / largest, nan=7e6, posinf=8e6, neginf=-8e6)
    whole = np.rint(shares).astype(np.int64)
    return f"{x.shape} of {largest:.6g}: {hashlib.sha256(whole.tobytes()).hexdigest()[:8]}"


def of_axes(axes):
    """What is drawn: lines and areas, and what is written beside them."""
    lines = [line.get_xydata() for line in axes.get_lines()]
    areas = [path.vertices for area in axes.collections for path in area.get_paths()]
    colours = [area.get_facecolor() for area in axes.collections]
    words = axes.get_title(), axes.get_xlabel(), axes.get_ylabel(), axes.get_aspect()
    place = np.array([*axes.get_xlim(), *axes.get_ylim(), *axes.get_position().bounds])
    return told([list(words), place, lines, areas, colours, [t.get_text() for t in axes.texts]])


def of_members(thing, depth):
    """Its name, and what is public of it."""
    parts = [told(repr(thing))]
    if depth and type(thing).__module__.startswith("kreisel"):
        for name in sorted(public(thing) - LEFT_OUT):
            try:
                value = getattr(thing, name)
            except (ValueError, TypeError, AttributeError, IndexError, kr.Error) as refused:
                value = f"{type(refused).__name__}: {refused}"
            if not callable(value) or isinstance(value, type):
                parts.append(f"{name} = {told(value, depth - 1)}")
    return "\n".join(parts)


def public(thing):
    fields = {field.name for field in dataclasses.fields(thing)} if is_record(thing) else set()
    return {name for name in {*dir(thing), *fields} if name[0] != "_"}


def is_record(thing):
    return dataclasses.is_dataclass(thing) and not isinstance(thing, type)


def value_of(line):
    """What a line gives, or how it is refused."""
    try:
        return eval(line, names())
    except (ValueError, TypeError, KeyError, kr.Error) as refused:
        return [f"{type(refused).__name__}: {refused}", getattr(refused, "path", None)]


def looks(picture):
    """How the parts of a picture are drawn, beside where."""
    return [picture[0].figure.get_size_inches(), *map(look, picture)]


def look(axes):
    lines = [
        [getattr(line, f"get_{name}")() for name in STYLE]
        for line in [*axes.get_lines(), *axes.get_xgridlines()[:1], *axes.get_ygridlines()[:1]]
    ]
    sides = [axes.spines[side].get_visible() for side in ("top", "right", "left")]
    sizes = [text.get_fontsize() for text in (axes.title, axes.xaxis.label, axes.yaxis.label)]
    ticks = [[*axes.get_xticks()], [*axes.get_yticks()], axes.xaxis.get_tick_params()]
    arrows = [[list(text.xy), list(text.xyann), text.arrowprops] for text in arrows_of(axes)]
    tick = axes.yaxis.get_major_ticks()[0]
    small = tick.label1.get_fontsize(), tick.tick1line.get_markersize()
    return [lines, sides, sizes, ticks, arrows, list(small), axes.axison]


def arrows_of(axes):
    return [text for text in axes.texts if hasattr(text, "arrowprops")]


def frames(film):
    """What each frame of a film shows, in whatever order its faces are drawn."""
    return [frame_of(figure) for figure in film._figures()]


def frame_of(figure):
    (axes,) = figure.axes
    (solid,) = axes.collections
    corners = np.array([path.vertices[:4] for path in solid.get_paths()])
    lines = [[line.get_zorder(), line.get_xydata()] for line in axes.get_lines()]
    told_of = [[text.get_text(), text.get_position(), text.get_fontsize()] for text in axes.texts]
    coloured = np.einsum("nij,nk->ijk", corners, solid.get_facecolor())
    return [figure.dpi, solid.get_zorder(), coloured, lines, told_of]


def shell(line):
    """What the command line says to a line, and the code with which it ends."""
    done = CliRunner(env={"COLUMNS": "100"}).invoke(cli.main, line.split())
    return [done.exit_code, " ".join(done.output.split())]


@cache
def names():
    """What the lines may speak of."""
    cusps, cone = kr.scenes.cusps, kr.Body.cone(0.3, 1.2, (0, 0, -0.9), mass=0.5)
    spun = kr.Scene.spinning(cone, 30.0, 0.4, gravity=9.81)
    drawing, sweeping = (
        [importlib.import_module(f"kreisel.{room}.{name}") for name in of]
        for room, of in {
            "_drawing": ["charts", "solids"],
            "_sweeping": ["start_words", "planned", "asked", "folder"],
        }.items()
    )
    of_sweeps = {module.__name__.rpartition(".")[2]: module for module in sweeping}
    return {
        **of_sweeps,
        "charts": drawing[0],
        "solids": drawing[1],
        "looks": looks,
        "shell": shell,
        "frames": frames,
        "BOX": kr.Scene(kr.Body(0.5, (1.0, 1.1, 0.5), (0, 0, 0.9)), momentum=(0.2, 0, 1.0)),
        "kr": kr,
        "np": np,
        "TOP": kr.scenes.asymmetric,
        "THESIS": kr.scenes.thesis,
        "CUSPS": cusps,
        "STEADY": kr.scenes.steady_precession,
        "FREE": kr.scenes.dzhanibekov,
        "KOWALEWSKI": kr.scenes.kowalewski,
        "CONE": cone,
        "PLATE": kr.Body.cuboid((0.5, 0.8, 0.1), (0.1, 0.2, -0.3), density=2.0),
        "MANY": spun.vary(spin=[10.0, 30.0, 50.0], tilt=[[0.1], [0.7]]),
        "LOW": kr.events.nutation(direction=1),
        "SWAY": kr.solve(cusps, np.linspace(0.0, 20.0, 201)),
        "KEPT": {"nutation": ("min", "max", "mean", "variance", "last"), "apex": "where_max"},
    }


def lines():
    """Each line of the file, with its hash."""
    rows = (row.rpartition("  ") for row in FILE.read_text().splitlines())
    return {line.strip(): told_hash for line, _, told_hash in rows}


def hash_of(line):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return hashlib.sha256(told(value_of(line)).encode()).hexdigest()[:8]


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(told(value_of(list(lines())[int(sys.argv[1]) - 1])))
    else:
        FILE.write_text("".join(f"{line}  {hash_of(line)}\n" for line in lines()))
