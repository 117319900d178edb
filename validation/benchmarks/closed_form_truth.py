"""Reference states for tests/c/test_exact.c, computed by quadrature with at least 50 digits.

    python -m validation.benchmarks.closed_form_truth > tests/c/exact_truth.h

The quadrature is independent of the formulas under test.
"""

import argparse
from textwrap import fill

from ..references import exact_cases as cases
from ..references.quadrature import Euler, Lagrange
from .kowalewski_truth import format_row

TIMES = (7.0, 1e6)


def reference_solution(case):
    """Return the reference solution of a Lagrange top or a free rigid body."""
    if cases.is_lagrange(case):
        i1, i3, lever, q, m = case
        return Lagrange(i1, i3, lever, cases.normalize(q), m)
    inertia, q, m = case
    return Euler(inertia, cases.normalize(q), m, cases.digits(case))


def main(argv=None):
    argparse.ArgumentParser(
        prog="python -m validation.benchmarks.closed_form_truth",
        description=__doc__.splitlines()[0],
    ).parse_args(argv)
    lines = []
    for name, case in {**cases.LAGRANGE, **cases.EULER}.items():
        inertia, lever = cases.inertia_and_lever(case)
        truth, q = reference_solution(case), cases.normalize(case[-2])
        for t in (*TIMES, *cases.TRANSITS.get(name, ())):
            attitude, momentum = truth(t)
            start = f"{lever:.17g}, {format_row(q)}, {format_row(case[-1])}, {t:g}"
            state = f"{{{format_row(attitude)}, {format_row(momentum)}}}"
            line = f'{{"{name}", {format_row(inertia)}, {start}, {state}}},'
            lines.append(fill(line, 100, initial_indent=" " * 4, subsequent_indent=" " * 5))
    print(HEADER.replace("ROWS", "\n".join(lines)), end="")


HEADER = """/* States of tops by quadrature in 50 digits or more;
 * `python -m validation.benchmarks.closed_form_truth` prints this file. */
/* clang-format off */
#ifndef KR_EXACT_TRUTH_H
#define KR_EXACT_TRUTH_H
#include "kreisel.h"

typedef struct exact_truth {
    const char *name;
    kr_vec3 inertia;
    double lever; /* mass gravity com, along T */
    kr_quat q;
    kr_vec3 m;
    double t;
    struct { kr_quat q; kr_vec3 m; } at;
} exact_truth;

static const exact_truth exact_truths[] = {
ROWS
};
#endif
"""

if __name__ == "__main__":
    main()
