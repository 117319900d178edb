"""Write the library as one file, kreisel.c, beside a copy of its header kreisel.h.

    python3 cmake/amalgamate.py [FOLDER]        the default folder is build/amalgamation

A source that names its exports by KR_NAME (math/isa.h) is compiled once for each instruction set.
In kreisel.c each of these compilations is a section. It has its own copies of the static functions
that the source includes, unless an earlier section has equal ones; a prefix makes the names of a
section unique. All other sources follow
one another unchanged, each header before its first use.
"""

import functools
import hashlib
import re
import sys
from collections import Counter, defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CSRC = ROOT / "csrc"
PUBLIC = CSRC / "kreisel.h"
LEFT_OUT = re.compile(r"/gsl/|/wasm\.c$")  # as in CMakeLists.txt

COMMENT = re.compile(r"/\*.*?\*/", re.S)
INCLUDE = re.compile(r'#\s*include (?:"(.+)"|([A-Z]\w+))')
SYSTEM = re.compile(r"^#include (<.*>)\n", re.M)  # unconditional, because not indented
DEFINE = re.compile(r"^#\s*define (\w+)", re.M)
SWITCH = re.compile(r"#\s*(?:if defined|ifdef) (\w+)\s*(?:/\*.*)?$")
GUARD = re.compile(r"\A((?:/\*.*?\*/\s*)*)#ifndef (\w+_H)\n#define \2\n(.*)#endif\n\Z", re.S)
EXPORT = re.compile(r"^(?!static|INLINE)[\w *]*\bKR_NAME\((\w+)\)", re.M)
TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|(?<![\w.])(?<!->)[A-Za-z_]\w*')
MEMBER_TYPE = re.compile(TOKEN.pattern + r"\b(?!\s*[;,[=)])")  # in a struct: no member
STRUCT = re.compile(r"((?:typedef )?(?:struct|union)[^{;]*)(\{.*\})(.*)", re.S)
EMPTY = re.compile(r"^#\s*if[^\n]*\n(#\s*else\n)?#\s*endif\n", re.M)

