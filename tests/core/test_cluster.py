"""Cities in tiles and worlds in tasks: the same as in one run, whoever computes them and whatever
comes between.
"""

import json
import pickle
import re
import signal
import socketserver
import subprocess
import threading
import time
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import psutil
import pytest
from lxml import etree
from small_city import house, write_gml
from test_results import assert_same
from weathers import ERA5

from citypv.__main__ import main
from citypv.core.run import run_tasks, trace_tiles
from citypv.core.run.run_tasks import finish_task, read_task, read_told, write_task
from citypv.core.run.study import (
    make_located_scene,
    prepare_study,
    read_buildings,
    read_year,
    trace_scene,
)
from citypv.core.run.tiles import assign_tiles, find_centres
from citypv.core.run.trace_part import bound_hours
from citypv.core.run.trace_tiles import ClusterSettings
from citypv.core.run.write_run import describe_bound
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request

SETTINGS = [
    "--weather",
    str(ERA5),
    "--suns",
    "typical-days:2",
    "--samples",
    "64",
    "--shadow-samples",
    "4",
]
SETTINGS += ["--max-bounces", "2", "--threads", "1"]
PLACES = [(0, 0), (25, 3), (70, 0), (75, 30), (2, 70), (60, 75)]
FIGURES = (
    "visible_share",
    "direct_reflected",
    "diffuse_relative",
    "diffuse_relative_standard_error",
)
FIGURES += (
    "direct_annual_standard_error",
    "covered_share",
    "sky_view_factor",
    "far_ground_view_factor",
    "albedo",
)
FIGURES += ("error_parts",)


@pytest.fixture(scope="module")
def city(tmp_path_factory):
    houses = [house(f"h{k}", place, (10, 9, 6 + k)) for k, place in enumerate(PLACES)]
    return write_gml(tmp_path_factory.mktemp("city") / "four_corners.gml", *houses)


@pytest.fixture(scope="module")
def inputs(city):
    """Weather, Request and PreparedScene of the city."""
    request = Request(
        weather=str(ERA5),
        suns="typical-days:2",
        samples=64,
        shadow_samples=4,
        max_bounces=2,
        threads=1,
    )
    scene = make_located_scene(read_buildings([city], request), request)
    weather = read_year(scene.site, request)
    return prepare_study(scene, weather, request), weather, request


def trace(inputs, folder, word="serial", said=None):
    folder.mkdir(exist_ok=True)
    tell = (lambda line: None) if said is None else said.append
    return trace_tiles.trace_tiles(*inputs, ClusterSettings(word, 60.0), folder, tell=tell)


@pytest.fixture(scope="module")
def serial(inputs, tmp_path_factory):
    return trace(inputs, tmp_path_factory.mktemp("serial"))


def assert_same_bits(one, other):
    assert one.surfaces.surface_id == other.surfaces.surface_id
    for name in FIGURES:
        assert_same(getattr(one, name), getattr(other, name))
    assert one.sources.keys() == other.sources.keys() == {"horizon"}
    assert_same(one.sources["horizon"], other.sources["horizon"])


def test_the_centre_of_a_surface_is_that_of_its_box():
    """One without triangles takes the centre of the one before it."""
    corners = np.array([[0, 0, 5], [4, 0, 5], [0, 2, 5], [10, 10, 0], [10, 10, 6], [16, 10, 0]])
    triangles, owner = np.arange(6).reshape(2, 3), np.array([0, 2])
    scene = SimpleNamespace(
        vertices=corners, triangles=triangles, triangle_surface=owner, surfaces=range(3)
    )
    assert find_centres(scene).tolist() == [[2, 1], [2, 1], [13, 10]]


@pytest.mark.slow
@pytest.mark.parametrize("size", [33.3, 1000.0])
def test_every_surface_is_in_the_one_tile_around_its_centre(inputs, size):
    scene = inputs[0].scene
    tiles, centres = assign_tiles(scene, size), find_centres(scene)
    rows = np.concatenate([rows for _, rows in tiles])
    assert sorted(rows.tolist()) == list(range(len(scene.surfaces)))
    assert len({name for name, _ in tiles}) == len(tiles)
    corner = centres.min(axis=0)
    for name, members in tiles:
        assert (np.diff(members) > 0).all()
        low = corner + size * np.array([int(part) for part in name.split("_")])
        assert (centres[members] >= low - 1e-9).all()
        assert (centres[members] <= low + size + 1e-9).all()


