"""Change single signs, factors, indices and bounds in core, one at a time in a copy, and see which
of them tests find.

    python tools/mutate.py --seed 1 --count 20 -- -m "not thorough"     runs pytest with what stands behind --
    python tools/mutate.py --seed 1 --count 20 --list                   only shows what would be changed

The four kinds take turns. pytest stops at the first failure; files of tests that are near to the
changed one, by what they import, run first.
"""

import argparse
import ast
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LEFT_OUT = (".git", ".venv*", "build", "dist", "wheels", "results", "*.egg-info")
KINDS = ("sign", "factor", "index", "bound")
OPERATORS = {  # kind, old, new
    **{ast.Add: ("sign", b"+", b"-"), ast.Sub: ("sign", b"-", b"+")},
    **{ast.Mult: ("factor", b"*", b"/"), ast.Div: ("factor", b"/", b"*")},
    **{ast.Lt: ("bound", b"<", b">="), ast.LtE: ("bound", b"<=", b">")},
    **{ast.Gt: ("bound", b">", b"<="), ast.GtE: ("bound", b">=", b"<")},
}
ENDS = {"minimum": b"maximum", "maximum": b"minimum", "min": b"max", "max": b"min"}
IMPORT = re.compile(r"^\s*from (\.*)([\w.]*) import (\([^)]*\)|.*)", re.MULTILINE)
NEAR = "CITYPV_TESTS_NEAR"


def main():
    """Draw mutations, run the tests on each, say which were found."""
    words = sys.argv[1:] if "--" in sys.argv else [*sys.argv[1:], "--"]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument(
        "--timeout", type=float, default=1800, help="seconds after which a run counts as found"
    )
    parser.add_argument("--list", action="store_true", help="only list what would be changed")
    chosen, tests = parser.parse_args(words[: words.index("--")]), words[words.index("--") + 1 :]
    drawn = draw_mutations(chosen.seed, chosen.count)
    for kind, path, place, old, new in drawn:
        line, text = show_line(path, place)
        print(f"{kind:6} {path}:{line}: {old.decode()} -> {new.decode()} in: {text}", flush=True)
    if chosen.list:
        return
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "citypv"
        shutil.copytree(ROOT, copy, symlinks=True, ignore=leave_out)
        status, seconds, first = run_tests(copy, tests, {}, {}, chosen.timeout)
        if status:
            raise SystemExit(f"the tests fail without any change: {first}")
        print(f"passed without a change in {seconds:.0f} s", flush=True)
        found = [try_mutation(copy, mutation, tests, chosen.timeout) for mutation in drawn]
    print(f"found {sum(found)} of {len(found)}")


def leave_out(folder, names):
    """What is not copied, in the root only: results/ is a folder there and a room of core."""
    return shutil.ignore_patterns(*LEFT_OUT)(folder, names) if Path(folder) == ROOT else ()


def draw_mutations(seed, count):
    """Some changes, kind by kind: list of (kind, path, place, old, new)."""
    every = [found for path in sorted(ROOT.glob("core/**/*.py")) for found in find_mutations(path)]
    generator = random.Random(seed)
    heaps = {kind: [one for one in every if one[0] == kind] for kind in KINDS}
    return [
        heap.pop(generator.randrange(len(heap)))
        for _ in range(count // 4 + 1)
        for heap in heaps.values()
    ][:count]


def find_mutations(path):
    """Every change that a file allows: yields (kind, path, place in bytes, old, new)."""
    source, name = path.read_bytes(), path.relative_to(ROOT)
    starts = [0, *(match.end() for match in re.finditer(b"\n", source))]

    def span(node):
        return starts[node.lineno - 1] + node.col_offset, starts[
            node.end_lineno - 1
        ] + node.end_col_offset

    def operator(left, sign, right):
        kind, old, new = OPERATORS.get(type(sign), ("", b"\0", b""))
        place = source.find(old, span(left)[1], span(right)[0])
        return [(kind, name, place, old, new)] if place >= 0 else []

    def numbers(kind, *nodes):
        for node in nodes:
            if isinstance(node, ast.Constant) and type(node.value) in (int, float):
                value = (
                    node.value + 1
                    if isinstance(node.value, int) or node.value == 0
                    else 2 * node.value
                )
                yield kind, name, span(node)[0], source[slice(*span(node))], repr(value).encode()

    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.BinOp) and not joins_texts(node):
            yield from operator(node.left, node.op, node.right)
            yield from numbers("factor", node.left, node.right)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            yield "sign", name, span(node)[0], b"-", b"+"
        elif isinstance(node, ast.Subscript):
            yield from numbers("index", *ast.walk(node.slice))
        elif isinstance(node, ast.Compare) and type(node.ops[0]) in OPERATORS:
            yield from operator(node.left, node.ops[0], node.comparators[0])
            yield from numbers("bound", node.left, *node.comparators)
        elif isinstance(node, ast.Attribute) and node.attr in ENDS:
            yield "bound", name, span(node)[1] - len(node.attr), node.attr.encode(), ENDS[node.attr]


