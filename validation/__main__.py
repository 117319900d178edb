"""The front: python -m validation, and `kreisel report`, which calls main here.

kreisel report [scene.toml ...] [--quick | --full | --thesis] [--only PART[,...]] [--out report]
"""

from .report import main as report
from .thesis import chapter


def main(argv=None):
    parser, size = report.make_parser()
    size.add_argument(
        "--thesis",
        action="store_true",
        help="the chapter on the thesis alone, thesis.html: its figures, sentences and errata",
    )
    asked = parser.parse_args(argv)
    return chapter.main(asked.out) if asked.thesis else report.make_report(asked)


if __name__ == "__main__":
    raise SystemExit(main())