@pytest.mark.slow
def test_tiles_that_leave_nothing_out_are_the_whole(inputs, serial):
    """Rays of a tile's own surfaces are the same as in the whole; only those of its surroundings
    are fewer.
    """
    prepared, weather, request = inputs
    whole = trace_scene(prepared.scene, weather, request, prepared=prepared)
    transfer, told = serial
    assert told["tiles"] == 4
    np.testing.assert_array_equal(transfer.sky_view_factor, whole.sky_view_factor)
    np.testing.assert_array_equal(transfer.visible_share, whole.visible_share)
    np.testing.assert_array_equal(transfer.covered_share, whole.covered_share)
    np.testing.assert_array_equal(transfer.string_loss, whole.string_loss)
    assert whole.string_loss.any()
    errors = np.hypot(
        transfer.diffuse_relative_standard_error, whole.diffuse_relative_standard_error
    )
    assert (np.abs(transfer.diffuse_relative - whole.diffuse_relative) <= 4 * errors + 1e-12).all()
    eligible = transfer.surfaces.eligible
    apart = np.abs(transfer.diffuse_relative - whole.diffuse_relative)[eligible]
    assert (
        apart.max() < 1e-3
    )  # no more than what the few reflections from a neighbouring tile's ground differ by
    assert transfer.record.hemisphere_rays > whole.record.hemisphere_rays
    assert transfer.record.request == request.as_dict()


@pytest.mark.slow
def test_what_is_left_out_lies_within_its_bound(tmp_path):
    """Two houses, and a block 1 km long that rises less than 2° behind the fields in the east."""
    houses = [house("a", (0, 0), (10, 9, 7)), house("b", (0, 40), (10, 9, 7))]
    city = write_gml(
        tmp_path / "fields.gml", *houses, house("c", (900, -500), (12, 1000, 20), ridge=6.0)
    )
    found = []
    for name, more in (("whole", []), ("tiles", ["--cluster", "serial", "--tile", "500"])):
        assert (
            main(
                ["simulate", str(city), "--out", str(tmp_path / name), "--quiet", *SETTINGS, *more]
            )
            == 0
        )
        faces = pd.read_csv(tmp_path / name / "faces.csv", index_col="surface_id").query("eligible")
        found.append(faces["poa_global_annual"])
    told = json.loads((tmp_path / "tiles" / "summary.json").read_text(encoding="utf-8"))["tiles"]
    whole, tiles = found
    # A band of 1.7° over 58° of azimuth holds 1 % of what an east wall sees, and reflects some
    # light.
    assert 0 < (tiles - whole)["a_east"] < 0.02 * whole["a_east"]
    error = 100 * ((tiles - whole) @ faces["area"] / (whole @ faces["area"]))
    assert 0 < error < told["bound"] < 5.0
    assert told["farthest"] < 900


@pytest.mark.slow
def test_glass_has_no_bound_unless_nothing_is_left_out(inputs, tmp_path):
    """At grazing incidence glass reflects all light, so that no series of reflections has
    an end.
    """
    _, weather, _ = inputs
    _, told = trace_tiles.trace_tiles(
        *inputs, ClusterSettings("serial", 500.0), tmp_path, tell=[].append
    )
    assert told["tiles"] == 1
    assert told["left_out"] == {"sky": 0.0, "reflected": 0.0}
    assert bound_hours(told["left_out"], 1.0, weather, "isotropic", 100.0) == 0.0
    assert "changes at most 0.00 %" in describe_bound(told | {"bound": 0.0})
    shares = told["left_out"] | {"reflected": 1e-6}
    assert bound_hours(shares, 1.0, weather, "isotropic", 100.0) is None
    assert 0 < bound_hours(shares, 0.9, weather, "isotropic", 100.0) < 0.01
    assert describe_bound(told | {"bound": None}).endswith(
        "; no bound is known for what lies beyond"
    )


@pytest.mark.slow
def test_a_large_city_is_planned_from_its_fullest_tile(inputs, serial, tmp_path, monkeypatch):
    monkeypatch.setattr(trace_tiles, "LARGEST", 100)
    prepared, weather, request = inputs
    said = []
    planned = trace_tiles.plan_tiles(
        prepared.scene, weather, request, ClusterSettings("serial", 60.0), said.append
    )
    assert said == [
        "  (decided for tile 000_000, which has most surfaces)"
    ]  # with two of the houses, as 001_000
    assert planned.patches is None
    transfer, _ = trace((planned, weather, request), tmp_path / "planned")
    assert_same_bits(transfer, serial[0])


