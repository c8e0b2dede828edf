"""How far a task is: told from nothing to all, forwards only, and a cancelled one leaves
nothing.
"""

import gzip
import io
import itertools
import json
import shutil
import time
from pathlib import Path
from types import SimpleNamespace

import citygml_text as text
import numpy as np
import pytest
from cities import box, make_city
from cityjson_text import CUBE, at, house, model, row, solid
from thorough import mark_cases
from transfers import unshaded_transfer

from citypv.core.city.build_scene import build_scene
from citypv.core.city.join_contents import JOINING
from citypv.core.effects.table import PLANNING, TABLE
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.light import sun_matrix
from citypv.core.read.open_input import BUFFER
from citypv.core.read.read_city import READING, read_city
from citypv.core.results.exports import RunResults, write_exports
from citypv.core.results.transfer_file import write_transfer
from citypv.core.run.study import make_scene, prepare_study, read_year
from citypv.core.settings import progress
from citypv.core.settings.progress import CancelledError, TerminalProgress
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.weather.read_weather import read_weather

DATA = Path(__file__).parents[1] / "data"


class Kept:
    """Keeps all reports, and cancels at a share of a stage."""

    def __init__(self, stage=None, share=2.0):
        self.stage, self.share, self.reports = stage, share, []

    def __call__(self, stage, done, total, unit):
        self.reports.append((stage, done, total, unit))
        if stage == self.stage and done >= self.share * total:
            raise CancelledError

    def of(self, stage):
        """Shares done, in their order."""
        return np.array([done / total for name, done, total, _ in self.reports if name == stage])


def assert_whole(shares):
    """From nothing to all, forwards, and at the end only once."""
    assert shares[0] == 0
    assert (np.diff(shares) >= 0).all()
    assert shares[-1] == 1
    assert (shares < 1).sum() == len(shares) - 1


def large_files(folder):
    """A file of each format that takes several reads, and one packed."""
    paths = [
        folder / name
        for name in ("city.gml", "city.city.json", "city.city.jsonl", "city.obj", "packed.obj.gz")
    ]
    with gzip.open(DATA / "obj/nyc_midtown_citicorp_1km.obj.gz") as file:
        paths[3].write_bytes(file.read())
    shutil.copy(DATA / "obj/nyc_midtown_citicorp_1km.obj.gz", paths[4])
    count, head = 2000, model({}, [], transform={"scale": [1] * 3, "translate": [0] * 3})
    paths[1].write_text(
        json.dumps(model({f"b{k}": house(at(k)) for k in range(count)}, row(count)))
    )
    lines = [json.dumps(head)]
    for k in range(count):
        own = {
            "CityObjects": {f"b{k}": house(solid())},
            "vertices": [[x + 10 * k, y, z] for x, y, z in CUBE],
        }
        lines.append(json.dumps({"type": "CityJSONFeature", "id": f"b{k}", **own}))
    paths[2].write_text("\n".join(lines) + "\n")
    walls = [
        [(20 * k, 0, 0), (20 * k + 10, 0, 0), (20 * k + 10, 0, 5), (20 * k, 0, 5)]
        for k in range(300)
    ]
    drawn = [text.surface(text.members(text.polygon("", wall))) for wall in walls]
    paths[0].write_text(text.model(*(text.building(wall, name="") + "\n" * 2000 for wall in drawn)))
    return paths


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    return large_files(tmp_path_factory.mktemp("large"))


@pytest.mark.slow
@pytest.mark.parametrize("number", mark_cases([0, 1, 2, slice(3, 5)], kept=1))
def test_reading_is_told(files, number):
    """Several files are one stage, packed ones as well."""
    paths, kept = files[number] if isinstance(number, slice) else [files[number]], Kept()
    city = read_city(paths, progress=kept)
    size = sum(path.stat().st_size for path in paths)
    reading, joining = kept.of(READING), kept.of(JOINING)
    assert_whole(reading)
    assert_whole(joining)
    assert len(reading) > size / BUFFER
    assert np.diff(reading).max() < 0.7
    stages = list(dict.fromkeys(report[0] for report in kept.reports))
    assert stages == [READING, JOINING]
    assert {(total, unit) for stage, _, total, unit in kept.reports if stage == READING} == {
        (size, "B")
    }
    assert {unit for stage, *_, unit in kept.reports if stage == JOINING} == {"polygons"}
    assert len(paths) > 1 or len(city) == len(read_city(paths))


