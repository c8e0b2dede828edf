"""Error of each choice of suns (the paper's Fig. 5), hour by hour against hourly suns.

    python benchmarks/suns.py [CITY] [--weather FILE] [--latitude D --longitude D] [--group KIND
    ORIENTATION]
        [--sky perez|isotropic] [--sectors 8|paper] [--patches N] [--ways WAY …] [--threads N]
        [--plot FILE.png]

Without CITY: Midtown Manhattan, placed at Cairo with Cairo's typical year. Without --group: all
eligible surfaces. Visible shares of the suns are traced for patches drawn by area from the surfaces
of the group, from the same 16 points each under every way. Light that is reflected counts with the
sky's, not with the suns': it changes slowly. Printed: number of suns, processor seconds to look for
them, mean absolute error of the hourly capacity factor of the group (over all hours of the year,
nights included; of several groups the mean by their patches), error of the annual full load hours,
and root mean square error of the full load hours of single patches. The figure of the paper:

    python benchmarks/suns.py --group facade south --sky isotropic --sectors paper --plot
    docs/validation/suns.png
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from citypv.core.energy.compute_energy import compute_energy
from citypv.core.light.shadow_points import points_above
from citypv.core.light.sun_visibility import SunWatch, sun_visibility
from citypv.core.patches.patches import Patches
from citypv.core.patches.read_albedo import albedo_of_triangles
from citypv.core.rays.ray_scene import RayScene
from citypv.core.run.study import read_scene, read_year, trace_scene
from citypv.core.settings.request import Request
from citypv.core.settings.threads import usable_threads
from citypv.core.sky.sky_models import choose_sky
from citypv.core.sun.sun_sampling import choose_suns

DATA = Path(__file__).parents[1] / "tests" / "data"
CITY = DATA / "obj" / "nyc_midtown_citicorp_1km.obj.gz"
WEATHER = DATA / "weather" / "EGY_Cairo.Intl.Airport.623660_ETMY.epw.gz"
WAYS = [
    *(f"typical-days:{count}" for count in (4, 12, 24, 52)),
    *(f"days:{count}" for count in (12, 24, 36, 52)),
    *(f"sky-grid:{count}" for count in (673, 1654, 3219)),
]
DRAWN = {
    "typical-days:12": "tab:red",
    "typical-days:24": "tab:green",
    "typical-days:52": "tab:blue",
    "days:24": "black",
}
WINDOW = 16  # of 365 days drawn in detail


def main():
    options = read_arguments()
    request = Request(
        weather=str(options.weather),
        weather_without=options.weather_without
        or ("dni" if options.weather == WEATHER else "none"),
        latitude=options.latitude,
        longitude=options.longitude,
        sky=options.sky,
        sectors=options.sectors,
        threads=options.threads,
        suns="days:1",
        samples=16,
        max_bounces=1,
    )
    scene = read_scene(options.city, request)
    weather = read_year(scene.site, request)
    if options.group:
        kind, orientation = options.group
        scene.surfaces.eligible &= (scene.surfaces.kind == kind) & (
            scene.surfaces.orientation == orientation
        )
    look = Looker(scene, weather, request, options.patches)
    # Exclude compilation and the first rays from the times.
    look.energy("days:1")
    hourly, suns, seconds = look.energy("hourly")
    print(f"{len(look.chosen):,} patches, every hour: {suns:,} suns, {seconds:.1f} s")
    print("| way | suns | s | MAE [1e-4] | bias | rms |\n|---|--:|--:|--:|--:|--:|")
    errors = {}
    for way in options.ways:
        found, suns, seconds = look.energy(way)
        errors[way] = found.capacity_factor - hourly.capacity_factor
        mae = 1e4 * np.average(np.abs(errors[way]).mean(axis=0), weights=hourly.group_count)
        difference, mean = (
            found.full_load_hours - hourly.full_load_hours,
            hourly.full_load_hours.mean(),
        )
        bias, rms = 100 * difference.mean() / mean, 100 * np.sqrt((difference**2).mean()) / mean
        print(
            f"| {way} | {suns:,} | {seconds:.1f} | {mae:.1f} | {bias:+.3f} % | {rms:.2f} % |",
            flush=True,
        )
    if options.plot:
        draw(hourly, errors, options)


def read_arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("city", nargs="*", default=[CITY])
    parser.add_argument("--weather", default=WEATHER)
    parser.add_argument(
        "--weather-without",
        help="column to derive from the others; Cairo's DNI is an hour's end off",
    )
    parser.add_argument("--latitude", type=float)
    parser.add_argument("--longitude", type=float)
    parser.add_argument("--group", nargs=2, metavar=("KIND", "ORIENTATION"))
    parser.add_argument("--sky", default="auto")
    parser.add_argument("--sectors", default="8")
    parser.add_argument("--patches", type=int, default=4000)
    parser.add_argument("--ways", nargs="+", default=WAYS)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--plot", type=Path)
    options = parser.parse_args()
    if options.city == [CITY] and options.latitude is None:
        options.latitude, options.longitude = 30.13, 31.40
    return options


class Looker:
    """Some patches of a scene, and what they receive under any suns."""

    def __init__(self, scene, weather, request, count):
        self.weather, self.request = weather, request
        # Sky, far ground and reflections of the surfaces; of the suns only a few.
        self.transfer = trace_scene(scene, weather, replace(request, shadow_samples=1))
        self.sky = choose_sky(request, self.transfer)
        patches = Patches.of_scene(scene, albedo_of_triangles(scene, request), request.seed)
        own = scene.triangle_surface
        share = np.where(np.append(scene.surfaces.eligible, False)[own], patches.area, 0)
        rng = np.random.default_rng(request.seed)
        self.chosen = np.sort(
            rng.choice(
                len(own), min(count, np.count_nonzero(share)), replace=False, p=share / share.sum()
            )
        )
        self.patches, self.surfaces = patches.take(self.chosen), own[self.chosen]
        self.ray_scene = RayScene(scene.vertices, scene.triangles)

    def energy(self, way):
        """Energy of the patches, the number of suns, and the processor seconds it took to look for
        these.
        """
        weather, count = self.weather, len(self.patches)
        suns = choose_suns(way, *weather.axis)
        before = time.process_time()
        watch = SunWatch(
            self.ray_scene,
            self.patches,
            self.patches.receives,
            np.zeros(count, bool),
            np.zeros((count, 1), bool),
            points_above(self.request.shadow_samples),
            threads=usable_threads(self.request.threads),
        )
        light, *_ = sun_visibility(
            watch, (suns.direction.astype(np.float32), suns.weight.astype(np.float32))
        )
        seconds = time.process_time() - before
        part, dark = self.transfer.take(self.surfaces), np.zeros_like(light.visible_share)
        part = replace(part, suns=suns, visible_share=light.visible_share, direct_reflected=dark)
        part.surfaces.area = np.ones(count)  # they were drawn by area
        return compute_energy(part, weather, sky=self.sky), len(suns), seconds


def draw(hourly, errors, options):
    """Capacity factor over the year, and the errors of some ways."""
    import matplotlib.pyplot as plt

    factor, count = hourly.capacity_factor[:, 0], len(hourly.times)
    day = np.arange(count) * (hourly.interval.total_seconds() / 86_400)
    figure, axes = plt.subplots(3, 1, figsize=(10, 8.5), constrained_layout=True)
    axes[0].plot(day, factor, linewidth=0.4, color="0.3")
    axes[0].set(
        title=f"{' '.join(hourly.groups[0])}, every hour's sun",
        ylabel="hourly capacity factor",
        ylim=(0, None),
    )
    shown = {way: colour for way, colour in DRAWN.items() if way in errors}
    for axis, (first, last) in zip(axes[1:], ((0, 365), (80, 80 + WINDOW)), strict=True):
        part = (day >= first) & (day < last)
        for way, colour in shown.items():
            error = 1e4 * errors[way][:, 0]
            mae = np.abs(error).mean()
            axis.plot(
                day[part], error[part], linewidth=0.6, color=colour, label=f"{way}, MAE {mae:.1f}"
            )
        axis.set(ylabel="error [10⁻⁴]")
        axis.grid(alpha=0.3)
    axes[1].legend(
        ncols=len(shown), loc="lower left", bbox_to_anchor=(0, 1), frameon=False, fontsize=8
    )
    axes[2].set(xlabel="day of the year")
    figure.savefig(options.plot, dpi=110)


if __name__ == "__main__":
    main()