@pytest.mark.slow
def test_two_workers_of_which_one_is_killed_give_the_same_bits(inputs, serial, tmp_path):
    """As soon as one tile is done, the workers are killed in the middle of the next ones."""
    killed = []

    def kill_workers(folder):
        while not list(folder.glob("*.json")):
            time.sleep(0.02)
        for child in psutil.Process().children(recursive=True):
            if "spawn_main" in " ".join(child.cmdline()):
                child.kill()
                killed.append(child.pid)

    said, folder = [], tmp_path / "local"
    folder.mkdir()
    killer = threading.Thread(target=kill_workers, args=(folder,))
    killer.start()
    transfer, _ = trace(inputs, folder, "local:2", said)
    killer.join()
    assert killed
    assert re.fullmatch(r"2 workers; dashboard at http://127\.0\.0\.1:\d+/status", said[1])
    assert_same_bits(transfer, serial[0])
    assert [path.name[:4] for path in folder.glob("*.task")] in ([], ["run_"])


@pytest.mark.slow
def test_a_second_run_goes_on_from_finished_tiles(city, tmp_path, monkeypatch, capfd):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    traced, trace_part = [], trace_tiles.trace_part

    def stop_at_third(*arguments):
        if len(traced) == 2:
            traced.append("stopped")
            signal.raise_signal(signal.SIGINT)
        traced.append(arguments[2])
        return trace_part(*arguments)

    monkeypatch.setattr(trace_tiles, "trace_part", stop_at_third)
    command = ["simulate", str(city), *SETTINGS, "--cluster", "serial", "--tile", "60", "--out"]
    assert main([*command, str(tmp_path / "out")]) == 130
    signal.signal(signal.SIGINT, before)
    assert "2 finished tasks are kept in" in capfd.readouterr().err
    assert not (tmp_path / "out").exists()
    kept = sorted((tmp_path / "out.tasks").glob("*.json"))
    assert len(kept) == 2
    # A damaged result is traced again; what somebody else put there stays.
    flip_bit(kept[0].with_suffix(".nc"))
    (tmp_path / "out.tasks" / "notes.txt").write_text("mine")
    assert main([*command, str(tmp_path / "out")]) == 0
    assert "1 of them were traced by an earlier run" in capfd.readouterr().err
    done = [one for one in traced if one != "stopped"]
    assert len(done) == 5 and len(set(done)) == 4
    assert [path.name for path in (tmp_path / "out.tasks").iterdir()] == ["notes.txt"]
    assert main([*command, str(tmp_path / "again"), "--quiet"]) == 0
    for name in ("faces.csv", "groups.csv", "buildings.csv"):
        assert (tmp_path / "out" / name).read_bytes() == (tmp_path / "again" / name).read_bytes()


