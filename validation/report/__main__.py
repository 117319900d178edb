"""The command `python -m validation.report`."""

from .main import main

raise SystemExit(main())