HEAD = """\
/* kreisel {version}: the library in one file, written by cmake/amalgamate.py.
 *
 * Compile with `cc -O2 -c kreisel.c` and link with -lm. With -DKR_ONE_ISA the library has a single
 * instruction set, that of the compiler's options, and compiles faster.
 *
{license} */
#include "kreisel.h"
{system}
#if defined __OPTIMIZE_SIZE__       /* -Os */
#  undef KR_SMALL
#  undef KR_NO_BATCHES
#  define KR_SMALL
#  define KR_NO_BATCHES
#endif
/* The results depend on the order of operations. Products and sums must not be fused, even if the
 * compiler's options allow it. Vectorization is off, because gcc 12 fuses where it vectorizes. */
#if defined __clang__
#  pragma clang diagnostic push
#  pragma clang diagnostic ignored "-Wunused-function"
#  pragma STDC FP_CONTRACT OFF
#elif defined __GNUC__
#  pragma GCC push_options
#  pragma GCC optimize("fp-contract=off", "no-tree-vectorize", "no-tree-slp-vectorize")
#  if defined __OPTIMIZE_SIZE__
#    pragma GCC optimize("no-inline-functions-called-once", "no-caller-saves")
#    pragma GCC optimize("no-move-loop-invariants", "no-tree-loop-im")
#    pragma GCC optimize("no-schedule-insns2", "no-gcse")
#  endif
/* An option would come too late for functions that <math.h> has declared. Without errno, sqrt is
 * one instruction. */
double sqrt(double) __attribute__((const));
#elif defined _MSC_VER
#  pragma fp_contract(off)
#endif
#if defined __x86_64__ && (defined __clang__ || (defined __GNUC__ && __GNUC__ >= 12)) && \\
    !defined _MSC_VER && !defined KR_ONE_ISA && !defined KR_PLAIN
{isas}#endif
"""
FOOT = """
#if defined __clang__
#  pragma clang diagnostic pop
#elif defined __GNUC__
#  pragma GCC pop_options
#endif
"""
TARGETED = """
#if defined {macro}
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
VECTORIZED = """\
#if defined __GNUC__ && !defined __clang__
#  pragma GCC push_options
#  pragma GCC optimize("{option}")
#endif
{text}#if defined __GNUC__ && !defined __clang__
#  pragma GCC pop_options
#endif
"""


class Unit:
    """Sources with all that they include; `parts` are pairs of a file and a piece of its text."""

    def __init__(self, switches):
        self.switches = switches
        self.parts, self.defined, self.seen = [], set(), {PUBLIC}
        self.texts = defaultdict(str)  # of each file as this unit includes it

    def add(self, file):
        """Add a file, without the lines for other values of the switches."""
        text, piece, stack = file.read_text(), [], []
        if guarded := GUARD.match(text):
            if file in self.seen:
                return
            self.seen.add(file)
            text = guarded[1] + guarded[3]
        for line in text.splitlines(keepends=True):
            word = re.match(r"(?:#\s*(\w+))?", line)[1] or ""
            test = SWITCH.match(line)
            if word.startswith("if"):
                is_switch = test and test[1] in self.switches
                stack.append(test[1] in self.defined if is_switch else None)
            elif word == "else" and stack[-1] is not None:
                stack[-1] = not stack[-1]
            ended = stack.pop() if word == "endif" else None
            is_resolved = bool(stack) and stack[-1] is not None
            if False in stack or ended is not None or (word[:2] in ("if", "el") and is_resolved):
                continue
            self.defined |= set(DEFINE.findall(line))
            if included := INCLUDE.match(line):
                self.append(file, "".join(piece))
                piece = []
                self.add(find_file(file, text, *included.groups()))
            else:
                piece.append(line)
        self.append(file, "".join(piece))

    def append(self, file, text):
        self.parts.append((file, text))
        self.texts[file] += text


def find_file(source, text, name, macro):
    """Return the path of the file that `source` includes by its name, or by a macro's default."""
    name = name or re.search(rf'define {macro} "(.+)"', text)[1]
    found = [path.resolve() for path in (source.parent / name, CSRC / name) if path.exists()]
    return found[0] if found else sys.exit(f"{source} includes {name}, which does not exist")


def find_switches(files):
    """Return the macros that choose between versions of a header.

    A source defines them before it includes anything, or a header in a test of such a macro only.
    """
    texts = {file: COMMENT.sub("", file.read_text()) for file in files}
    heads = [text.split("#include")[0] for file, text in texts.items() if file.suffix == ".c"]
    found = set(re.findall(r"^#define (\w+)\s*$", "".join(heads), re.M))
    for text in texts.values():
        for test, body in re.findall(
            r"^#if(?:def| defined) (\w+)\n(.*?)^#endif", text, re.S | re.M
        ):
            if test in found:
                found |= set(re.findall(r"^#\s*define (\w+)\s*$", body, re.M))
    return found


@functools.cache
def words_of(text):
    return frozenset(re.findall(r"\w+", text))


@functools.cache
def split_items(text):
    """Return the items of a C text at file scope, without comments."""
    items, item = [], ""
    for line in COMMENT.sub("", text).splitlines():
        if not line.strip() and not item:
            continue
        item += line.rstrip() + "\n"
        code = re.sub(r"^#.*$", "", item, flags=re.M)
        ends = item.rstrip().endswith((";", "}")) or re.fullmatch(r"[A-Z]\w*\(.*\)\n", item)
        if item.startswith("#"):
            is_whole = not line.endswith("\\")
        else:
            is_whole = ends and code.count("{") == code.count("}")
        if is_whole:
            items.append(item)
            item = ""
    return items if not item.strip() else sys.exit(f"this is no whole item of C:\n{item}")


@functools.cache
def is_type(item):
    return re.match(r"(typedef|enum|struct|union)\b", item) is not None


@functools.cache
def is_static(item):
    return re.match(r"(static|[A-Z_]+) (?!.*\bKR_NAME)", item.split("(")[0]) is not None


