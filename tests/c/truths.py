"""Write tests/truths.json as rows of C for tests/c/truth.h: python tests/c/truths.py FILE"""

import json
import sys
from fractions import Fraction
from pathlib import Path


def format_numbers(numbers):
    return "{" + ", ".join(float(x).hex() for x in numbers) + "}"


def split(numbers):
    """Return the numbers as doubles, and what is lost."""
    exact = [Fraction(x) for x in numbers]
    high = [float(x) for x in exact]
    return high, [float(x - Fraction(y)) for x, y in zip(exact, high, strict=True)]


def format_row(row):
    scene, none = row["scene"], [0, 0, 0]
    body = scene["body"]
    is_tensor = isinstance(body["inertia"][0], list)
    tensor = [x for line in body["inertia"] for x in line] if is_tensor else [0] * 9
    damping = scene.get("damping", none)
    start = format_numbers(scene["attitude"]), format_numbers(scene["momentum"])
    fields = {
        "name": json.dumps(row["name"]),
        "family": json.dumps(row["family"]),
        "tensor": format_numbers(tensor),
        "scene.body.mass": float(body["mass"]).hex(),
        "scene.body.inertia": format_numbers(none if is_tensor else body["inertia"]),
        "scene.body.com": format_numbers(body["com"]),
        "scene.body.axes": "{1, 0, 0, 0}",
        "scene.body.rotor": format_numbers(body.get("rotor", none)),
        "scene.gravity": float(scene["gravity"]).hex(),
        "scene.start": f"{{0.0, {start[0]}, {start[1]}}}",
        "scene.damping": format_numbers(damping),
        "scene.turning": format_numbers(scene.get("turning", none)),
        "scene.shaking": format_numbers(scene.get("shaking", none)),
        "scene.friction": float(scene.get("friction", 0)).hex(),
        "scene.gradient": float(scene.get("gradient", 0)).hex(),
    }
    (q, q_low), (m, m_low) = split(row["q"]), split(row["m"])
    t = float(row["t"]).hex()
    fields["end"] = f"{{{t}, {format_numbers(q)}, {format_numbers(m)}}}"
    fields["low"] = f"{{0.0, {format_numbers(q_low)}, {format_numbers(m_low)}}}"
    return "{" + ", ".join(f".{name} = {value}" for name, value in fields.items()) + "},\n"


def main(file):
    rows = json.loads(Path(__file__).parents[1].joinpath("truths.json").read_text())
    text = "".join(map(format_row, rows))
    if not file.exists() or file.read_text() != text:  # keep its time if nothing changes
        file.write_text(text)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
