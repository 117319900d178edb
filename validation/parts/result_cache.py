"""What a report has found, kept as it is found: interrupted, it keeps what it has, and run again it
continues from there.

The file is JSON, one finding a line. The first line says what it was found with; found with
anything else, it is begun anew.
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
                file.write_text(text + "\n")  # what comes next is not part of what was cut
        else:
            file.write_text(json.dumps(fingerprint) + "\n")

    def read(self, lines):
        for line in lines:
            try:
                key, value = json.loads(line)
            except ValueError:
                continue  # it was cut off while it was written
            self.known[key] = value

    def put(self, key, value):
        with self.file.open("a") as file:
            file.write(json.dumps([key, value]) + "\n")
        self.known[key] = value

    def under(self, prefix):
        """Gives what was found under keys that begin so, in the order of finding."""
        return [value for key, value in self.known.items() if key.startswith(prefix)]


def write_atomic(file, text):
    """Writes a file whole or not at all: what is ended in the midst leaves the one before."""
    new = file.with_name(f".{file.name}.{os.getpid()}.new")
    try:
        with new.open("w", encoding="utf-8", newline="") as out:
            out.write(text)
            out.flush()
            os.fsync(out.fileno())
        os.replace(new, file)
    finally:
        new.unlink(missing_ok=True)