@functools.cache
def names_of(item):
    """Return the names that a type or a static item defines at file scope."""
    flat = re.sub(r"\{.*\}| __attribute__.*(?=;)|\(.*\)", "", item, flags=re.S)
    if is_type(item):
        names = set(re.findall(r"^(?:typedef )?(?:struct|enum|union) (\w+)", item))
        if item.startswith("typedef"):
            names |= set(re.findall(r"(\w+)(?:\[.*\])?[,;]", flat))
        if "enum" in item.split("{")[0]:
            names |= set(re.findall(r"(\w+)\s*(?:=[^,}]*)?[,}]", item.split("{")[1]))
        return names
    if function := re.match(r"[^=]*?(\w+)\(", item):
        return {function[1]}
    while "{" in item:
        item = re.sub(r"\{[^{}]*\}", "", item)
    return set(re.findall(r"(\w+)(?:\[[^]]*\])*(?: [A-Z_]+)?\s*[=;]", item))


def names_of_macros(items):
    """Return the beginnings of names that macros paste: first arguments, and parts of bodies.

    NATIVE(quad, ...) defines quad_add; the body of TAIL(digits) defines expand_##digits.
    """
    calls = {found[1] for item in items if (found := re.match(r"[A-Z]\w*\(([a-z]\w*)\b", item))}
    bodies = "".join(item for item in items if item.startswith("#"))
    return calls, set(re.findall(r"\b([a-z]\w*_)##", bodies))


def expand_macros(items):
    """Return the text of the calls of macros at file scope: NATIVE(quad, ...) has quad_add."""
    macros, texts = {}, []
    for item in items:
        if defined := re.match(r"#\s*define (\w+)\(([\w, ]*)\)(.*)", item, re.S):
            macros[defined[1]] = defined[2].split(", "), defined[3]
    for item in items:
        call = re.match(r"(\w+)\((.*)\)\n", item)
        if call and call[1] in macros:
            parameters, body = macros[call[1]]
            given = dict(zip(parameters, call[2].split(", "), strict=False))
            text = re.sub(r"\w+", lambda word, given=given: given.get(word[0], word[0]), body)
            texts.append(text.replace("##", ""))
    return "".join(texts)


def prune(items, used_elsewhere=()):
    """Return the items without static functions and data that nothing uses."""
    stems = tuple(names_of_macros(items)[1])
    count = Counter(re.findall(r"\w+", "".join(items) + expand_macros(items)))
    count.update(used_elsewhere)

    def is_used(item):
        return (
            is_type(item)
            or not is_static(item)
            or any(count[name] > 1 or name.startswith(stems) for name in names_of(item))
        )

    used = [item for item in items if is_used(item)]
    return used if len(used) == len(items) else prune(used, used_elsewhere)


