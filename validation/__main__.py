"""The command line of the validation report, started with `python -m validation`.

kreisel report [scene.toml ...] [--quick | --full | --thesis] [--only PART[,...]] [--out report]
"""

from .report import main as report
from .thesis import chapter


def main(argv=None):
    parser, size = report.make_parser()
    size.add_argument(
        "--thesis",
        action="store_true",
        help="write only the chapter on the thesis, thesis.html",
    )
    options = parser.parse_args(argv)
    return chapter.main(options.out) if options.thesis else report.make_report(options)


if __name__ == "__main__":
    raise SystemExit(main())
