"""Write the library as one file, kreisel.c, beside a copy of its header kreisel.h.

    python3 cmake/amalgamate.py [FOLDER]        the default is build/amalgamation

A file that names what it exports by KR_NAME (math/isa.h) is compiled once for each instruction
set. In kreisel.c, each of these compilations is a section with copies of all static functions that
the file includes. A prefix makes the names of a section unique. All other files follow one another
unchanged, with each header before its first use.
"""

import re
import sys
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CSRC = ROOT / "csrc"
PUBLIC = CSRC / "kreisel.h"
LEFT_OUT = ("/gsl/", "/wasm.c")  # as in CMakeLists.txt

COMMENT = re.compile(r"/\*.*?\*/", re.S)
INCLUDE = re.compile(r'#\s*include (?:"(.+)"|([A-Z]\w+))')
DEFINE = re.compile(r"#\s*define (\w+)", re.M)
SWITCH = re.compile(r"#\s*(?:if defined|ifdef) (\w+)$")
GUARD = re.compile(r"\A((?:/\*.*?\*/\s*)*)#ifndef (\w+_H)\n#define \2\n(.*)#endif\n\Z", re.S)
EXPORT = re.compile(r"^(?!static|INLINE)[\w *]*\bKR_NAME\((\w+)\)", re.M)
TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|(?<![\w.])(?<!->)[A-Za-z_]\w*')
TYPE = re.compile(TOKEN.pattern + r"\b(?!\s*[;,[=)])")  # a name in a struct that is no member

HEAD = """\
/* kreisel {version}: the library in one file, written by cmake/amalgamate.py.
 * Compile: cc -O2 -c kreisel.c. Link with -lm. With -DKR_ONE_ISA the library has only the
 * instruction set that the compiler's options name; the file then compiles faster.
 *
{license} */
#include "kreisel.h"
{system}
/* Results depend on the order of operations. Products and sums must not be fused, also if the
 * compiler's options allow it. Loops are not vectorized, because gcc 12 fuses in them. */
#if defined __clang__
#  pragma clang diagnostic push
#  pragma clang diagnostic ignored "-Wunused-function"
#  pragma STDC FP_CONTRACT OFF
#elif defined __GNUC__
#  pragma GCC push_options
#  pragma GCC optimize({options})
#elif defined _MSC_VER
#  pragma fp_contract(off)
#endif
#if defined __x86_64__ && (defined __clang__ || (defined __GNUC__ && __GNUC__ >= 12)) && \\
    !defined _MSC_VER && !defined KR_ONE_ISA && !defined KR_PLAIN
{with_isas}#endif
"""
FOOT = """
#if defined __clang__
#  pragma clang diagnostic pop
#elif defined __GNUC__
#  pragma GCC pop_options
#endif
"""
STRICT = ("fp-contract=off", "no-tree-vectorize", "no-tree-slp-vectorize", "no-math-errno")


@dataclass
class Unit:
    """A source with all that it includes: `parts` are pairs of a file and a piece of its text."""

    source: Path
    switches: set
    parts: list = field(default_factory=list)
    defined: set = field(default_factory=set)
    seen: set = field(default_factory=set)

    def add(self, file):
        """Add the text of a file. Its lines for another value of a switch are left out."""
        guarded = GUARD.match(file.read_text())
        text = guarded[1] + guarded[3] if guarded else file.read_text()
        piece, stack = [], []
        for line in text.splitlines(keepends=True):
            word = line.lstrip("# \t").split(maxsplit=1)[0] if line.startswith("#") else ""
            switch = SWITCH.match(COMMENT.sub("", line).strip())
            if word.startswith("if"):
                is_switch = switch and switch[1] in self.switches
                stack.append(switch[1] in self.defined if is_switch else None)
            elif word == "else" and stack[-1] is not None:
                stack[-1] = not stack[-1]
            elif word == "endif" and stack.pop() is not None:
                continue
            if False in stack or (word in ("if", "ifdef", "else") and stack[-1] is not None):
                continue
            self.defined |= set(DEFINE.findall(line))
            included = INCLUDE.match(line)
            if not included:
                piece.append(line)
                continue
            self.parts.append((file, "".join(piece)))
            piece = []
            default = included[2] and re.search(rf'define {included[2]} "(.+)"', text)
            self.include(find_file(file, default[1] if default else included[1]))
        self.parts.append((file, "".join(piece)))

    def include(self, file):
        """Add an included file, a header with a guard only once."""
        if file == PUBLIC or file in self.seen:
            return
        if GUARD.match(file.read_text()):
            self.seen.add(file)
        self.add(file)

    def text_of(self, file):
        """Return the text of a file without the lines that its switches exclude."""
        return "".join(text for source, text in self.parts if source == file)


