"""Bundle the parts of three.js that the report's 3D view uses, and check our own JavaScript for style.

    python3 tools/bundle_three.py

Writes core/results/web/three.js, the same bytes every time, and the versions and hashes beside it. Needs npm and a
network, which nobody needs to install, run or test CityPV.
"""

import hashlib
import json
import subprocess
import tempfile
from pathlib import Path

WEB = Path(__file__).resolve().parent.parent / "core" / "results" / "web"
PACKAGES = {"three": "0.169.0", "esbuild": "0.28.2", "eslint": "9.39.5", "@eslint/js": "9.39.5", "globals": "16.4.0"}
PARTS = """
export { BufferAttribute, BufferGeometry, Color, ColorManagement, DoubleSide, LinearSRGBColorSpace, LineBasicMaterial,
  LineSegments, Mesh, MeshBasicMaterial, PerspectiveCamera, Raycaster, Scene, Vector2, Vector3, WebGLRenderer }
  from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
"""
BUNDLE = "--bundle --minify --format=iife --global-name=THREE --target=es2022 --charset=ascii --legal-comments=none"
RULES = """
import js from "@eslint/js";
import globals from "globals";
export default [js.configs.recommended, {
  languageOptions: { sourceType: "script", globals: { ...globals.browser, THREE: "readonly" } },
  rules: { "prefer-const": "error", "eqeqeq": "error", "no-var": "error", "max-len": ["error", 120],
           "complexity": ["error", 12], "max-lines-per-function": ["error", 60] },
}];
"""


def main():
    """Fetch the packages, bundle, note where it comes from, and lint."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "package.json").write_text(json.dumps({"private": True, "dependencies": PACKAGES}))
        call(folder, "npm", "install", "--ignore-scripts", "--no-audit", "--no-fund")
        (folder / "parts.mjs").write_text(PARTS)
        call(folder, "npx", "esbuild", "parts.mjs", "--outfile=three.js", *BUNDLE.split())
        licence = (folder / "node_modules/three/LICENSE").read_text("utf-8").replace("\u00a9", "(c)").strip()
        version = PACKAGES["three"]
        code = f"/*! three.js {version} with OrbitControls\n{licence}\n*/\n{(folder / 'three.js').read_text('ascii')}"
        (WEB / "three.js").write_text(code, "ascii", newline="\n")
        lock = json.loads((folder / "package-lock.json").read_text("utf-8"))["packages"]
        digest = hashlib.sha256((WEB / "three.js").read_bytes()).hexdigest()
        source = [
            f"three.js: parts of three {version} (npm, {lock['node_modules/three']['integrity']}),",
            f"bundled by esbuild {PACKAGES['esbuild']} as tools/bundle_three.py says.",
            f"sha256 of three.js: {digest}",
            "",
            licence,
        ]
        (WEB / "three.LICENSES.txt").write_text("\n".join(source) + "\n", "utf-8", newline="\n")
        (folder / "eslint.config.mjs").write_text(RULES)
        (folder / "viewer.js").write_bytes((WEB / "viewer.js").read_bytes())
        call(folder, "npx", "eslint", "viewer.js")
        print(f"{WEB / 'three.js'}: {len(code):,} bytes, sha256 {digest}")


def call(folder, *command):
    """Run a command in a folder; its output shows."""
    subprocess.run(command, cwd=folder, check=True)


if __name__ == "__main__":
    main()