def joins_texts(node):
    """Whether an operation joins texts, lists or paths."""
    parts = [part for side in (node.left, node.right) for part in ast.walk(side)]
    return any(
        isinstance(part, ast.List) or isinstance(getattr(part, "value", 0), str) for part in parts
    )


def show_line(path, place):
    """Number and text of the line of a place."""
    source = (ROOT / path).read_bytes()
    line = source.count(b"\n", 0, place) + 1
    return line, source.splitlines()[line - 1].decode().strip()


def try_mutation(copy, mutation, tests, timeout):
    """Change the copy, run the tests, change it back: whether they found it."""
    kind, path, place, old, new = mutation
    file, line = copy / path, show_line(path, place)[0]
    source, times = file.read_bytes(), file.stat()
    file.write_bytes(source[:place] + new + source[place + len(old) :])
    # Compiled loops elsewhere hold the loops of this file and the numbers outside its functions:
    # compile all again.
    bodies = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef)]
    alone = b"njit" not in source and any(body.lineno <= line <= body.end_lineno for body in bodies)
    with tempfile.TemporaryDirectory() as fresh:
        settings = {} if alone else {"NUMBA_CACHE_DIR": fresh}
        status, seconds, first = run_tests(
            copy, tests, measure_distances(copy, file), settings, timeout
        )
    file.write_bytes(source)
    os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
    print(
        f"{'found' if status else 'SURVIVED':8} {kind:6} {path}:{line}: {seconds:.0f} s {first}",
        flush=True,
    )
    return bool(status)


def measure_distances(copy, changed):
    """Files that import a changed one, straight or by way of others, and by how many steps: dict of
    Path to int.
    """
    importers = {}
    for path in (
        path for room in ("core", "operators", "tests") for path in copy.glob(f"{room}/**/*.py")
    ):
        for dots, module, names in IMPORT.findall(path.read_text("utf-8")):
            folder = (
                path.parents[len(dots) - 1]
                if dots
                else copy.parent
                if module.startswith("citypv")
                else path.parent
            )
            target = folder.joinpath(*module.split("."))
            for one in (target, *(target / name for name in re.findall(r"\w+", names))):
                importers.setdefault(one.with_suffix(".py"), set()).add(path)
    steps, waiting = {changed: 0}, [changed]
    for path in waiting:
        new = importers.get(path, set()) - steps.keys()
        steps |= dict.fromkeys(new, steps[path] + 1)
        waiting += sorted(new)
    return steps


def run_tests(copy, tests, near, settings, timeout):
    """Run pytest in the copy: its status, seconds, and the first test that failed."""
    settings = (
        os.environ
        | settings
        | {
            "PYTHONPATH": os.pathsep.join([str(copy.parent), str(Path(__file__).parent)]),
            NEAR: json.dumps({str(path): steps for path, steps in near.items()}),
        }
    )
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-x",
        "-p",
        "no:cacheprovider",
        "-p",
        "mutate",
        *tests,
    ]
    started = time.monotonic()
    try:
        done = subprocess.run(
            command,
            cwd=copy,
            env=settings,
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return 1, time.monotonic() - started, "no end"
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return (
        done.returncode,
        time.monotonic() - started,
        (failed or done.stderr.splitlines()[-1:] or [""])[0][:150],
    )


def pytest_collection_modifyitems(items):
    """As a plugin of pytest: what is near to the changed file runs first."""
    near = json.loads(os.environ.get(NEAR, "{}"))
    items.sort(key=lambda item: near.get(str(item.path), len(near)))


if __name__ == "__main__":
    main()