def find_file(source, name):
    """Return the path of the file that `source` includes by `name`."""
    found = [path.resolve() for path in (source.parent / name, CSRC / name) if path.exists()]
    if not found:
        sys.exit(f"{source}: there is no {name}")
    return found[0]


def find_switches(files):
    """Return the macros that sources define before they include anything, and what follows them.

    A macro follows a switch if it is defined in a conditional that tests only the switch.
    """
    texts = [COMMENT.sub("", file.read_text()) for file in files]
    found = set()
    for file, text in zip(files, texts, strict=True):
        if file.suffix == ".c":
            found |= set(re.findall(r"^#define (\w+)\s*$", text.split("#include")[0], re.M))
    for text in texts:
        for test, body in re.findall(r"^#if(?:def| defined) (\w+)\n(.*?)^#endif", text, re.S | re.M):
            if test in found:
                found |= set(re.findall(r"^#\s*define (\w+)\s*$", body, re.M))
    return found


def split_items(text):
    """Return the items of a C text at file scope, without comments."""
    items, item = [], ""
    for line in COMMENT.sub("", text).splitlines():
        if not line.strip() and not item:
            continue
        item += line.rstrip() + "\n"
        if item.startswith("#"):
            is_whole = not line.endswith("\\")
        else:
            code = re.sub(r"^#.*$", "", item, flags=re.M)
            ends = line.rstrip().endswith((";", "}")) or re.fullmatch(r"[A-Z]\w*\(.*\)\n", item)
            is_whole = ends and code.count("{") == code.count("}")
        if is_whole:
            items.append(item)
            item = ""
    if item.strip():
        sys.exit(f"this is no whole item of C:\n{item}")
    return items


def is_type(item):
    return re.match(r"(typedef|enum|struct|union)\b", item) is not None


def is_static(item):
    return re.match(r"(static|[A-Z_]+) (?!.*\bKR_NAME)", item.split("(")[0]) is not None


def names_of(item):
    """Return the names that an item defines at file scope."""
    if is_type(item):
        names = set(re.findall(r"^(?:typedef )?(?:struct|enum|union) (\w+)", item))
        if item.startswith("typedef"):
            last = re.sub(r"\{.*\}| __attribute__.*(?=;)", "", item, flags=re.S)
            names |= set(re.findall(r"(\w+)(?:\[.*\])?[,;]", last))
        if re.match(r"(typedef )?enum\b", item):
            names |= set(re.findall(r"(\w+)\s*(?:=[^,}]*)?[,}]", item.split("{")[1]))
        return names
    function = re.match(r"[^=]*?(\w+)\(", item)
    if function:
        return {function[1]}
    while "{" in item:
        item = re.sub(r"\{[^{}]*\}", "", item)
    return set(re.findall(r"(\w+)(?:\[[^]]*\])*(?: [A-Z_]+)?\s*[=;]", item))


