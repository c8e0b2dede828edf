"""Whoever cancels keeps the suns that are done: the numbers of a whole run, a fair sample of the
year, errors told.
"""

import signal
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pandas as pd
import pytest
from scenes import suns_towards
from test_tracing import three_houses
from test_trees import wall_and_tree
from thorough import mark_cases
from transfers import Horizons
from weathers import BERLIN, HOUR, year_of

from citypv.core.energy.compute_energy import compute_energy
from citypv.core.light import sun_blocks, sun_matrix
from citypv.core.light.trace_forward import trace_forward
from citypv.core.light.trace_gather import trace_gather
from citypv.core.run import study
from citypv.core.run.interruption import Interruption
from citypv.core.settings.progress import CancelledError, silent
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns, match_suns, weigh_by_year

TRACERS = {"gather": trace_gather, "forward": trace_forward}
PER_SURFACE = (
    "diffuse_relative",
    "diffuse_relative_standard_error",
    "covered_share",
    "sky_view_factor",
)


def suns_of(way, start="2021-03-01", days=60):
    """Suns of some days of spring, in the order in which they are traced."""
    times = pd.date_range(start, periods=24 * days, freq="h", tz="UTC")
    return choose_suns(way, times, HOUR, *BERLIN).progressive_order()


def cancel_at(stage, share, error=CancelledError):
    """A progress that ends its task once a share of a stage is done."""

    def progress(now, done, total, unit):
        if now == stage and done >= share * total:
            raise error

    return progress


def trace(estimator, suns, progress=silent, **settings):
    settings = {"samples": 16, "shadow_samples": 4, "estimator": estimator} | settings
    return TRACERS[estimator](three_houses(), suns, Request(**settings), progress)


@pytest.mark.slow
@pytest.mark.usefixtures("small_blocks")
@pytest.mark.parametrize(
    ("estimator", "way", "share", "on_disk"),
    mark_cases(
        [
            *(("gather", "hourly", 0.9, False), ("gather", "days:8", 0.3, True)),
            *(("forward", "typical-days:8", 0.5, True), ("forward", "sky-grid:120", 0.3, False)),
        ],
        kept=1,
    ),
)
def test_kept_suns_are_those_of_the_whole_run(estimator, way, share, on_disk, monkeypatch):
    suns = suns_of(way, days=12)
    whole = trace(estimator, suns)
    assert whole.record.interrupted is None
    if on_disk:
        monkeypatch.setattr(sun_matrix, "LIMIT", 0)
    part = trace(estimator, suns, cancel_at("suns", share))
    count = len(part.suns)
    assert (
        (share - 0.25) * len(suns) < count <= share * len(suns) + 16
    )  # a block more, when it is told of as done
    assert count in suns.end_of_days
    assert part.record.interrupted == {"suns_traced": count, "of": len(suns)}
    np.testing.assert_array_equal(part.suns.direction, suns.direction[:count])
    assert part.suns.weight.sum() == pytest.approx(1)
    for name in ("visible_share", "direct_reflected"):
        found = getattr(part, name)
        assert found.shape == (len(whole.surfaces), count)
        np.testing.assert_array_equal(found, getattr(whole, name)[:, :count])
    for name in PER_SURFACE:
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name))
    # The error is that of a run with these suns alone; of a day that was begun the sums hold the
    # first hours as well.
    alone = trace(estimator, suns.first(count)).direct_annual_standard_error
    assert alone.max() > 0
    np.testing.assert_allclose(part.direct_annual_standard_error, alone, rtol=0.5, atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("estimator", "stage"), [("gather", "sky and reflections"), ("forward", "sky and far ground")]
)
def test_before_the_suns_there_is_nothing_to_keep(estimator, stage):
    before = threading.active_count()
    for moment in (stage, "suns"):
        with pytest.raises(CancelledError):
            trace(estimator, suns_of("typical-days:2", days=12), cancel_at(moment, 0))
    assert threading.active_count() == before