def flip_bit(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def test_only_what_a_task_has_written_is_its_result(tmp_path):
    """Swapped, damaged in any byte of either file, cut, or half there: it is computed again."""
    one, other = (
        tmp_path / f"{name}_{24 * digit}.nc" for name, digit in (("000_000", "a"), ("000_001", "b"))
    )
    for path in (one, other):
        finish_task(
            path,
            lambda file, path=path: file.write_bytes(path.name.encode() * 50),
            {"name": path.name},
        )
    files = {
        path: path.read_bytes()
        for path in (one, other, *(own.with_suffix(".json") for own in (one, other)))
    }
    assert [read_told(path) for path in (one, other)] == [{"name": one.name}, {"name": other.name}]

    def told_with(changes):
        for path, data in (files | changes).items():
            path.unlink(missing_ok=True)
            if data is not None:
                path.write_bytes(data)
        return read_told(one)

    beside = one.with_suffix(".json")
    assert told_with({}) == {"name": one.name}
    assert told_with({one: files[other]}) is None
    assert told_with({one: files[other], beside: files[other.with_suffix(".json")]}) is None
    for path in (one, beside):
        for data in (None, b"", files[path][:-1], b"\0" * len(files[path]), files[path] + b" "):
            assert told_with({path: data}) is None
        for place in range(0, len(files[path]), 7):
            assert (
                told_with({path: files[path][:place] + b"\xff" + files[path][place + 1 :]}) is None
            )


def test_dask_that_is_missing_is_named(city, tmp_path, refused, monkeypatch):
    monkeypatch.setattr(run_tasks.importlib.util, "find_spec", lambda name: None)
    for command in (["simulate", str(city)], ["world", "unshaded"]):
        said = refused(*command, "--cluster", "local:2", "--out", tmp_path / "out")
        assert "error: --cluster local:2: needs Dask; type: pip install distributed" in said


def test_a_planted_task_is_not_opened(tmp_path):
    """A pickle runs code: who can write to a shared folder must not choose it."""
    ran = tmp_path / "ran"
    path = write_task(tmp_path, "run", pickle.dumps({"suns": 3}))
    assert read_task(path) == {"suns": 3}
    path.write_bytes(b"cpathlib\nPath\n(V" + str(ran).encode() + b"\ntRp0\n.")
    with pytest.raises(InputError, match=f"{path.name}.*not what was written"):
        read_task(path)
    other = tmp_path / "run.task"
    other.write_bytes(pickle.dumps({"suns": 3}))
    with pytest.raises(InputError, match="not what was written"):
        read_task(other)


# -- schedulers that do not answer, programs that are none, errors that workers send back --


@pytest.mark.parametrize("speech", [b"", b"SSH-2.0-x\r\n", b"220"])
def test_a_port_where_no_scheduler_listens_is_named(tmp_path, refused, monkeypatch, speech):
    """One that accepts and stays silent, one that speaks another protocol, and one that stops
    within its greeting.
    """
    monkeypatch.setattr(run_tasks, "PATIENCE", 0.5)

    class Speak(socketserver.BaseRequestHandler):
        def handle(self):
            self.request.sendall(speech)
            with suppress(ConnectionError):  # the caller hangs up
                self.request.recv(1 << 16)

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Speak) as server:
        server.daemon_threads = True
        threading.Thread(target=server.serve_forever, daemon=True).start()
        word = f"tcp://127.0.0.1:{server.server_address[1]}"
        said = refused("world", "unshaded", "--cluster", word, "--out", tmp_path / "out")
        assert "does not answer as a Dask scheduler" in said
        server.shutdown()


def read_broken():
    try:
        etree.fromstring("<a")
    except etree.XMLSyntaxError as error:
        raise InputError("city.gml", "is cut off", "copy it again") from error


def test_an_error_of_a_task_can_be_sent():
    """Dask pickles causes along with an error; those of lxml cannot be pickled."""
    support = pytest.importorskip("tblib.pickling_support")
    with pytest.raises(InputError) as caught:
        run_tasks.run_plainly(read_broken)
    support.install(caught.value)
    assert str(pickle.loads(pickle.dumps(caught.value))) == "city.gml: is cut off; copy it again"


def refuse_workers(address, problem):
    with pytest.raises(InputError, match=problem), run_tasks.open_workers(address):
        pass


@pytest.mark.slow
def test_only_those_with_the_key_are_let_in(tmp_path, monkeypatch):
    """The certificate and the settings are made as docs/guide/many_machines.md says."""
    monkeypatch.setattr(run_tasks, "PATIENCE", 2)
    distributed, yaml = pytest.importorskip("distributed"), pytest.importorskip("yaml")
    from dask import config

    text = (Path(__file__).parents[2] / "docs" / "guide" / "many_machines.md").read_text(
        encoding="utf-8"
    )
    command, settings = (
        re.search("    (openssl req .*)", text)[1],
        re.search("```yaml\n(.*?)```", text, re.DOTALL)[1],
    )

    def settings_of(name):
        (tmp_path / name).mkdir()
        subprocess.run(command.split(), cwd=tmp_path / name, check=True, capture_output=True)
        own = yaml.safe_load(re.sub(r"(cert|key)\.pem", rf"{tmp_path / name}/\1.pem", settings))
        return config.set(config.merge(config.config, own))

    with settings_of("own"):
        local = {"processes": False, "dashboard_address": None, "host": "tls://127.0.0.1"}
        with distributed.LocalCluster(1, security=distributed.Security(), **local) as cluster:
            address = cluster.scheduler_address
            with run_tasks.open_workers(address) as workers:
                assert list(workers.run(pow, [(2, 5)])) == [32]
            wrong = (
                "does not accept this machine's key, or finds none; see docs/guide/many_machines.md"
            )
            with settings_of("foreign"):
                refuse_workers(address, wrong)
            refuse_workers(address.replace("tls:", "tcp:"), "does not answer")
            with config.set({"distributed.comm.tls.client.cert": None}):
                refuse_workers(address, wrong)
            with pytest.raises(
                ValueError, match="No client"
            ):  # else xarray asks its scheduler before it writes
                distributed.default_client()
