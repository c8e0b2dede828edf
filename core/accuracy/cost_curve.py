"""Cost curve of a scene: predicted seconds and errors of presets and of each setting, from a pilot.

Seconds are the pilot's, times patches, rays, points and suns over its own. The variance of each
source of error falls with the power of the number of rays or points that every run takes for it
(`yield_errors.SAMPLED`); what the size of patches leaves falls with the square of their length.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from ..light.prepare_scene import PreparedScene, prepare_scene
from ..light.shadow_points import count_elements
from ..settings.presets import PRESETS
from ..settings.progress import describe_duration, silent
from ..settings.request import Request
from ..sun.sun_sampling import choose_suns
from .pilot import Pilot, PilotRun, run_pilot
from .sun_sampling import FEWER, CityYear, measure_ways
from .yield_errors import SAMPLED


def seconds_of_writing(size):
    """Time [s] in which tables and transfer.nc of so many bytes are written."""
    return size / 20e6


@dataclass
class _Prediction:
    """One line of the list."""

    name: str
    knobs: dict  # settings, with the number of suns, and rounds
    seconds: float  # of the whole run
    tracing: float  # [s] wall time of tracing
    processor: float  # [s] processor time of tracing
    median: float  # [%] error of full load hours of half of the eligible area
    error: float  # [%] on 95 % of the eligible area
    largest: str | None  # source of the largest part of it
    bounces_left: float  # [%] of all light that further reflections would add, about


@dataclass
class _CostCurve:
    """What accuracy costs on a scene."""

    prices: list  # of Prediction: the presets first
    pilot_seconds: float
    patches: int
    fixed: float  # [s] of every run: reading, preparing, sun sampling, electricity

    def describe(self):
        """The list as lines of text."""
        # First the number of patches, and the seconds of the pilot and of all that is not tracing.
        # Then a table for the terminal: of each prediction its settings, seconds of the run and of
        # tracing, errors that half and 95 % of the area do not exceed, their largest source, and
        # light left out.
        lines = [
            f"{self.patches:,} patches; the pilot took {describe_duration(self.pilot_seconds)}; "
            f"reading, checks and files add {describe_duration(self.fixed)} to tracing",
            "Standard error of full load hours that half and 95 % of the area with modules do not "
            "exceed, "
            "its largest part, "
            "and the light beyond the last reflection:",
            f"{'':24} {'seconds':>8} {'tracing':>8} {'half of':>8} {'95 % of':>8} "
            f"{'largest part':14} "
            f"{'reflections':>11}",
            f"{'':24} {'':>8} {'':>8} {'area, %':>8} {'area, %':>8} {'':14} {'left out, %':>11}",
        ]
        # A line a prediction; an error that is not known is a dash.
        for one in self.prices:
            source = {"passed_on": "reflected", "discretisation": "patch size"}.get(
                one.largest, one.largest or "none"
            )
            half, most = (
                f"{value:.2f}" if np.isfinite(value) else "–" for value in (one.median, one.error)
            )
            lines.append(
                f"{one.name:24} {one.seconds:8.1f} {one.tracing:8.1f} {half:>8} {most:>8} "
                f"{source:14} "
                f"{one.bounces_left:11.2f}"
            )
        # Without modules no error is known, and a last line says so.
        if not any(np.isfinite(prediction.error) for prediction in self.prices):
            lines.append(
                "No surface carries modules, so there are no errors of full load hours to predict."
            )
        return lines


@dataclass
class PredictedCity:
    """A city with its pilot, and what some choices of suns do to full load hours on it."""

    pilot: Pilot
    suns: dict  # choice of suns -> Suns
    sampling: dict  # choice of suns -> what `measure_ways` found
    checking: float  # [s] to measure `sampling`, here or in a run on more patches under fewer suns
    patch_size: float | None
    prepared: PreparedScene

    def bounces_of(self, request):
        """Reflections of a run with some settings: as asked, or as many as the pilot needed."""
        return self.pilot.run.bounces if request.max_bounces is None else request.max_bounces

    def predict_seconds(self, request, rounds=1):
        """Wall and processor time of tracing, and of writing what grows with the suns [s]: three
        float.
        """
        # How many patches there would be of those with all rays and of those with fewer, by patch
        # size.
        pieces, full, suns = (
            self.pieces(request.patch_size),
            self.prepared.plan.receivers,
            len(self.suns[request.suns]),
        )
        full = np.ones(len(pieces), bool) if full is None else full
        growth = (pieces[some].mean() if some.any() else 1.0 for some in (full, ~full))
        counts = tuple(
            more * count for more, count in zip(growth, self.pilot.run.counts, strict=True)
        )
        run = PilotRun(
            request.samples, request.shadow_samples, self.bounces_of(request), suns, counts
        )
        # Seconds by the pilot's model of work; threads and waiting as in the pilot.
        processor = rounds * self.pilot.run.predict_seconds(run)
        writing = seconds_of_writing(8.0 * len(self.prepared.scene.surfaces) * suns)
        return processor * self.pilot.run.pace, processor, writing

    def predict_errors(self, request, rounds=1):
        """YieldErrors of the city's surfaces with other settings."""
        # Variance falls with a power of the samples of each source, with the rounds in proportion.
        run, errors = self.pilot.run, self.pilot.errors
        rays, points = request.samples / run.samples, request.shadow_samples / run.shadow_samples
        more = {"rays": rays, "shadows": points, "passed_on": np.sqrt(rays * points)}
        # Uneven light inside elements: its square falls with their number.
        elements = [count_elements(settings.shadow_samples) for settings in (request, run)]
        variance = {
            name: errors.variance[name] / (more[name] ** SAMPLED[name] * rounds) for name in SAMPLED
        }
        variance["discretisation"] = errors.variance["discretisation"] * elements[1] / elements[0]
        # More patches on a surface average out what each has of its own.
        owner, pieces = self.prepared.scene.triangle_surface, self.pieces(request.patch_size)
        patches, more = (
            np.bincount(owner + 1, weight)[1:][errors.rows] for weight in (None, pieces)
        )
        variance = {name: part * patches / more for name, part in variance.items()}
        # Points lie in a net on each patch: more patches make the net of a surface finer.
        variance["shadows"] *= (patches / more) ** (SAMPLED["shadows"] - 1)
        # What the choice of suns does to a surface was measured as a share of the hours.
        variance["suns"] = (self.sampling[request.suns]["rms"] / 100 * errors.hours) ** 2
        return replace(errors, variance=variance, rounds=rounds)

    def pieces(self, size):
        """Patches that take the place of each of the pilot's with another patch size, about: (p,)
        float64.

        With one, two or three long edges it is cut into two, three or four; with larger patches
        small surfaces stay as they are. Generated ground has patches that grow with the distance
        from buildings, whatever the size at these.
        """
        scene, own = self.prepared.scene, self.prepared.scene.triangle_surface
        shares = np.ones(len(own))
        if None in (self.patch_size, size):
            return shares
        # edges  length of the three sides of each triangle [m], a hair shorter so that an edge of
        # just the patch size counts as short enough.
        corners = np.asarray(scene.vertices)[scene.triangles]
        # An edge that has just the patch size is not cut.
        edges = 0.999 * np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        longest = np.maximum(edges.max(axis=1), self.patch_size)
        # ground  patches there are longer by the difference of the two sizes, whatever their
        # distance, and as many fewer by the square.
        ground = (longest / (longest + size - self.patch_size)) ** 2
        # Larger patches are fewer, but a surface keeps at least its two.
        if size > self.patch_size:
            # A surface has two patches, whatever their size.
            shares = np.clip(2 / np.bincount(own + 1)[own + 1], (self.patch_size / size) ** 2, 1)
        # Each turn halves the edges that are too long and makes as many more pieces of the
        # triangle.
        while (long := edges > size).any():
            shares *= 1 + long.sum(axis=1)
            edges /= 2
        return np.where(own < 0, ground, shares)