def names_of_macros(items):
    """Return the stems of the names that macros define, as `quad` in NATIVE(quad, ...)."""
    calls = {found[1] for item in items if (found := re.match(r"[A-Z]\w*\(([a-z]\w*)\b", item))}
    bodies = "".join(item for item in items if item.startswith("#"))
    return calls, set(re.findall(r"\b([a-z]\w*_)##", bodies))


def prune(items):
    """Return the items without static functions that nothing uses."""
    stems = tuple(names_of_macros(items)[1])
    while True:
        count = {}
        for name in re.findall(r"\w+", "".join(items)):
            count[name] = count.get(name, 0) + 1
        used = [
            item
            for item in items
            if item.startswith("#")
            or is_type(item)
            or not is_static(item)
            or any(count[name] > 1 or name.startswith(stems) for name in names_of(item))
        ]
        if len(used) == len(items):
            return used
        items = used


def rename(items, prefix):
    """Put the prefix before all names that the items define at file scope."""
    calls, stems = names_of_macros(items)
    types = {name for item in items if is_type(item) for name in names_of(item)} | calls
    names = types | {name for item in items if is_static(item) for name in names_of(item)}

    def is_own(name):
        return (
            name in names
            or name in stems
            or any(name.startswith(stem + "_") for stem in calls)
            or any(name.startswith(stem) and name[len(stem) :].isdigit() for stem in stems)
        )

    def renamed(item):
        chosen = types.__contains__ if is_type(item) else is_own

        def word(token):
            return prefix + token[0] if chosen(token[0]) else token[0]

        body = re.match(r"((?:typedef )?(?:struct|union)[^{;]*)(\{.*\})(.*)", item, re.S)
        if not body:
            return TOKEN.sub(word, item)
        return TOKEN.sub(word, body[1]) + TYPE.sub(word, body[2]) + TOKEN.sub(word, body[3])

    return [item if INCLUDE.match(item) else renamed(item) for item in items]


def instruction_sets():
    """Return the features of each instruction set, as kr_has_... of math/isa.h tests them."""
    text = COMMENT.sub("", (CSRC / "math/isa.h").read_text())
    found = {}
    for name, body in re.findall(r"int kr_has_(\w+)\(void\)\s*\{(.*?)\}", text, re.S):
        inherited = [f for other in re.findall(r"kr_has_(\w+)\(\)", body) for f in found[other]]
        found[name] = inherited + re.findall(r'supports\("(\w+)"\)', body)
    return found


def section(unit, isa, features, common):
    """Return the text of one source for one instruction set, and the macros that it defines."""
    items = []
    for file, text in unit.parts:
        is_own = file not in common or unit.text_of(file) != common[file]
        for item in split_items(re.sub(r"^#include <.*\n", "", text, flags=re.M)):
            if is_own or item.startswith("#") or (is_static(item) and not is_type(item)):
                items.append(item)
    stem = unit.source.stem
    text = "".join(rename(prune(items), f"{isa}_{stem}_"))
    while text != (shorter := re.sub(r"^#\s*if[^\n]*\n(#\s*else\n)?#\s*endif\n", "", text, flags=re.M)):
        text = shorter
    macros = "".join(f"#define KR_TARGET_{name.upper()}\n" for name in features)
    defined = {*DEFINE.findall(macros + text), "KR_ISA"} - optional(text)
    text = with_options(unit.source, f"#define KR_ISA {isa}\n{macros}{text}")
    return f"\n/* {unit.source.relative_to(CSRC)} */\n{text}", defined


def with_options(source, text):
    """Return a text that is compiled with the options of its source in CMakeLists.txt."""
    name = source.relative_to(ROOT).as_posix()
    pattern = rf"\({name}\s+PROPERTIES COMPILE_OPTIONS -f([\w-]+)\)"
    option = re.search(pattern, (ROOT / "CMakeLists.txt").read_text())
    if not option:
        return text
    begin = f'#  pragma GCC push_options\n#  pragma GCC optimize("{option[1]}")\n'
    return for_gcc(begin) + text + for_gcc("#  pragma GCC pop_options\n")


