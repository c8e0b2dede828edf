"""Bundle the parts of three.js and 3d-tiles-renderer that CityPV's pages use, and check our own
JavaScript for style.

    python3 tools/bundle_three.py

Writes three.js and tiles.js into core/results/web, the same bytes every time, and versions and
hashes beside them. Needs npm and a network, which nobody needs to install, run or test CityPV.
"""

import hashlib
import json
import re
import subprocess
import tempfile
from pathlib import Path

WEB = Path(__file__).resolve().parent.parent / "core" / "results" / "web"
PACKAGES = {
    "three": "0.169.0",
    "3d-tiles-renderer": "0.5.3",
    "esbuild": "0.28.2",
    "eslint": "9.39.5",
    "@eslint/js": "9.39.5",
    "globals": "16.4.0",
}
PARTS = """BufferAttribute, BufferGeometry, Color, ColorManagement, DoubleSide, LinearSRGBColorSpace, LineBasicMaterial,
LineSegments, Matrix4, Mesh, MeshBasicMaterial, PerspectiveCamera, Raycaster, Scene, Vector2, Vector3, WebGLRenderer"""
CONTROLS = 'export { OrbitControls } from "three/addons/controls/OrbitControls.js";'
USERS = (
    "three/examples/jsm/loaders/GLTFLoader.js",
    "three/examples/jsm/utils/BufferGeometryUtils.js",
)
# files of tiles.js, which take what they need from three.js
USERS += ("3d-tiles-renderer/build/renderer-*.js",)
TILES = 'export { TilesRenderer } from "3d-tiles-renderer/three";'
# What fetches is in tiles.js alone: nothing in the report may.
FETCHING = ("FileLoader", "ImageBitmapLoader", "TextureLoader", "ImageLoader")
GLOBAL = """const { FileLoader } = require("./node_modules/three/src/loaders/FileLoader.js");
const { ImageBitmapLoader } = require("./node_modules/three/src/loaders/ImageBitmapLoader.js");
module.exports = { ...globalThis.THREE, FileLoader, ImageBitmapLoader };
"""
BUNDLE = "--bundle --minify --format=iife --target=es2022 --charset=ascii --legal-comments=none"
ALIAS = "--alias:three/addons=./node_modules/three/examples/jsm --alias:three=./three-global.cjs"
# each with what it shares with the other in front of it
PAGES = {"report.js": ["report.js"], "map.js": ["basemap.js", "map.js"]}
RULES = """
import js from "@eslint/js";
import globals from "globals";
export default [js.configs.recommended, {
  languageOptions: { sourceType: "script", globals: { ...globals.browser, THREE: "readonly", TILES: "readonly" } },
  rules: { "prefer-const": "error", "eqeqeq": "error", "no-var": "error", "max-len": ["error", 120],
           "complexity": ["error", 12], "max-lines-per-function": ["error", 60] },
}];
"""


def main():
    """Fetch the packages, bundle, note where it comes from, and lint."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        modules = folder / "node_modules"
        (folder / "package.json").write_text(
            json.dumps({"private": True, "dependencies": PACKAGES})
        )
        call(
            folder,
            "npm",
            "install",
            "--ignore-scripts",
            "--no-audit",
            "--no-fund",
            "--legacy-peer-deps",
        )
        taken = {
            part for user in USERS for path in modules.glob(user) for part in list_taken(path)
        } - set(FETCHING)
        names = ", ".join(sorted(taken | set(PARTS.replace("\n", " ").split(", "))))
        bundle(
            folder,
            "three",
            f'export {{ {names} }} from "three";\n{CONTROLS}',
            "--global-name=THREE",
        )
        (folder / "three-global.cjs").write_text(GLOBAL)
        bundle(folder, "tiles", TILES, "--global-name=TILES", *ALIAS.split())
        lock = json.loads((folder / "package-lock.json").read_text("utf-8"))["packages"]
        source = []
        for name, package in (("tiles", "3d-tiles-renderer"), ("three", "three")):
            licence = (
                (modules / package / "LICENSE").read_text("utf-8").replace("\u00a9", "(c)").strip()
            )
            version, more = (
                PACKAGES[package],
                " with GLTFLoader of three.js (MIT)" if name == "tiles" else "",
            )
            # Apache-2.0 is long: its file beside this has it.
            head = licence if name == "three" else "Apache License 2.0, see three.LICENSES.txt"
            code = (
                f"/*! {package} "
                f"{version}{more}\n{head}\n*/\n{(folder / f'{name}.js').read_text('ascii')}"
            )
            (WEB / f"{name}.js").write_text(code, "ascii", newline="\n")
            source += [
                f"{name}.js: parts of {package} {version}{more} (npm, "
                f"{lock[f'node_modules/{package}']['integrity']}),",
                f"bundled by esbuild {PACKAGES['esbuild']} as tools/bundle_three.py says.",
                f"sha256 of {name}.js: "
                f"{hashlib.sha256((WEB / f'{name}.js').read_bytes()).hexdigest()}",
                *("", licence, ""),
            ]
            print(f"{WEB / f'{name}.js'}: {len(code):,} bytes")
        (WEB / "three.LICENSES.txt").write_text(
            "\n".join(source).rstrip() + "\n", "utf-8", newline="\n"
        )
        (folder / "eslint.config.mjs").write_text(RULES)
        for page, own in PAGES.items():
            (folder / page).write_bytes(
                b"".join(
                    (WEB / name).read_bytes()
                    for name in ("viewer.js", "supply.js", "building.js", *own)
                )
            )
        call(folder, "npx", "eslint", *PAGES)


def list_taken(path):
    """Names that a module takes from three."""
    taken = re.findall(r'import\s*{([^}]*)}\s*from\s*["\']three["\']', path.read_text("utf-8"))
    return {part.split(" as ")[0].strip() for names in taken for part in names.split(",")} - {""}


def bundle(folder, name, code, *options):
    """Bundle a module's code into NAME.js."""
    (folder / f"{name}.mjs").write_text(code)
    call(folder, "npx", "esbuild", f"{name}.mjs", f"--outfile={name}.js", *BUNDLE.split(), *options)


def call(folder, *command):
    """Run a command in a folder; its output shows."""
    subprocess.run(command, cwd=folder, check=True)


if __name__ == "__main__":
    main()
