"""The tracer's task, done by another engine: Radiance (rcontrib), as pyradiance brings it.

    python benchmarks/peers/radiance.py [--scene FILE] [--work FOLDER] [--triangles 200] [--points
    16] [--json] …

FOLDER/venv-radiance (build/peers where --work is not given) is made with pyradiance, which brings
the programs; nothing of it enters the environment that citypv runs in.

The task: light on triangles of the town of tests/data/town.npz (91,764 triangles, 143 suns) from
each sun and from the diffuse sky, with three reflections at albedo 0.25; light from below the
horizon is none. rcontrib follows paths back from --points points of each triangle, spread evenly by
chance, with --divisions ambient rays from each and one from each further meeting (-ad, -lw 0, -ab
4); every meeting is tied to the suns by shadow rays. It goes point by point, so that --triangles of
the reference's 3,000 are enough to tell its error, and its time for all triangles is theirs times
91,764 / --triangles. The octree is made before and given apart. --scene names another .npz:
peers/mitsuba.py says what it holds, and `wanted` is the number of triangles whose light is wanted
(all of them where it is not given).

With --json one object goes to standard output: `cpu_whole` and `cpu_sample` [s], `octree_seconds`,
and `year`, the rms of the light of a year in percent of its mean, as in benchmarks/accuracy.py.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import time
import venv
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
TOWN = ROOT / "tests" / "data" / "town.npz"
PACKAGE = "pyradiance==1.3.1"
ALBEDO = 0.25
REFLECTIONS = 3
SUN_ANGLE = 0.1  # [°] across
RAY_OFFSET = 1e-3  # [m] along the normal


def prepare_programs(work):
    """Make WORK/venv-radiance with pyradiance where it is not there already: folders of programs
    and of functions.
    """
    folder = work / "venv-radiance"
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    if not python.exists():
        print(f"{folder}: installing {PACKAGE}", file=sys.stderr)
        venv.create(folder, with_pip=True)
        subprocess.run(
            [python, "-m", "pip", "install", "--quiet", PACKAGE], check=True, stdout=sys.stderr
        )
    find = (
        "import importlib.util as u, pathlib; "
        "print(pathlib.Path(u.find_spec('pyradiance').origin).parent)"
    )
    place = Path(
        subprocess.run(
            [python, "-c", find], check=True, capture_output=True, text=True
        ).stdout.strip()
    )
    return place / "bin", place / "lib"


def write_scene(city, folder):
    """Triangles, suns and sky as Radiance reads them: the two files."""
    corners = city["vertices"][city["triangles"]].reshape(-1, 9)
    lines = [f"void plastic grey 0 0 5 {ALBEDO} {ALBEDO} {ALBEDO} 0 0"]
    lines += [
        f"grey polygon t{i} 0 0 9 " + " ".join(f"{x:.5f}" for x in row)
        for i, row in enumerate(corners)
    ]
    (folder / "city.rad").write_text("\n".join(lines))
    radiance = 1 / (np.pi * np.sin(np.radians(SUN_ANGLE / 2)) ** 2)  # of irradiance 1
    dome = 1 / np.pi  # radiance of irradiance 1
    lines = [
        f"void glow sky 0 0 4 {dome:.8f} {dome:.8f} {dome:.8f} 0",
        "sky source dome 0 0 4 0 0 1 180",
    ]
    for index, (x, y, z) in enumerate(city["sun"]):
        lines.append(f"void light sun{index} 0 0 3 {radiance:.8g} {radiance:.8g} {radiance:.8g}")
        lines.append(f"sun{index} source s{index} 0 0 4 {x:.8f} {y:.8f} {z:.8f} {SUN_ANGLE}")
    (folder / "lights.rad").write_text("\n".join(lines))
    names = [*(f"sun{index}" for index in range(len(city["sun"]))), "sky"]
    (folder / "lights.txt").write_text("\n".join(names))
    return folder / "city.rad", folder / "lights.rad"


def place_points(city, rows, count, seed):
    """Points of some triangles, just above them, with their normals: (rows · count, 6) float64."""
    generator = np.random.default_rng(seed)
    corners = city["vertices"][city["triangles"][rows]]
    edges = corners[:, 1:] - corners[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    u, v = generator.random((2, len(rows), count))
    # One point in each of as many strips of equal area, so that they lie evenly.
    u = np.sqrt((np.argsort(generator.random(u.shape), axis=1) + u) / count)
    places = (
        corners[:, None, 0]
        + (u * (1 - v))[..., None] * edges[:, None, 0]
        + (u * v)[..., None] * edges[:, None, 1]
    )
    places += RAY_OFFSET * normal[:, None]
    return np.concatenate([places, np.broadcast_to(normal[:, None], places.shape)], axis=2).reshape(
        -1, 6
    )


def trace(programs, octree, folder, points, options):
    """Contributions of each light to each point, (points, suns + 1), and processor seconds."""
    environment = {**os.environ, "RAYPATH": f".{os.pathsep}{programs[1]}"}
    command = [
        str(programs[0] / "rcontrib"),
        "-I+",
        "-V+",
        "-h",
        "-faa",
        "-ab",
        str(REFLECTIONS + 1),
        "-n",
        str(options.threads),
        "-ad",
        str(options.divisions),
        "-lw",
        "0",
        "-lr",
        str(REFLECTIONS + 1),
        "-as",
        "0",
        "-st",
        "0",
        "-ss",
        "0",
        "-dj",
        "0",
        "-dt",
        "0",
        "-dc",
        "1",
        "-dr",
        "0",
        "-M",
        str(folder / "lights.txt"),
        str(octree),
    ]
    text = "\n".join(" ".join(f"{x:.6f}" for x in row) for row in points)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        command, input=text, check=True, capture_output=True, text=True, env=environment
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    values = np.array(done.stdout.split(), float).reshape(len(points), -1, 3)[..., 0]
    return values, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def weights_of(city):
    """Weights of the suns: (s,) float64."""
    count = len(city["sun"])
    return city.get("weight", np.full(count, 1 / count))


def light_of_year(city):
    """The reference, mean over the suns plus the sky: (k,) float64."""
    if "light" in city:
        return city["light"]
    return (
        (city["direct"] + city["direct_reflected"]) @ weights_of(city)
        + city["diffuse"]
        + city["diffuse_reflected"]
    )


def measure(options):
    """Run the task: dict of numbers."""
    with np.load(options.scene) as file:
        city = dict(file)
    folder = options.work.resolve() / "radiance" / options.scene.stem
    folder.mkdir(parents=True, exist_ok=True)
    programs = prepare_programs(options.work.resolve())
    started = time.perf_counter()
    octree = folder / "city.oct"
    with octree.open("wb") as file:
        scene = write_scene(city, folder)
        subprocess.run(
            [programs[0] / "oconv", *scene],
            check=True,
            stdout=file,
            env={**os.environ, "RAYPATH": "."},
        )
    before = time.perf_counter() - started
    chosen = np.sort(
        np.random.default_rng(options.seed).permutation(len(city["triangle"]))[: options.triangles]
    )
    points = place_points(city, city["triangle"][chosen], options.points, options.seed)
    values, seconds = trace(programs, octree, folder, points, options)
    found, known = (
        values.reshape(len(chosen), options.points, -1).mean(axis=1),
        light_of_year(city)[chosen],
    )
    year = found[:, :-1] @ weights_of(city) + found[:, -1]
    count = int(city.get("wanted", len(city["triangles"])))
    return {
        "engine": "radiance",
        "version": PACKAGE,
        **{
            name: getattr(options, name)
            for name in ("threads", "triangles", "points", "divisions", "seed")
        },
        "octree_seconds": before,
        "cpu_sample": seconds,
        "cpu_whole": seconds * count / len(chosen),
        "bias": float(year.mean() / known.mean() - 1),
        "year": 100 * float(np.sqrt(np.mean((year - known) ** 2)) / known.mean()),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--work", type=Path, default=ROOT / "build" / "peers", help="folder for the environment"
    )
    parser.add_argument(
        "--scene", type=Path, default=TOWN, help="file with triangles, suns and reference"
    )
    parser.add_argument(
        "--triangles", type=int, default=200, help="of those with a reference (200)"
    )
    parser.add_argument("--points", type=int, default=16, help="per triangle (16)")
    parser.add_argument(
        "--divisions", type=int, default=16, help="ambient rays from each point (16)"
    )
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true", help="one object instead of lines")
    options = parser.parse_args()
    found = measure(options)
    if options.json:
        print(json.dumps(found))
        return
    for name, value in found.items():
        print(f"{name:>15} {value}")


if __name__ == "__main__":
    main()