@pytest.mark.slow
@pytest.mark.usefixtures("small_blocks")
def test_both_states_of_trees_keep_the_same_suns():
    suns, request = suns_of("hourly", days=12), Request(samples=16, shadow_samples=4)
    whole = trace_gather(wall_and_tree(), suns, request, silent)
    part = trace_gather(wall_and_tree(), suns, request, cancel_at("suns", 0.5))
    count = len(part.suns)
    assert 0.2 * len(suns) < count < 0.6 * len(suns)
    for state, full in ((part, whole), (part.bare, whole.bare)):
        assert state.record.interrupted == {"suns_traced": count, "of": len(suns)}
        for name in ("visible_share", "direct_reflected"):
            np.testing.assert_array_equal(getattr(state, name), getattr(full, name)[:, :count])


@pytest.mark.usefixtures("small_blocks")
@pytest.mark.parametrize("scene", [three_houses, wall_and_tree])
def test_progress_of_suns_grows_to_the_end(scene):
    told, request = [], Request(samples=16, shadow_samples=4)
    suns = suns_of("hourly", days=12)
    trace_gather(
        scene(), suns, request, lambda *report: told.append(report) if report[0] == "suns" else None
    )
    assert told[0][1] == 0
    share = np.array([done / total for _, done, total, _ in told[1:]])
    assert len(share) > 12
    assert (np.diff(share) >= 0).all()
    assert share[0] < 0.1
    assert (share[:-1] < 1).all()
    assert share[-1] == 1
    assert {unit for *_, unit in told[1:]} == {"rays"}


@pytest.mark.parametrize("way", ["hourly", "days:24", "typical-days:12", "sky-grid:1654"])
def test_spreading_loses_no_sun_and_splits_no_day(way):
    suns = choose_suns(way, year_of(), HOUR, *BERLIN)
    spread = suns.progressive_order()
    assert spread.sampling == suns.sampling
    one, other = (
        np.lexsort((part.step, part.day, part.direction[:, 2], part.direction[:, 0]))
        for part in (suns, spread)
    )
    for name in ("direction", "weight", "day", "step"):
        np.testing.assert_array_equal(getattr(spread, name)[other], getattr(suns, name)[one])
    if spread.day[0] >= 0:
        starts = np.flatnonzero(np.diff(spread.day, prepend=-1))
        assert len(starts) == len(np.unique(suns.day))
        inner = np.setdiff1d(np.arange(len(spread)), starts)
        assert (spread.step[inner] > spread.step[inner - 1]).all()


# kept part of the suns -> percent of full load hours: of the mean, of single surfaces (rms)
BOUNDS = {
    "hourly": {1 / 90: (0.5, 2.5), 1 / 9: (0.2, 0.4), 1 / 2: (0.1, 0.1)},
    "days:24": {1 / 3: (0.5, 1.5), 1 / 2: (0.2, 0.8), 3 / 4: (0.1, 0.5)},
    "typical-days:12": {1 / 3: (1.5, 2.5), 1 / 2: (0.5, 1.2), 3 / 4: (0.3, 0.8)},
    "sky-grid:1654": {1 / 30: (2.0, 4.0), 1 / 3: (0.5, 1.2), 1 / 2: (0.4, 1.0)},
}


@pytest.mark.slow
@pytest.mark.parametrize("way", mark_cases(BOUNDS, kept=1))
def test_full_load_hours_of_a_part_of_the_suns(berlin, way):
    """Against every hour's sun, on 150 random skylines in the weather of a year."""
    year, skylines = berlin.axis, Horizons(150)
    true = compute_energy(skylines.transfer(choose_suns("hourly", *year)), berlin).full_load_hours
    spread = choose_suns(way, *year).progressive_order()
    for share, (bias, rms) in BOUNDS[way].items():
        ends = spread.end_of_days
        count = ends[ends <= np.ceil(share * len(spread))][-1]
        kept = weigh_by_year(spread.first(count), *year)
        assert kept.weight.sum() == pytest.approx(1)
        difference = compute_energy(skylines.transfer(kept), berlin).full_load_hours - true
        assert abs(np.nanmean(difference)) < bias / 100 * np.nanmean(true)
        assert np.sqrt(np.nanmean(difference**2)) < rms / 100 * np.nanmean(true)