@pytest.mark.parametrize(
    ("number", "stage", "share"),
    [
        (0, READING, 0.5),
        (1, READING, 0.0),
        (2, READING, 0.5),
        (3, READING, 0.0),
        (4, READING, 0.5),
        (1, JOINING, 0.5),
    ],
)
def test_reading_ends_when_it_is_cancelled(files, number, stage, share):
    """No parser puts its own exception in the place of the cancellation, and no file stays open:
    that warns.
    """
    kept = Kept(stage, share)
    with pytest.raises(CancelledError):
        read_city(files[number], progress=kept)
    assert kept.of(stage)[-1] >= share
    assert kept.of(READING)[-1] < 1 or stage == JOINING


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self):
        return True


def let_time_pass(monkeypatch, seconds):
    """As if so much time [s] went by between two reports, however busy the machine is."""
    clock = itertools.count(0.0, seconds).__next__
    monkeypatch.setattr(progress, "time", SimpleNamespace(**{**vars(time), "monotonic": clock}))


@pytest.mark.slow
def test_lines_of_a_terminal_and_of_a_log(files, monkeypatch):
    """One line a stage; where none is to last, the terminal is left as it was and a log stays
    empty.
    """
    for stream, lines in ((Terminal(), 2), (io.StringIO(), 2)):
        let_time_pass(monkeypatch, 0.001)
        read_city(files[1], progress=TerminalProgress(stream))
        assert stream.getvalue().count("\n") == lines
        assert "reading files: 100 %" in stream.getvalue()
        assert "B/s, took" in stream.getvalue()
    terminal, log, slow = Terminal(), io.StringIO(), io.StringIO()
    for stream, seconds in ((terminal, 0.25), (log, 0.1), (slow, 4.0)):
        let_time_pass(monkeypatch, seconds)
        read_city(files[1], progress=TerminalProgress(stream, lasting=False))
    assert "reading files" in slow.getvalue() and "s left" in slow.getvalue()
    assert "100 %" not in slow.getvalue()
    assert log.getvalue() == ""
    assert "s left" in terminal.getvalue()
    assert "\n" not in terminal.getvalue()
    assert terminal.getvalue().endswith("\r\x1b[2K")


@pytest.fixture(scope="module")
def results():
    """City, Scene, Transfer, Energy and Weather of some boxes."""
    city = make_city(
        [polygon for k in range(5) for polygon in box(f"b{k}", 20 * k, 0, 10, 10, 0, 5)]
    )
    scene = build_scene(city, 50, 10, ground="none", patch_size=None)
    weather = read_weather("clear-sky", 50, 10, 0, year=2021)
    suns = choose_suns("typical-days:6", weather.data.index, weather.interval, 50, 10)
    transfer = unshaded_transfer(suns, scene.surfaces.surface_tilt, scene.surfaces.surface_azimuth)
    transfer.surfaces = scene.surfaces
    return city, scene, transfer, compute_energy(transfer, weather), weather


@pytest.mark.slow
def test_writing_is_told(results, tmp_path, monkeypatch):
    run = RunResults(*results)
    city, transfer = run.city, run.transfer
    # blocks of 7 surfaces
    monkeypatch.setattr(sun_matrix, "LIMIT", 16 * 4 * len(transfer.suns) * 7)
    kept = Kept()
    write_transfer(tmp_path / "transfer.nc", transfer, kept)
    shares = kept.of("writing transfer.nc")
    assert_whole(shares)
    assert len(shares) > len(city) / 7
    write_exports(tmp_path, run, ("cityjson", "gltf"), kept)
    assert_whole(kept.of("writing city.city.json"))
    assert_whole(kept.of("writing city.glb"))


@pytest.mark.slow
def test_classifying_tells_many_shares_and_the_plan_each_effect():
    shares, told, request = [], [], Request(weather="clear-sky", suns="days:2")
    scene = make_scene(
        read_city(DATA / "citygml/berlin_opendata_part_v1.gml.gz"), request, shares.append
    )
    assert_whole(np.array(shares))
    assert np.diff(shares).max() < 0.25
    assert len(shares) > 15
    prepare_study(
        scene, read_year(scene.site, request), request, progress=lambda *report: told.append(report)
    )
    planned = [report[1:3] for report in told if report[0] == PLANNING]
    assert planned == [(done, len(TABLE)) for done in range(len(TABLE))]
