"""A cache of results, from which an interrupted report can be continued.

The first line of the cache file describes the conditions under which the results were computed.
Each further line contains one result as JSON. If the present conditions differ from those in the
file, a new file is started.
"""

import json
import os


class ResultStore:
    def __init__(self, file, fingerprint):
        file.parent.mkdir(parents=True, exist_ok=True)
        self.file, self.known = file, {}
        text = file.read_text() if file.exists() else ""
        lines = text.splitlines()
        if lines and lines[0] == json.dumps(fingerprint):
            self.read(lines[1:])
            if not text.endswith("\n"):
                file.write_text(text + "\n")  # ends a truncated last line
        else:
            file.write_text(json.dumps(fingerprint) + "\n")

    def read(self, lines):
        for line in lines:
            try:
                key, value = json.loads(line)
            except ValueError:
                continue  # a truncated line
            self.known[key] = value

    def put(self, key, value):
        with self.file.open("a") as file:
            file.write(json.dumps([key, value]) + "\n")
        self.known[key] = value

    def under(self, prefix):
        """Return the stored results whose keys start with `prefix`."""
        return [value for key, value in self.known.items() if key.startswith(prefix)]


def write_atomic(file, text):
    """Write a file atomically, so that the previous version survives an interruption."""
    new = file.with_name(f".{file.name}.{os.getpid()}.new")
    try:
        with new.open("w", encoding="utf-8", newline="") as out:
            out.write(text)
            out.flush()
            os.fsync(out.fileno())
        os.replace(new, file)
    finally:
        new.unlink(missing_ok=True)
