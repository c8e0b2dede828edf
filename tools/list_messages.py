"""Write the list of error messages in docs/troubleshooting.md, from the source.

    python tools/list_messages.py

Every `InputError(source, problem, cure)` of the source is listed by its cause; what depends on the input stands as `…`.
"""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DOCUMENT = ROOT / "docs/troubleshooting.md"
START, END = "<!-- messages: written by tools/list_messages.py -->\n", "<!-- end of messages -->\n"
ROOMS = ("core", "operators", "citypv_addon")
ERRORS = ("InputError", "UnreadError", "UnknownSystemError")
ROW = "| {} | {} |"
CAUSES = (  # heading, pattern of the files; the first that fits counts
    ("Terrain and horizon", r"core/(ground|horizon)/|core/files/.*(raster|heights|terrain|relief|geotiff|grid|crs)"),
    ("Weather", r"core/(weather|climate)/|core/files/open_netcdf|core/sun/check_distance"),
    ("City files", r"core/(files|city|trees|scene)/"),
    ("Albedos and materials", r"core/materials/"),
    ("Modules, mounting and racks", r"core/(energy|racks)/"),
    ("Suns, effects and other settings", r"core/(sun|effects|accuracy|commands)/|core/[a-z_]+\.py"),
    ("Results and earlier traces", r"core/(results|plots|transfer)/"),
    ("The world", r"core/world/"),
    ("Blender", r"operators/|citypv_addon/"),
    ("Calls from Python, and faults of the machine", r""),
)


def main():
    """Write the list into the document."""
    before, _, rest = DOCUMENT.read_text("utf-8").partition(START)
    DOCUMENT.write_text(before + START + write_list() + END + rest.partition(END)[2], "utf-8")


def write_list():
    """The list as Markdown: a table for each cause."""
    messages = collect_messages()
    parts = []
    for cause, _ in CAUSES:
        rows = sorted({(problem, cure) for place, problem, cure in messages if find_cause(place) == cause})
        if rows:
            table = "\n".join(ROW.format(*(escape(text) for text in row)) for row in rows)
            parts.append(f"\n### {cause}\n| message | what to do |\n|---|---|\n{table}\n")
    return "".join(parts)


def find_cause(place):
    """Heading of a file."""
    return next(cause for cause, pattern in CAUSES if re.match(pattern, place))


def escape(text):
    """Text that a cell of a table can hold."""
    return text.replace("|", "\\|").replace("<", "&lt;").replace("\n", " ")


def collect_messages():
    """All messages of the source: list of (file, problem, cure)."""
    found = []
    for path in sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.py")):
        tree = ast.parse(path.read_text("utf-8"))
        place = path.relative_to(ROOT).as_posix()
        for function in walk_functions(tree):
            names = read_texts(tree) | read_texts(function)
            for call in own_nodes(function):
                if isinstance(call, ast.Call) and getattr(call.func, "id", "") in ERRORS:
                    found += [(place, *message) for message in read_message(call, names)]
    return found


def walk_functions(tree):
    """The module and all functions in it."""
    return [tree, *(node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))]


def own_nodes(function):
    """Nodes of a function, or of a module, but not those of the functions inside."""
    waiting = list(ast.iter_child_nodes(function))
    while waiting:
        node = waiting.pop()
        yield node
        if not isinstance(node, ast.FunctionDef):
            waiting += ast.iter_child_nodes(node)


def read_texts(function):
    """Texts that are assigned to names in a function or module: dict of lists."""
    texts = {}
    for node in own_nodes(function):
        if isinstance(node, ast.Assign):
            for target in node.targets:
                if isinstance(target, ast.Name):
                    texts.setdefault(target.id, []).extend(read_words(node.value, {}))
    return texts


def read_message(call, names):
    """Problems and cures of one call: list of tuples, each problem with the first cure."""
    own = getattr(call.func, "id", "") == "InputError"
    arguments = call.args[1:] if own else call.args
    if not arguments or any(isinstance(argument, ast.Starred) for argument in arguments):
        return []
    problems = read_words(arguments[0], names)
    if not own:  # raised again by `open_raster` with one cure for all
        opener = ast.parse((ROOT / "core/files/open_raster.py").read_text("utf-8"))
        return [(problem, read_texts(opener)["CURE"][0]) for problem in read_words(arguments[0], names)]
    cures = (read_words(arguments[1], names) if len(arguments) > 1 else []) or [""]
    return [(problem, cures[0]) for problem in problems if problem.strip("… ")]


def read_words(node, names):
    """The texts that an expression can be, with … for what depends on the input: list of str."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return [node.value]
    if isinstance(node, ast.JoinedStr):
        words = "".join(part.value if isinstance(part, ast.Constant) else "…" for part in node.values)
        return [re.sub("…(…)+", "…", words)]
    if isinstance(node, ast.IfExp):
        return read_words(node.body, names) + read_words(node.orelse, names)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        left, right = read_words(node.left, names) or ["…"], read_words(node.right, names) or ["…"]
        return [one + other for one in left for other in right]
    return list(names.get(node.id, [])) if isinstance(node, ast.Name) else []


if __name__ == "__main__":
    main()
