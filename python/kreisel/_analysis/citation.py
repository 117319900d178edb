"""References of the methods behind a result, as BibTeX."""

from __future__ import annotations

import re
from pathlib import Path as File
from typing import Any

import numpy as np

from .._core import version
from .._model.scene import Scene
from .._options.methods import AUTO, EXACT, FALLBACK, Method, methods
from .._results.path import Events, Path
from .._solve.chaos import Chaos
from .._solve.exact import Exact, ExactTorus
from .._utils.arguments import short_repr, unknown_name_message


def citation(result: object = None) -> str:
    """Return the references that a publication with `result` should cite, as BibTeX.

        print(kr.citation(path))

    The references are kreisel, the thesis that it implements, and the sources of the methods that
    computed the result: a Path, Events, Section, Chaos, Reductions, Run, Exact, ExactTorus or Fit,
    or a method or its name. The sources of a closed form depend on the kind of the body.

    Raises TypeError for other objects, and ValueError for an unknown method.
    """
    topics = {"kreisel"} if result is None else {"kreisel"} | _list_topics(result)
    entries = []
    text = File(__file__).with_name("references.bib").read_text("utf-8")
    for line in text.splitlines():
        entry, _, names = line.rstrip("}").rpartition(", topics={")
        if topics & {*names.split()}:
            entries.append(re.sub(r", (\w+)=\{", r",\n  \1 = {", entry) + "\n}")
    return "\n\n".join(entries).replace("VERSION", version) + "\n"


def _list_topics(result: Any) -> set[str]:
    """Return the methods that computed `result`, and the kinds of its bodies with a closed form."""
    if isinstance(result, Method):
        return {result.name}
    if isinstance(result, str):
        if result not in methods:
            raise ValueError(f"result: {unknown_name_message('method', result, methods)}")
        return {result}
    if isinstance(result, Events):
        result = result.path
    scene = getattr(result, "scene", None)
    if not isinstance(scene, Scene):
        raise TypeError(
            f"result must be a path, another result or a method, not {short_repr(result)}"
        )
    is_exact = isinstance(result, Exact | ExactTorus)
    method = getattr(result, "method", EXACT if is_exact else FALLBACK)
    topics = {str(method)}
    if method == AUTO:  # each top has its own method
        topics = {EXACT, FALLBACK}
        if isinstance(result, Path) and result.plan.closed_form in (0, scene.size):
            topics = {EXACT if result.plan.closed_form else FALLBACK}
    if EXACT in topics:
        topics.remove(EXACT)
        topics.update(np.unique(scene.body.kind))
    if isinstance(result, Chaos):
        topics.add("Chaos")
    return topics