class Section:
    """One source for one instruction set, with all that it includes, as pairs (file, item).

    Types come from the plain part, unless a switch chooses another version of their header.
    """

    def __init__(self, source, unit, isa, plain):
        name = source.relative_to(ROOT).as_posix()
        own = rf"\({name}\s+PROPERTIES COMPILE_OPTIONS -f([\w-]+)\)"
        self.name, self.prefix = name, f"{isa}_{source.stem}_"
        self.option = re.search(own, (ROOT / "CMakeLists.txt").read_text())
        self.entries, self.owners, self.macros, self.signatures = [], {}, {}, {}
        for file, text in unit.parts:
            is_own = unit.texts[file] != plain.texts[file]
            for item in split_items(SYSTEM.sub("", text)):
                if is_own or item.startswith("#") or (is_static(item) and not is_type(item)):
                    self.entries.append((file, item))
        self.prefixes = {file: self.prefix for file, _ in self.entries}
        self.used_elsewhere, self.indices = set(), defaultdict(list)
        for index, (file, item) in enumerate(self.entries):
            self.indices[file].append(index)
            for name in DEFINE.findall(item):
                self.macros.setdefault(name, []).append(index)
            if not item.startswith("#"):
                for name in names_of_macros([item])[0] | names_of(item):
                    self.owners.setdefault(name, (index, file))

    def lines_of(self, index):
        """Return a macro's definition, in a header with all directives before it."""
        file, line = self.entries[index]
        if file.suffix == ".c":
            return line
        items = (self.entries[i][1] for i in self.indices[file] if i <= index)
        return "".join(item for item in items if item[0] == "#")

    def meaning(self, words, last):
        """Return all lines before the item `last` that define what the words mean as macros."""
        found, new = {}, words
        while new:
            indices = {i for name in new & self.macros.keys() for i in self.macros[name]}
            lines = {i: self.lines_of(i) for i in indices - found.keys() if i <= last}
            found |= lines
            new = set().union(*map(words_of, lines.values()))
        return sorted(set(found.values()))

    def find_owner(self, word, last):
        """Return the file that defines a word before the item `last`; quad_add by NATIVE(quad)."""
        parts = word.split("_")
        stems = ["_".join(parts[:n]) for n in range(len(parts), 0, -1)]
        index, file = next((self.owners[s] for s in stems if s in self.owners), (last + 1, None))
        return file if index <= last else None

    def sign(self, file):
        """Return all that the meaning of a file depends on."""
        if file not in self.signatures:
            self.signatures[file] = ""
            last = self.indices[file][-1]
            text = "".join(self.entries[i][1] for i in self.indices[file])
            macros = self.meaning(words_of(text), last)
            words = words_of(text).union(*map(words_of, macros))
            others = {self.find_owner(word, last) for word in words} - {None, file}
            signs = [text, *macros, *(f"{other} {self.sign(other)}" for other in sorted(others))]
            signs.append(self.option[1] if self.option else "")
            self.signatures[file] = hashlib.sha256("\0".join(signs).encode()).hexdigest()
        return self.signatures[file]

    def find_items(self):
        """Return the items of this section: those of other sections only if they are macros."""
        items = [
            item
            for file, item in self.entries
            if item[0] == "#" or self.prefixes[file] == self.prefix
        ]
        return prune(items, self.used_elsewhere)

    def write(self, isa, features):
        """Return the text of the section."""
        text = "".join(rename(self.find_items(), self.entries, self.prefixes))
        while (shorter := EMPTY.sub("", text)) != text:
            text = shorter
        macros = "".join(f"#define KR_TARGET_{name.upper()}\n" for name in features)
        text = f"#define KR_ISA {isa}\n{macros}{text}"
        if self.option:
            text = VECTORIZED.format(option=self.option[1], text=text)
        return f"\n/* {self.name} */\n{text}{undefine(defined_macros(text) | {'KR_ISA'})}"


def share_headers(sections):
    """Let sections use the functions of headers that an earlier section has with equal meaning."""
    first = {}
    for section in sections:
        for file in section.prefixes:
            if file.suffix == ".h":
                owner = first.setdefault((file, section.sign(file)), section)
                section.prefixes[file] = owner.prefix
    by_prefix = {section.prefix: section for section in sections}
    for section in reversed(sections):
        end = len(section.entries)
        for word in words_of("".join(section.find_items())):
            owner = by_prefix[section.prefixes.get(section.find_owner(word, end), section.prefix)]
            if owner is not section:
                owner.used_elsewhere.add(word)


def rename(items, entries, prefixes):
    """Put the prefix of their file before all names that the entries define at file scope."""
    calls, stems, types, names = {}, {}, {}, {}
    for file, item in entries:
        found = names_of_macros([item])
        calls |= dict.fromkeys(found[0], prefixes[file])
        stems |= dict.fromkeys(found[1], prefixes[file])
        if is_type(item):
            types |= dict.fromkeys(names_of(item), prefixes[file])
        elif is_static(item):
            names |= dict.fromkeys(names_of(item), prefixes[file])
    types |= calls
    names |= types | stems
    member = re.compile(rf"(offsetof\(\w+, )(?:{'|'.join(set(prefixes.values()))})")

    @functools.cache
    def find_prefix(name):
        if name in names:
            return names[name]
        made = [calls[call] for call in calls if name.startswith(call + "_")]
        made += [stems[s] for s in stems if name.startswith(s) and name[len(s) :].isdigit()]
        return made[0] if made else ""

    def rename_item(item):
        def rename_token(token):
            name = token[0]
            return (types.get(name, "") if is_type(item) else find_prefix(name)) + name

        struct = STRUCT.match(item) if is_type(item) else None
        if not struct:
            return member.sub(r"\1", TOKEN.sub(rename_token, item))
        outside = [TOKEN.sub(rename_token, struct[i]) for i in (1, 3)]
        return outside[0] + MEMBER_TYPE.sub(rename_token, struct[2]) + outside[1]

    return [item if re.match(r"#\s*include", item) else rename_item(item) for item in items]


