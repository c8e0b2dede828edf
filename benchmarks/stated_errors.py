"""Whether stated standard errors are as large as the scatter over seeds, surface by surface on real
cities.

    python benchmarks/stated_errors.py CITY [--half M] [--seeds 16] [--latitude D --longitude D]
    [--lod L]
        [--samples N] [--threads N] [--save FILE]

CITY is a file of buildings. Each seed traces it anew with the same suns; full load hours are those
of a clear sky. Printed, for classes of eligible surfaces: the standard deviation over the seeds
over the stated error, both as root mean squares over the class; the largest ratio of a single
surface; and the same for the means of the groups. What the choice of suns does is the same for all
seeds and left out. Covered shares are to be the same with every seed; how many surfaces have other
ones is printed.

With --half only polygons within so many metres of the middle stay eligible; all others still shade
and reflect.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from citypv.core.energy.compute_energy import compute_energy
from citypv.core.light.trace_gather import trace_gather
from citypv.core.run.study import read_scene, read_year
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns

SMALL = 20.0  # [m²]
FEW_HOURS = 0.5  # [h] below which a scatter means nothing


def run_seeds(scene, request, seeds):
    """Of every seed full load hours, their stated errors, those of groups and their stated errors,
    covered shares.
    """
    weather = read_year(scene.site, request)
    year = weather.data.index, weather.interval, scene.site.latitude, scene.site.longitude
    suns = choose_suns(request.suns, *year).progressive_order()
    runs = []
    for seed in range(seeds):
        started = time.perf_counter()
        transfer = trace_gather(scene, suns, replace(request, seed=seed), silent)
        energy = compute_energy(transfer, weather)
        hours = (
            energy.capacity_factor.sum(axis=0)
            * weather.interval.total_seconds()
            / 3600
            / energy.years
        )
        runs.append(
            (
                energy.full_load_hours,
                energy.full_load_hours_standard_error,
                hours,
                energy.group_standard_error,
                transfer.covered_share,
            )
        )
        print(f"seed {seed}: {time.perf_counter() - started:.0f} s", flush=True)
    return [np.array(part) for part in zip(*runs, strict=True)], energy.groups


def tell_classes(surfaces, covered_share):
    """Name and members of classes of eligible surfaces."""
    partly = (covered_share > 0.01) & (covered_share < 0.99)
    return {
        "facades": surfaces.kind == "facade",
        "roofs": surfaces.kind == "roof",
        "small": surfaces.area < SMALL,
        "partly covered": partly,
        "all": np.ones(len(surfaces), bool),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("city", type=Path)
    parser.add_argument("--half", type=float)
    parser.add_argument("--seeds", type=int, default=16)
    parser.add_argument("--latitude", type=float)
    parser.add_argument("--longitude", type=float)
    parser.add_argument("--lod")
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--save", type=Path, help="keep all numbers in an .npz file")
    options = parser.parse_args()
    names = "latitude", "longitude", "lod", "samples", "threads"
    request = Request(**{name: getattr(options, name) for name in names})
    scene = read_scene([options.city], request)
    surfaces = scene.surfaces
    if options.half:
        corners, own = scene.vertices[scene.triangles].mean(axis=1), scene.triangle_surface
        middle = np.median(corners[own >= 0], axis=0)[:2]
        far = np.abs(corners[:, :2] - middle).max(axis=1) > options.half
        surfaces.eligible[np.unique(own[far & (own >= 0)])] = False
    (hours, stated, means, stated_means, covered), groups = run_seeds(scene, request, options.seeds)
    covered_share = covered[-1]
    if options.save:
        np.savez(
            options.save,
            hours=hours,
            stated=stated,
            names=surfaces.surface_id,
            eligible=surfaces.eligible,
            kind=surfaces.kind,
            area=surfaces.area,
            covered_share=covered,
        )
    scatter, error = hours.std(axis=0, ddof=1), np.sqrt((stated**2).mean(axis=0))
    print(
        f"{len(scene.triangles):,} patches, {surfaces.eligible.sum():,} eligible surfaces, "
        f"{options.seeds} seeds"
    )
    print(
        f"covered shares that differ between seeds: {np.ptp(covered, axis=0).astype(bool).sum():,}"
    )
    print("class            surfaces  scatter  stated  ratio  95 %   largest")
    for name, members in tell_classes(surfaces, covered_share).items():
        chosen = np.flatnonzero(members & surfaces.eligible & np.isfinite(error))
        if not len(chosen):
            continue
        a, b = (np.sqrt((part[chosen] ** 2).mean()) for part in (scatter, error))
        clear = chosen[(scatter[chosen] > FEW_HOURS) | (error[chosen] > FEW_HOURS)]
        single = scatter[clear] / np.maximum(error[clear], 1e-9)
        worst = clear[single.argmax()] if len(clear) else -1
        tail = f"{np.quantile(single, 0.95):5.2f} {single.max():5.2f} " if len(clear) else ""
        tail += surfaces.surface_id[worst] if len(clear) else ""
        print(f"{name:16} {len(chosen):8,} {a:7.2f} {b:7.2f} {a / b:6.2f} {tail}")
    for column, group in enumerate(groups):
        a, b = means[:, column].std(ddof=1), np.sqrt((stated_means[:, column] ** 2).mean())
        mean = means[:, column].mean()
        print(
            f"mean of {' '.join(group):16} {mean:8.2f} h ± {a:.3f} (stated {b:.3f}), ratio "
            f"{a / b:.2f}"
        )


if __name__ == "__main__":
    main()