def for_gcc(text):
    return f"#if defined __GNUC__ && !defined __clang__\n{text}#endif\n"


def optional(text):
    """Return the macros that a text defines only if the user of the file does not."""
    return set(re.findall(r"^#if !defined (\w+)\b[^\n]*\n#\s*define \1$", text, re.M))


def undefine(names):
    return "".join(f"#undef {name}\n" for name in sorted(names))


def targeted(isa, features, text):
    """Return a text whose functions are compiled for some features of the processor."""
    if not features:
        return text
    target = ",".join(features)
    return f"""
#if defined KR_WITH_{isa.upper()}
#  if defined __clang__
#    pragma clang attribute push(__attribute__((target("{target}"))), apply_to = function)
#  else
#    pragma GCC push_options
#    pragma GCC target("{target}")
#    pragma GCC optimize("align-functions=64")
#  endif
{text}
#  if defined __clang__
#    pragma clang attribute pop
#  else
#    pragma GCC pop_options
#  endif
#endif
"""


def declared(isa, text):
    """Return the names, without the instruction set, that a text declares for it."""
    names = set(re.findall(rf"\b(\w+)_{isa}\b", text))
    for macro in re.findall(rf"^(\w+)\({isa}\)$", text, re.M):
        body = re.search(rf"^#define {macro}\(.*?[^\\]\n", text, re.S | re.M)
        names |= set(re.findall(r"\b(\w+)_##", body[0]))
    return names


def amalgamate():
    """Return the text of kreisel.c."""
    files = sorted(file for file in CSRC.rglob("*.[ch]") if file.is_file())
    sources = [f for f in files if f.suffix == ".c" and not any(x in str(f) for x in LEFT_OUT)]
    switches = find_switches(files)
    plain, units = Unit(PUBLIC, switches), []
    for source in sources:
        if "KR_NAME(" in source.read_text():
            units.append(Unit(source, switches))
            units[-1].add(source)
        else:
            plain.add(source)
            plain.parts.append((source, undefine(set(DEFINE.findall(plain.text_of(source))))))
    body = "".join(text for _, text in plain.parts)
    common = {file: plain.text_of(file) for file, _ in plain.parts}
    system = {n for u in [plain, *units] for _, t in u.parts for n in re.findall(r"^#include (<.*>)", t, re.M)}
    out = [head(system), re.sub(r"^#include <.*\n", "", body, flags=re.M)]
    live = {"KR_ISA"} | set(DEFINE.findall(body)) - optional(body)
    for isa, features in instruction_sets().items():
        sections = []
        known = declared(isa, COMMENT.sub("", body))
        for unit in units:
            if not known & set(EXPORT.findall(unit.text_of(unit.source))):
                continue
            text, macros = section(unit, isa, features, common)
            now = macros | set()
            sections.append(undefine(live & now) + text)
            live = live - now
            sections.append(undefine(now))
        out.append(targeted(isa, features, "".join(sections)))
    return "".join(out) + FOOT


def head(system):
    license = "".join(f" * {line}".rstrip() + "\n" for line in (ROOT / "LICENSE").read_text().splitlines())
    version = re.search(r'KR_VERSION "(.+)"', PUBLIC.read_text())[1]
    return HEAD.format(
        version=version,
        with_isas="".join(
            f"#  define KR_WITH_{isa.upper()}\n" for isa, features in instruction_sets().items() if features
        ),
        license=license.rstrip("\n").removesuffix(" *"),
        system="\n".join(f"#include {name}" for name in sorted(system)),
        options=", ".join(f'"{o}"' for o in STRICT),
    )


def main():
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build/amalgamation"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "kreisel.c").write_text(amalgamate())
    (folder / "kreisel.h").write_bytes(PUBLIC.read_bytes())
    print(folder / "kreisel.c")


if __name__ == "__main__":
    main()
