"""The program as its users meet it: what it writes, what it says, how it ends."""

import json
import os
import signal
import subprocess
import sys

import pandas as pd
import pytest
from cityjson_text import at, house, model, row
from small_city import TABLES
from test_read_obj import house_statements
from weathers import ERA5

from citypv.__main__ import main
from citypv.core.commands.command_line import COMMANDS, build_parser, read_request
from citypv.core.effects.table import TABLE
from citypv.core.results.describe_run import describe_left_out
from citypv.core.run import study
from citypv.core.settings.progress import describe_progress
from citypv.core.settings.request import Request


def names_in(folder):
    return {path.name for path in folder.iterdir()}


@pytest.fixture(scope="module")
def results(city, tmp_path_factory):
    folder = tmp_path_factory.mktemp("results") / "small"
    low = folder.with_name("low_hills.csv")
    # too low to be simulated
    low.write_text("azimuth,elevation\n0,1\n120,1\n240,1\n", encoding="utf-8")
    options = ["--weather", str(ERA5), "--horizon", str(low), "--out", str(folder), "--quiet"]
    assert main(["simulate", str(city), *options]) == 0
    return folder


@pytest.mark.slow
def test_faces(results):
    faces = pd.read_csv(results / "faces.csv", index_col="surface_id")
    assert faces.index[:3].tolist() == ["a_ground", "a_south", "a_east"]
    assert len(faces) == 3 * 7
    assert faces["kind"][:7].tolist() == [
        "downward",
        "facade",
        "facade",
        "facade",
        "facade",
        "roof",
        "roof",
    ]
    assert faces["orientation"][1:7].tolist() == [
        "south",
        "east",
        "north",
        "west",
        "south",
        "north",
    ]
    assert (
        pd.isna(faces.loc["a_ground", "full_load_hours"])
        and faces.loc["a_ground", "covered_share"] == 1
    )
    hours = faces["full_load_hours"]
    assert hours["c_roof_south"] > hours["c_roof_north"] > hours["c_north"] > 0
    assert 900 < hours["b_roof_south"] < 1300
    assert faces.loc["a_south", "area"] == pytest.approx(96, rel=1e-5)
    # Grid north is 1.28° west of true north there: (13.38° - 15°) · sin 52.5°.
    assert faces.loc["a_south", "surface_azimuth"] == pytest.approx(180 - 1.285, abs=0.02)


def test_summary(results):
    summary = json.loads((results / "summary.json").read_text(encoding="utf-8"))
    assert summary["input"]["surfaces"] == 21
    assert summary["input"]["site"]["latitude"] == pytest.approx(52.5, abs=0.02)
    effects = {effect["key"]: effect for effect in summary["traced"]["effects"]}
    assert set(effects) == set(TABLE)
    for key in ("reflections", "aoi"):
        assert effects[key]["outcome"]["holds"], key
    for key in (
        "receivers",
        "far-ground",
    ):  # no bound is known before the run, which knows what it left out
        assert effects[key]["bound"] is None and 0 <= effects[key]["outcome"]["left_out"] < 0.01, (
            key
        )
    hills = effects["terrain-horizon"]
    assert not hills["on"] and 0 < hills["bound"] < 0.05
    assert -0.1 < effects["aoi"]["share"] < 0
    assert 0 < summary["error_budget"]["sampling_total"] < 1
    assert (
        0 < summary["error_budget"]["sampling_median"] < summary["error_budget"]["sampling_95"] < 10
    )
    assert abs(summary["error_budget"]["sun_sampling"]["bias"]) < 1
    assert summary["totals"]["mwh_per_year"] > 0
    assert summary["weather"]["ghi_annual"] == pytest.approx(1070, rel=0.1)
    assert names_in(results) == TABLES