def predict_city(inputs, ways, progress=silent):
    """Trace the pilot of a city, and compare some choices of suns: PredictedCity.

    Parameters
    ----------
    inputs : CityYear
    ways : collection of str
    progress : callable
    """
    _, prepared, weather, request = inputs
    pilot = run_pilot(inputs, progress)
    # The pilot's patches are looked at under each choice of suns, and timed for its cost.
    suns = {way: choose_suns(way, *weather.axis, position=weather.data) for way in ways}
    started = time.perf_counter()
    measured = measure_ways(inputs, pilot.transfer, list(suns.values()), progress, patches=FEWER)
    checking, sampling = time.perf_counter() - started, dict(zip(suns, measured, strict=True))
    return PredictedCity(pilot, suns, sampling, checking, request.patch_size, prepared)


def predict_costs(scene, weather, request, reading=0.0, progress=silent):
    """Trace a pilot, and predict seconds and errors of each preset, and of the run asked for with
    one setting changed at a time.

    Parameters
    ----------
    scene : Scene
    weather : Weather
    request : Request
        Whose settings are varied one at a time.
    reading : float
        Seconds that reading took.
    progress : callable

    Returns
    -------
    CostCurve
        The list of predictions, seconds of the pilot, how many patches there are, and seconds that
        every run takes besides tracing and writing.
    """
    # The scene is prepared and the pilot traced once; every line of the list is predicted from it.
    started = time.perf_counter()
    prepared = prepare_scene(scene, request, weather=weather).build_tree(request)
    preparing = time.perf_counter() - started
    # Choices of suns to compare: the one asked for, and the usual ones.
    ways = list(
        dict.fromkeys(
            [
                request.suns,
                "days:12",
                "days:24",
                "days:52",
                "typical-days:12",
                "sky-grid:1654",
                "hourly",
            ]
        )
    )
    city = predict_city(CityYear(scene, prepared, weather, request), ways, progress)
    # Seconds of every run besides tracing and writing: reading, preparing, checks, electricity.
    fixed = reading + preparing + city.checking + city.pilot.electricity
    run = city.pilot.run
    # The share of reflected light falls by the same factor each time.
    factor = min(run.last_bounce ** (1 / run.bounces), 0.99) if run.bounces else 0.0

    def predict(name, rounds=1, **changes):
        one = replace(request, **changes)
        # One line: settings of the run, its seconds, its errors, and the light after its last
        # reflection, by the sum of a geometric series.
        bounces, errors = city.bounces_of(one), city.predict_errors(one, rounds)
        knobs = {
            "samples": one.samples,
            "shadow_samples": one.shadow_samples,
            "suns": len(city.suns[one.suns]),
            "way": one.suns,
            "bounces": bounces,
            "patch_size": one.patch_size,
            "rounds": rounds,
        }
        wall, processor, writing = city.predict_seconds(one, rounds)
        parts = errors.at_share(share=0.5), errors.at_share(), errors.largest()
        left = 100 * factor ** (bounces + 1) / (1 - factor)
        return _Prediction(name, knobs, wall + fixed + writing, wall, processor, *parts, left)

    # A preset stands for the program's defaults where it names nothing.
    plain = {name: getattr(Request(), name) for name in ("samples", "shadow_samples", "suns")}
    # Presets first, then each setting by itself, the others as asked; patch sizes only where the
    # run has patches, not whole polygons.
    listed = [predict(name, **plain | changes) for name, changes in PRESETS.items()]
    listed += [predict(f"--samples {count}", samples=count) for count in (64, 256, 1024, 4096)]
    listed += [
        predict(f"--shadow-samples {count}", shadow_samples=count) for count in (4, 16, 64, 256)
    ]
    listed += [predict(f"--suns {way}", suns=way) for way in ways]
    listed += [predict(f"--max-bounces {count}", max_bounces=count) for count in range(6)]
    if request.patch_size:
        listed += [predict(f"--patch-size {size:g}", patch_size=size) for size in (20.0, 10.0, 5.0)]
    # Last, the run as asked for, but traced in 4 and in 16 rounds.
    listed += [predict(f"{rounds} rounds", rounds=rounds) for rounds in (4, 16)]
    return _CostCurve(listed, time.perf_counter() - started, len(prepared.patches), fixed)