@pytest.mark.slow
def test_kept_suns_are_weighed_by_the_year_they_stand_for(berlin):
    """The settings tell of the interruption, weights are shares of the year, errors are not too
    small.
    """
    scene, request = three_houses(), Request(suns="hourly", samples=16, shadow_samples=4)
    part = study.trace_scene(scene, berlin, request, cancel_at("suns", 0.1))
    count = part.record.interrupted["suns_traced"]
    assert 0.05 < count / part.record.interrupted["of"] < 0.1 + 1 / 12  # a block is a twelfth
    assert part.suns.sampling == f"hourly:{count}"
    match = match_suns(part.suns, *berlin.axis)
    share = np.bincount(match.index[match.weight[:, 0] > 0, 0], minlength=count)
    np.testing.assert_allclose(part.suns.weight, share / share.sum(), atol=1e-9)
    alone = trace_gather(scene, part.suns.first(count), request, silent)
    # Not the same surface by surface: the sums were made with other weights, and four points (two
    # pairs) tell an error roughly. But it is not too small on the whole.
    one, other = part.direct_annual_standard_error, alone.direct_annual_standard_error
    assert np.quantile(one[other > 0] / other[other > 0], 0.05) > 0.5
    assert np.median(one[other > 0] / other[other > 0]) > 1
    assert 1 < np.sqrt((one**2).mean() / (other**2).mean()) < 1.3
    check = study.measure_sun_sampling(scene, berlin, part, request)
    assert check["patches"] > 5
    assert 0 < check["rms"] < 5


@pytest.mark.parametrize(
    ("way", "largest"), [("days:24", 0.18), ("typical-days:12", 0.36), ("days:60", 0.09)]
)
def test_an_interruption_loses_a_small_share_of_the_suns(way, largest):
    """A day has about 12 suns: 24 days are cut into six blocks of four days, 12 typical days into
    three.
    """
    suns = suns_of(way, start="2021-01-01", days=365)
    for patches in (10, 30_000):
        blocks = sun_blocks.cut_into_blocks(suns, patches)
        assert max(block.stop - block.start for block in blocks) <= largest * len(suns)
        assert [sun_blocks.count_kept(suns, blocks[: k + 1]) for k in range(len(blocks))] == [
            b.stop for b in blocks
        ]


def test_where_days_are_cut_suns_are_kept_up_to_their_ends():
    """So many patches that there is room for six suns."""
    suns = suns_of("typical-days:8")
    narrow = sun_blocks.cut_into_blocks(suns, int(sun_blocks.BYTES_PER_BLOCK / 4 / 6))
    assert max(block.stop - block.start for block in narrow) == 6
    kept = {sun_blocks.count_kept(suns, narrow[:number]) for number in range(len(narrow) + 1)}
    assert kept == {0, *suns.end_of_days.tolist()}
    assert sun_blocks.cut_into_blocks(suns_towards([[0, 0, 1]]), 10**9) == [slice(0, 1)]


def test_an_interruption_is_heard_once_and_the_old_handlers_come_back():
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    told = []
    with Interruption(lambda *report: told.append(report)) as heard:
        heard("sky and reflections", 1, 2, "rays")
        with pytest.raises(KeyboardInterrupt):
            heard.handle(signal.SIGINT, None)
        heard("suns", 1, 2, "rays")
        signal.raise_signal(signal.SIGINT)
        assert heard.asked
        with pytest.raises(CancelledError):
            heard("suns", 2, 2, "rays")
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
    assert len(told) == 2
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before


def test_in_another_thread_nothing_is_heard():
    def work():
        with Interruption(silent) as heard:
            heard("suns", 1, 2, "rays")

    with ThreadPoolExecutor(1) as pool:
        pool.submit(work).result()  # raises what work raises
