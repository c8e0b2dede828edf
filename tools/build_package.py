"""Build the Python package, a wheel and a source archive, with a README for a package index.

    .venv/bin/python tools/build_package.py [--address URL] [--out dist]

On an index the README stands without the files beside it: its links get the address under which these
can be read; without an address they become plain words, and pictures are left out.
"""

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LINK = re.compile(r"(?P<picture>!?)\[(?P<words>[^\]]*)\]\((?P<target>[^)\s]+)\)")


def main():
    """Copy what git knows of, change the README of the copy, and build from that."""
    parser = argparse.ArgumentParser(description="build the Python package")
    parser.add_argument("--address", metavar="URL", help="where the repository's files can be read")
    parser.add_argument("--out", type=Path, default=ROOT / "dist")
    options = parser.parse_args()
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    with tempfile.TemporaryDirectory() as folder:
        for name in filter(None, listed.split("\0")):
            target = Path(folder, name)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target)
        readme = Path(folder, "README.md")
        readme.write_text(detach_links(readme.read_text("utf-8"), options.address), "utf-8")
        command = [sys.executable, "-m", "build", "--outdir", options.out.resolve(), folder]
        subprocess.run(command, check=True)


def detach_links(text, address=None):
    """A page whose relative links do not need the files beside it: str."""

    def detach(found):
        picture, words, target = found["picture"], found["words"], found["target"]
        if "://" in target or target.startswith("#"):
            return found[0]
        if address:
            return f"{picture}[{words}]({address.rstrip('/')}/{target})"
        return "" if picture else words

    return LINK.sub(detach, text)


if __name__ == "__main__":
    main()