@pytest.mark.slow
def test_inspect_and_effects(city, capsys):
    assert main(["inspect", str(city), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["report"]["building_count"] == 3
    assert found["kinds"]["facade"]["count"] == 12
    assert main(["effects", str(city), "--json"]) == 0
    effects = {effect["key"]: effect for effect in json.loads(capsys.readouterr().out)}
    assert effects["perez"]["on"]
    assert all(
        effects[key]["seconds"] for key in ("sky-rays", "shadow-rays", "reflections", "perez")
    )
    assert (
        10 * effects["reflections"]["share_standard_error"] < effects["reflections"]["share"] < 0.5
    )
    assert all(effects[key]["share"] for key in ("aoi", "spectrum", "temperature", "far-ground"))
    assert 0 < effects["reflections"]["bound"] < 0.01
    assert (
        main(["effects", str(city), "--suns", "days:2", "--samples", "64", "--shadow-samples", "4"])
        == 0
    )
    assert "until what is left is below" in capsys.readouterr().out
    assert main(["inspect", str(city)]) == 0
    assert "buildings    3" in capsys.readouterr().out


@pytest.mark.slow
def test_a_full_folder_is_not_touched_unless_asked_which_keeps_the_rest(city, tmp_path, capfd):
    (tmp_path / "notes.txt").write_text("mine")
    assert main(["simulate", str(city), "--out", str(tmp_path), "--quiet"]) == 2
    assert "not empty" in capfd.readouterr().err
    assert names_in(tmp_path) == {"notes.txt"}
    (tmp_path / "preview.png").write_text("of an earlier run")
    (tmp_path / "summary.json").write_text('{"versions": {"citypv": "0.2.0"}}')
    assert (
        main(
            [
                "simulate",
                str(city),
                "--out",
                str(tmp_path),
                "--quiet",
                "--overwrite",
                "--samples",
                "16",
            ]
        )
        == 0
    )
    assert names_in(tmp_path) == TABLES | {"notes.txt"}


@pytest.mark.parametrize("command", ["simulate", "effects", "accuracy"])
def test_options_of_several_values_add_up(command):
    arguments = (
        "city.gml --effects trees=off perez=off --weather a.nc b.nc --effects aoi=off trees=off "
        "--weather c.nc"
    )
    arguments += " --usable roof=0.5 --usable facade=0.4,flat=0.3 roof=0.5"
    if command == "simulate":
        arguments += " --out out"
    options = build_parser().parse_args([command, *arguments.split()])
    request = read_request(options)
    assert request.effects == {"trees": False, "perez": False, "aoi": False}
    assert request.weather == ["a.nc", "b.nc", "c.nc"]
    assert request.usable == {"roof": 0.5, "facade": 0.4, "flat": 0.3}
    assert not Request().effects


def test_values_given_replace_those_that_a_method_implies():
    arguments = [
        "simulate",
        "city.gml",
        "--method",
        "paper",
        "--out",
        "out",
        "--effects",
        "trees=on",
        "perez=on",
    ]
    assert read_request(build_parser().parse_args(arguments)).effects == {
        "trees": True,
        "perez": True,
    }


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows cannot send SIGINT to one process")
def test_interrupted_run_leaves_nothing(city, tmp_path):
    out = tmp_path / "out"
    command = [
        sys.executable,
        "-m",
        "citypv",
        "simulate",
        str(city),
        "--out",
        str(out),
        "--samples",
        "400000",
    ]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=tmp_path) as process:
        for line in process.stderr:
            if "sky and reflections" in line:
                process.send_signal(signal.SIGTERM)
                break
        said = process.stderr.read()
        assert process.wait(timeout=60) == 130
    assert said.strip().endswith("interrupted; no results were written")
    assert "Traceback" not in said
    assert names_in(tmp_path) == set()


def test_progress_tells_rate_and_rest():
    assert describe_progress(500e6, 1e9, "rays", 25) == "50 %, 20 Mrays/s, 25 s left"
    assert describe_progress(1e9, 1e9, "rays", 50) == "100 %, 20 Mrays/s, took 50 s"


def test_a_city_60_km_wide_says_so_before_its_ground_is_laid(tmp_path, capfd, monkeypatch):
    """Three houses, one of them 60 km away; laying their ground is stopped, as by somebody who has
    read the line.
    """
    lines = [
        line
        for k, x in enumerate((0, 30, 60_000))
        for line in (f"o h{k}", *house_statements(x, 8 * k))
    ]
    (tmp_path / "wide.obj").write_text("\n".join(lines))
    monkeypatch.setattr(study, "make_located_scene", lambda *_: signal.raise_signal(signal.SIGINT))
    place = "--latitude", "50", "--longitude", "10", "--out", str(tmp_path / "out")
    assert main(["simulate", str(tmp_path / "wide.obj"), *place]) == 130
    assert (
        "60 × 0 km: a scene this wide takes minutes. If the city is smaller, check --unit"
        in capfd.readouterr().err
    )


@pytest.mark.slow
def test_a_reader_may_leave_before_the_end(city):
    """As `head` does: neither an error nor a message."""
    command = [sys.executable, "-m", "citypv", "inspect", str(city), "--json"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == ""
        assert process.wait(60) == 0


@pytest.mark.slow
def test_output_in_a_pipe_is_utf8_whatever_the_machine_speaks(city, tmp_path):
    """JSON has to be, and a code page of Windows lacks most letters."""
    file = tmp_path / f"Łódź −1{city.suffix}"
    file.write_bytes(city.read_bytes())
    command = [sys.executable, "-m", "citypv", "inspect", file.name, "--json"]
    speaks = os.environ | {"PYTHONIOENCODING": "cp1252"}
    found = subprocess.run(command, env=speaks, cwd=tmp_path, capture_output=True, check=True)
    assert json.loads(found.stdout.decode("utf-8"))["report"]["files"] == [file.name]


@pytest.mark.slow
def test_buildings_without_a_shape_are_named_at_the_end(tmp_path, capfd):
    """A footprint alone casts no shadow and has no results: the run's last lines say so, and the
    report's lead.
    """
    foot = {"type": "MultiSurface", "lod": "0", "boundaries": [[[0, 3, 2, 1]]]}
    corners = [[4 * x, 4 * y, 4 * z] for x, y, z in row(2)]
    city = model({"flat 7": house(foot), "solid": house(at(1))}, corners)
    (tmp_path / "city.json").write_text(json.dumps(city), encoding="utf-8")
    few = [
        "--samples",
        "16",
        "--shadow-samples",
        "4",
        "--suns",
        "days:2",
        "--weather",
        "clear-sky",
        "--effects",
    ]
    given = [
        "--latitude",
        "52",
        "--longitude",
        "13",
        *few,
        "trees=off",
        "--out",
        str(tmp_path / "out"),
    ]
    assert main(["simulate", str(tmp_path / "city.json"), *given]) == 0
    *_, last = capfd.readouterr().err.split("kWp")
    assert "1 building, without a 3D shape: casts no shadow, has no results: flat 7" in last
    summary = json.loads((tmp_path / "out/summary.json").read_text(encoding="utf-8"))
    assert any("1 of" in line and "no shadow" in line for line in describe_left_out(summary))


@pytest.mark.slow
def test_a_run_by_forward_tells_where_its_photons_went_and_is_read_again(city, tmp_path):
    common = ["--weather", str(ERA5), "--quiet", "--out"]
    run = [
        "simulate",
        str(city),
        "--estimator",
        "forward",
        "--suns",
        "typical-days:2",
        "--samples",
        "16",
    ]
    assert main([*run, *common, str(tmp_path / "out")]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    assert summary["settings"]["estimator"] == "forward"
    reasons = {effect["key"]: effect["reason"] for effect in summary["traced"]["effects"]}
    assert "follows light from its source" in reasons["shadow-rays"]
    assert set(summary["traced"]["photons"]) == {"sky", "far ground", "suns", "horizon"}
    assert summary["traced"]["rays"] > summary["traced"]["photons"]["suns"]["emitted"]
    assert summary["error_budget"]["sampling_total"] > 0
    assert abs(summary["error_budget"]["sun_sampling"]["bias"]) < 5
    assert (
        main(["yield", str(tmp_path / "out" / "transfer.nc"), *common, str(tmp_path / "again")])
        == 0
    )
    for name in ("faces.csv", "groups.csv"):
        assert (tmp_path / "again" / name).read_text() == (tmp_path / "out" / name).read_text()


def test_help_loads_no_library_of_numbers():
    """Whoever asks for help waits for none of them; and only for the options of the command that is
    asked for.
    """
    told = (
        "import sys; from citypv.__main__ import main; main(['--help']); print(*sys.modules, "
        "file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in done.stderr.split()}
    assert "citypv" in loaded
    assert not loaded & {
        "numpy",
        "scipy",
        "pandas",
        "numba",
        "pyproj",
        "shapely",
        "xarray",
        "pvlib",
    }
    assert COMMANDS.keys() <= {
        line.split()[0] for line in done.stdout.splitlines() if line.startswith("    ")
    }


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_the_parser_of_one_command_is_that_of_all(command, capsys):
    told = []
    for parser in (build_parser(), build_parser(command)):
        with pytest.raises(SystemExit):
            parser.parse_args([command, "--help"])
        told.append(capsys.readouterr().out)
    assert told[0] == told[1] and "--help" in told[0]


def test_an_unknown_option_points_to_the_help_of_its_command(capsys):
    assert main(["plot", "results", "--overwrite"]) == 2
    assert capsys.readouterr().err == (
        "citypv plot: error: unrecognized arguments: --overwrite; see citypv plot --help\n"
    )


def test_the_program_alone_prints_its_help(capsys):
    assert main([]) == 2
    said = capsys.readouterr()
    assert not said.out and all(f"\n    {name}" in said.err for name in COMMANDS)


@pytest.mark.slow
def test_a_missing_package_is_named_in_one_line(city, tmp_path):
    code = (
        "import sys; sys.modules['embreex.mesh_construction'] = None; "
        "from citypv.__main__ import main; sys.exit(main(sys.argv[1:]))"
    )
    options = ["simulate", city, "--suns", "days:1", "--quiet", "--out", tmp_path / "out"]
    done = subprocess.run(
        [sys.executable, "-c", code, *options], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert done.stderr.splitlines() == [
        "citypv: error: the Python package embreex.mesh_construction is missing; "
        "see docs/guide/install.md"
    ]


@pytest.mark.slow
def test_a_run_says_what_is_next_and_prints_its_summary_as_json(city, tmp_path):
    out = tmp_path / "out"
    command = [sys.executable, "-m", "citypv", "simulate", city, "--suns", "days:1", "--json"]
    done = subprocess.run([*command, "--out", out], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == json.loads((out / "summary.json").read_text("utf-8"))
    lines = done.stderr.splitlines()
    assert lines[-1].startswith(f"Next: citypv plot {out}  #")
    (written,) = (line for line in lines if line.startswith(f"Written to {out} in "))
    assert set(written.partition(": ")[2].split(", ")) == names_in(out)
    (simulated,) = (line for line in lines if line.startswith("Simulated: "))
    assert all(row.title in simulated for row in TABLE.values())
    assert "leaves out nothing" not in done.stderr
