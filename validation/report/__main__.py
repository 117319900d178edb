"""The command line of the report, started with `python -m validation.report`."""

from .main import main

raise SystemExit(main())