def instruction_sets():
    """Return the features of each instruction set, as kr_has_... of math/isa.h tests them."""
    text, found = COMMENT.sub("", (CSRC / "math/isa.h").read_text()), {}
    for name, body in re.findall(r"int kr_has_(\w+)\(void\)\s*\{(.*?)\}", text, re.S):
        inherited = [f for other in re.findall(r"kr_has_(\w+)\(\)", body) for f in found[other]]
        found[name] = inherited + re.findall(r'supports\("(\w+)"\)', body)
    return found


def declared_names(isa, text):
    """Return the names, without the instruction set, that a text declares for it."""
    names = set(re.findall(rf"\b(\w+)_{isa}\b", text))
    for macro in re.findall(rf"^(\w+)\({isa}\)$", text, re.M):
        body = re.search(rf"^#define {macro}\(.*?[^\\]\n", text, re.S | re.M)
        names |= set(re.findall(r"\b(\w+)_##", body[0]))
    return names


def defined_macros(text):
    """Return the macros that a text defines, except defaults of compiler options."""
    defaults = re.findall(r"^#\s*if !defined (\w+)\b[^\n]*\n#\s*define \1$", text, re.M)
    return set(DEFINE.findall(text)) - set(defaults)


def undefine(names):
    return "".join(f"#undef {name}\n" for name in sorted(names))


def write_head(system):
    lines = (ROOT / "LICENSE").read_text().strip().splitlines()
    return HEAD.format(
        version=re.search(r'KR_VERSION "(.+)"', PUBLIC.read_text())[1],
        license="\n".join(f" * {line}".rstrip() for line in lines),
        system="".join(f"#include {name}\n" for name in sorted(system)),
        isas="".join(
            f"#  define KR_WITH_{n.upper()}\n" for n, f in instruction_sets().items() if f
        ),
    )


def read_units():
    """Return the unit of the plain sources, and the units of those for each instruction set."""
    files = sorted([*CSRC.rglob("*.c"), *CSRC.rglob("*.h")])
    switches = find_switches(files)
    plain, units = Unit(switches), {}
    for file in files:
        if file.suffix != ".c" or LEFT_OUT.search(file.as_posix()):
            continue
        if "KR_NAME(" in file.read_text():
            units[file] = Unit(switches)
            units[file].add(file)
        else:
            plain.add(file)
            plain.parts.append((None, undefine(set(DEFINE.findall(plain.texts[file])))))
    return plain, units


def amalgamate():
    """Return the text of kreisel.c."""
    plain, units = read_units()
    body = "".join(text for _, text in plain.parts)
    everything = body + "".join(text for unit in units.values() for _, text in unit.parts)
    out = [write_head(set(SYSTEM.findall(everything))), SYSTEM.sub("", body)]
    out.append(undefine(defined_macros(body) | {"KR_ISA"}))
    for isa, features in instruction_sets().items():
        known = declared_names(isa, COMMENT.sub("", body))
        sections = [
            Section(source, unit, isa, plain)
            for source, unit in units.items()
            if known & set(EXPORT.findall(unit.texts[source]))
        ]
        share_headers(sections)
        text = "".join(section.write(isa, features) for section in sections)
        macro, target = f"KR_WITH_{isa.upper()}", ",".join(features)
        out.append(TARGETED.format(macro=macro, target=target, text=text) if features else text)
    return "".join(out) + FOOT


def main():
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build/amalgamation"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "kreisel.c").write_text(amalgamate())
    (folder / "kreisel.h").write_bytes(PUBLIC.read_bytes())
    print(f"written: {folder / 'kreisel.c'}, {folder / 'kreisel.h'}")


if __name__ == "__main__":
    main()
