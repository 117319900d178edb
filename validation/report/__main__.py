"""Command-line interface of the report, run as `python -m validation.report`."""

from .main import main

raise SystemExit(main())
