"""A worker that is killed in the midst of a part; in a file that workers import quickly."""

import os
import signal
from pathlib import Path

from kreisel._sweeping.folder import Folder


def killed_once(flag):
    """Has the worker that puts part 2 in its place be killed before it does; the next one is
    not."""
    put = Folder.put

    def first(self, i, rows):
        if i == 2 and not os.path.exists(flag):
            Path(flag).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return put(self, i, rows)

    Folder.put = first
