"""report.html: it opens by itself, and shows the numbers of the files beside it; spoilt files end
in one line.
"""

import base64
import json
import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import shapely
from lxml import etree, html
from small_city import FAST
from thorough import mark_cases

from citypv.core.commands.command_line import main
from citypv.core.results import draw_plan as plan
from citypv.core.results.charts import draw_histograms, style_of_heat, tabulate_heat
from citypv.core.results.describe_errors import summarise_errors
from citypv.core.results.describe_run import describe_poor_years
from citypv.core.results.draw_sun_path import day_path, draw_sun_path, hour_curves
from citypv.core.results.page import table
from citypv.core.results.read_results import read_results, select_mounted, tabulate_histograms
from citypv.core.results.transfer_file import read_transfer, write_transfer

FIGURES = {"plan-roof", "plan-facade", "sun-path"}


class Page:
    """What libxml2 makes of a page, whose tags it must not have to mend."""

    def __init__(self, text):
        parser = html.HTMLParser(encoding="utf-8")
        tree = html.document_fromstring(text.encode(), parser=parser)
        assert {error.type for error in parser.error_log} <= {
            etree.ErrorTypes.HTML_UNKNOWN_TAG
        }  # those of HTML 5
        assert not tree.xpath("//link | //iframe | //object | //@*[starts-with(name(), 'on')]")
        self.references = tree.xpath("//@src | //@href | //@srcset | //@data | //@action")
        self.figures = tree.xpath("//figure[not(ancestor::article)]/@id")
        assert all(len(picture.get("alt")) > 40 for picture in tree.iter("img"))
        self.text = "".join(tree.xpath("//text()[not(parent::script or parent::style)]"))
        self.tables = [
            [[cell.text_content() for cell in row.iter("td", "th")] for row in table.iter("tr")]
            for table in tree.iter("table")
        ]


@pytest.fixture(scope="module")
def page(small_results):
    return Page((small_results / "report.html").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def results(small_results):
    return read_results(small_results)


@pytest.mark.slow
def test_the_report_opens_by_itself(small_results, page):
    assert {path.name for path in small_results.iterdir()} >= {"report.html", "summary.json"}
    assert set(page.figures) == FIGURES
    assert page.references
    for reference in page.references:
        if reference == "#city":  # a place of the page itself
            continue
        assert reference.startswith("data:image/")
        kind, _, content = reference.partition(";base64,")
        picture = base64.b64decode(content, validate=True)
        if kind.endswith("png"):
            assert picture[:8] == b"\x89PNG\r\n\x1a\n"
            continue
        text = picture.decode("utf-8")
        assert "<!DOCTYPE" not in text and "@import" not in text
        targets = re.findall(r'(?:href|src)="([^"]*)"', text) + re.findall(r"url\(([^)]*)\)", text)
        assert all(target.startswith("#") for target in targets)
    style = (
        (small_results / "report.html")
        .read_text(encoding="utf-8")
        .partition("<style>")[2]
        .partition("</style>")[0]
    )
    assert "url(" not in style and "@import" not in style


def test_names_are_escaped(small_results, page):
    assert "in the folder Tom & Co" in page.text
    assert "Tom &amp; Co" in (small_results / "report.html").read_text(encoding="utf-8")
    assert "&lt;b&gt;" in table(("a",), [("<b>",)]) and "<b>" not in table(("a",), [("<b>",)])


def test_the_tables_are_those_of_the_files(small_results, page):
    groups = pd.read_csv(small_results / "groups.csv")
    annual = groups[groups["period"] == "annual"]
    shown = next(
        rows for rows in page.tables if rows[:1] and rows[0][:2] == ["Surfaces", "facing"]
    )[1:]
    assert len(shown) == len(annual) == 6
    for row, (_, one) in zip(shown, annual.iterrows(), strict=True):
        assert row[0] == {"facade": "Facades", "roof": "Pitched roofs"}[one["kind"]]
        assert row[1] == one["orientation"]
        assert float(row[2].replace(",", "")) == one["count"]
        assert float(row[3].replace(",", "")) == pytest.approx(one["area"], abs=0.5)
        assert float(row[4].replace(",", "")) == pytest.approx(one["full_load_hours"], abs=0.05)
        assert float(row[5]) == pytest.approx(one["full_load_hours_standard_error"], rel=0.06)
    totals = json.loads((small_results / "summary.json").read_text(encoding="utf-8"))["totals"]
    first = next(rows for rows in page.tables if "Nominal power [kWp]" in rows[0])[1]
    expected = [totals[name] for name in ("module_area", "kwp", "mwh_per_year")]
    assert [float(text.replace(",", "")) for text in first[1:4]] == pytest.approx(expected, abs=0.5)


@pytest.mark.parametrize("period", ["month", "solar_hour"])
def test_coloured_tables_hold_the_hours_of_groups_csv(results, period):
    """Each cell is rounded, and has the colour that the map's scale gives it."""
    groups = results.groups[results.groups["period"] == period].astype({"index": int})
    tree = html.fragment_fromstring(tabulate_heat(results.groups, period, str), create_parent="div")
    tables = {one.get("data-kind"): one for one in tree.iter("table")}
    assert [*tables] == ["facade", "roof"]
    most = groups["full_load_hours"].max()
    # At night no group yields anything.
    lit = groups.loc[groups["full_load_hours"] > 0, "index"].tolist()
    for kind, rows in groups.groupby("kind"):
        places = [cell.text for cell in tables[kind].xpath(".//thead//th")]
        assert places == [str(index) for index in sorted(set(lit))]
        lines = tables[kind].xpath(".//tbody/tr")
        sides = {line[0].text: line[1:] for line in lines}
        assert set(sides) == set(rows["orientation"])
        for _, one in rows.iterrows():
            if one["index"] not in lit:
                continue
            cell = sides[one["orientation"]][places.index(str(one["index"]))]
            assert cell.text == f"{one['full_load_hours']:,.0f}"
            share = int(cell.get("class")[1:]) / 16
            assert share == pytest.approx(one["full_load_hours"] / most, abs=0.5 / 16 + 1e-9)


def test_letters_on_the_colours_of_the_map_can_be_read():
    """Contrast of at least 4.5 by WCAG 2.2, with its own formula, on each of the seventeen."""
    rules = re.findall(r"background: #(\w{6});.*color: #(\w{3});", style_of_heat())
    assert len(rules) == 17
    for back, ink in rules:
        light = []
        for text in (back, "".join(2 * sign for sign in ink)):
            parts = [int(text[k : k + 2], 16) / 255 for k in (0, 2, 4)]
            parts = [
                part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4
                for part in parts
            ]
            light.append(0.2126 * parts[0] + 0.7152 * parts[1] + 0.0722 * parts[2] + 0.05)
        assert max(light) / min(light) > 4.5


def test_histograms_hold_the_area_and_hours_of_the_groups(small_results, results):
    """groups.csv is written from hourly sums, the bars from faces.csv."""
    annual = pd.read_csv(small_results / "groups.csv").query("period == 'annual'")
    mounted = select_mounted(results.faces)
    edges, areas = tabulate_histograms(mounted)
    assert edges[0] == 0 and mounted["full_load_hours"].max() < edges[-1]
    for kind, rows in annual.groupby("kind"):
        assert areas[kind].sum() == pytest.approx(rows["area"].sum(), rel=1e-4)
        own = mounted[mounted["kind"] == kind]
        mean = np.average(rows["full_load_hours"], weights=rows["area"])
        assert np.average(own["full_load_hours"], weights=own["area"]) == pytest.approx(
            mean, rel=1e-4
        )
        width = edges[1] - edges[0]
        assert (edges[:-1] + width / 2) @ areas[kind] / areas[kind].sum() == pytest.approx(
            mean, abs=width / 2
        )
    drawn = html.fragment_fromstring(draw_histograms(results.faces))
    for figure, area in zip(drawn.iter("figure"), areas.values(), strict=True):
        heights = np.array([float(bar.get("height")) for bar in figure.iter("rect")])
        assert heights / heights.max() == pytest.approx(area / area.max(), abs=1e-3)


@pytest.mark.slow
def test_the_traced_suns_are_drawn_where_they_stand(small_results, results):
    directions = read_transfer(small_results / "transfer.nc").suns.direction
    axes = draw_sun_path(results.times, results.interval, 52.5, 13.4, results.suns).axes[0]
    (dots,) = (line for line in axes.lines if line.get_label().startswith("traced"))
    azimuth, elevation = np.radians(dots.get_xdata()), np.radians(dots.get_ydata())
    flat = np.cos(elevation)
    drawn = np.column_stack([flat * np.sin(azimuth), flat * np.cos(azimuth), np.sin(elevation)])
    assert drawn == pytest.approx(directions, abs=1e-6)


@pytest.mark.law
def test_the_plan_has_the_shapes_of_the_city(results):
    """Areas seen from above are area · cos(tilt), by shapely; a wall's line is as long as the
    house, and along it.
    """
    faces, outlines = results.faces, results.outlines
    for row, one in faces.iterrows():
        seen = shapely.Polygon(outlines.rings(row)[0][:, :2]).area
        assert seen == pytest.approx(
            abs(one["area"] * np.cos(np.radians(one["surface_tilt"]))), rel=1e-3, abs=0.05
        )
    row = faces.index[faces["surface_id"] == "a_south"][0]
    ends = plan.facade_line(outlines, row, faces["surface_azimuth"][row])
    along = ends[1] - ends[0]
    assert np.hypot(*along) == pytest.approx(12, abs=0.01)
    # Grid north is 1.28° west of true north there: (13.38° - 15°) · sin 52.5°.
    assert np.degrees(np.arctan2(along[0], along[1])) % 180 == pytest.approx(90 - 1.285, abs=0.05)


def test_the_plan_is_coloured_by_the_hours_of_faces_csv(small_results, results):
    table = pd.read_csv(small_results / "faces.csv").query("eligible")
    for show, kind in (("roof", "roof"), ("facade", "facade")):
        coloured = plan.draw_plan(results.faces, results.outlines, show).axes[0].collections[-1]
        rows = table[table["kind"] == kind]
        expected = rows["full_load_hours"] * rows["area"] / rows["open_area"]
        assert sorted(coloured.get_array()) == pytest.approx(sorted(expected), rel=1e-9)


def test_holes_stay_free():
    square = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], float)
    for hole in (square / 2 + 1, (square / 2 + 1)[::-1]):
        path = plan.area_path([square, hole])
        sums = [shapely.LinearRing(ring).is_ccw for ring in path.to_polygons()]
        assert sums == [True, False]


@pytest.mark.slow
def test_yield_keeps_the_shapes(small_results, tmp_path):
    out = tmp_path / "again"
    assert (
        main(
            [
                "yield",
                str(small_results / "transfer.nc"),
                "--weather",
                "clear-sky",
                "--out",
                str(out),
                "--quiet",
            ]
        )
        == 0
    )
    assert main(["plot", str(out), "--quiet"]) == 0
    page = Page((out / "report.html").read_text(encoding="utf-8"))
    assert set(page.figures) == FIGURES
    assert "upper bound, not an expectation" in page.text
    assert "earlier run" in page.text


@pytest.mark.slow
def test_a_folder_of_an_earlier_version_is_refused_with_the_cure(small_results, tmp_path, refused):
    """As 0.2.0 began: no areas of modules, no sums by kind; citypv yield writes what is missing."""
    old = tmp_path / "old"
    shutil.copytree(small_results, old)
    summary = json.loads((old / "summary.json").read_text(encoding="utf-8"))
    del summary["totals"]["kinds"]
    (old / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
    said = refused("plot", old)
    assert (
        "has no totals.kinds" in said
        and "compute the folder again, by citypv simulate or citypv yield" in said
    )


@pytest.mark.slow
def test_without_shapes_there_is_no_plan_and_that_is_said(small_results, tmp_path):
    write_transfer(
        tmp_path / "plain.nc", replace(read_transfer(small_results / "transfer.nc"), outlines=None)
    )
    assert (
        main(["yield", str(tmp_path / "plain.nc"), "--out", str(tmp_path / "plain"), "--quiet"])
        == 0
    )
    assert main(["plot", str(tmp_path / "plain"), "--quiet"]) == 0
    page = Page((tmp_path / "plain" / "report.html").read_text(encoding="utf-8"))
    assert set(page.figures) == FIGURES - {"plan-roof", "plan-facade"}
    assert "no plan of the city" in page.text


@pytest.mark.slow
@pytest.mark.thorough
def test_runs_too_large_for_a_transfer_have_their_shapes(small_results, tmp_path, monkeypatch):
    monkeypatch.setattr("citypv.core.light.transfer.Transfer.on_disk", True)
    out = tmp_path / "large"
    assert main(["simulate", str(small_results.parent / "city.gml"), "--out", str(out), *FAST]) == 0
    assert not (out / "transfer.nc").exists()
    assert main(["plot", str(out), "--quiet"]) == 0
    assert set(Page((out / "report.html").read_text(encoding="utf-8")).figures) == FIGURES
    results = read_results(out)
    assert results.months.sum(axis=1) == pytest.approx(
        results.faces["full_load_hours"], rel=1e-5, nan_ok=True
    )


@pytest.mark.slow
def test_the_same_folder_gives_the_same_page_and_a_new_run_takes_it_away(small_results, tmp_path):
    shutil.copytree(small_results, tmp_path / small_results.name)
    assert main(["plot", str(tmp_path / small_results.name), "--quiet"]) == 0
    assert (tmp_path / small_results.name / "report.html").read_bytes() == (
        small_results / "report.html"
    ).read_bytes()
    again = [
        "yield",
        str(small_results / "transfer.nc"),
        "--out",
        str(tmp_path / small_results.name),
        "--overwrite",
        "--quiet",
    ]
    assert main(again) == 0
    assert not (tmp_path / small_results.name / "report.html").exists()


SPOIL = {
    "no summary": ("summary.json", None),
    "summary cut": ("summary.json", lambda text: text[: len(text) // 2]),
    "summary of something else": ("summary.json", lambda text: '{"weather": {}}'),
    "no place": ("summary.json", lambda text: text.replace('"latitude"', '"breadth"')),
    "a column less": ("groups.csv", lambda text: text.replace("full_load_hours", "hours")),
    "a word for a number": ("groups.csv", lambda text: text.replace("annual,,", "annual,,many")),
    "a row twice": ("groups.csv", lambda text: text + text.splitlines()[-1] + "\n"),
    "an empty table": ("faces.csv", lambda text: ""),
    "a time series that is none": ("timeseries.nc", lambda text: "nothing"),
    "shapes that are none": ("surfaces.nc", lambda text: "nothing"),
    "another city": ("faces.csv", lambda text: text.replace("a_south", "z_south")),
}


@pytest.mark.parametrize("name", mark_cases(SPOIL, kept=4))
def test_a_spoilt_folder_ends_in_one_line(name, small_results, tmp_path, refused):
    shutil.copytree(small_results, tmp_path / "bad", ignore=shutil.ignore_patterns("report.html"))
    file, change = SPOIL[name]
    path = tmp_path / "bad" / file
    text = path.read_text(encoding="utf-8", errors="replace")
    path.unlink()
    if change:
        assert change(text) != text
        path.write_text(change(text), encoding="utf-8")
    culprit = "surfaces.nc" if name == "another city" else file
    assert culprit in refused("plot", tmp_path / "bad")
    assert not list((tmp_path / "bad").glob("*report*"))


def test_what_is_no_folder_of_results_ends_in_one_line(small_results, tmp_path, refused):
    for place in (tmp_path / "nowhere", tmp_path, small_results / "faces.csv"):
        assert str(place) in refused("plot", place)


def test_without_matplotlib_one_line_tells_how_to_get_it(small_results, monkeypatch, refused):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert "type: pip install matplotlib" in refused("plot", small_results)


def test_the_lead_tells_the_error_of_the_weather(small_results, page):
    """Of the built-in climate it is that of the published table; P90 of several years stands there,
    too.
    """
    assert "P90" not in page.text and "error of the weather is" in page.text
    text = (Path(__file__).parents[2] / "benchmarks/results/climate.md").read_text(encoding="utf-8")
    rows = [
        text.split(f"\n| {name}, without * |")[1].split("\n")[0]
        for name in ("root mean square", "mean")
    ]
    rms, mean = (
        [float(cell) for cell in row.replace("−", "-").strip("| ").split("|")[-4:]] for row in rows
    )
    summary = json.loads((small_results / "summary.json").read_text(encoding="utf-8"))
    summary["weather"] |= {"label": "climatology", "years": 10.0}
    told = summarise_errors(summary)
    assert f"{min(rms):.0f} % (north)" in told and f"{max(rms):.0f} % (east)" in told
    assert f"{min(mean):.0f} to {max(mean):.0f} % too high" in told
    summary["totals"] |= {"p50_mwh_per_year": 12.0, "p90_mwh_per_year": 10.0}
    assert describe_poor_years(summary).endswith("12 MWh (P50) and nine of ten 10 MWh (P90).")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("latitude", "longitude"),
    mark_cases([(52.5, 13.4), (-33.9, 151.2), (1.3, 103.8)], kept=1, law=(0,)),
)
def test_the_sun_stands_where_spherical_trigonometry_says(latitude, longitude):
    """Highest at noon with 90° − |latitude − declination|; ±23.44° at the solstices, to the day and
    refraction.
    """
    for month, declination in ((6, 23.44), (12, -23.44), (3, 0.0)):
        azimuth, elevation = day_path(2021, month, 21, latitude, longitude)
        top = np.nanargmax(elevation)
        assert elevation[top] == pytest.approx(90 - abs(latitude - declination), abs=0.5)
        if abs(latitude - declination) > 5:
            south = latitude > declination
            assert np.cos(np.radians(azimuth[top])) == pytest.approx(-1 if south else 1, abs=0.01)
    times = pd.date_range("2021-01-01", periods=8760, freq="h", tz="UTC")
    curves = hour_curves(times, pd.Timedelta(hours=1), latitude, longitude)
    assert set(curves) <= {f"{hour:02d}:30" for hour in range(24)}
    noon = f"{int((12 - longitude / 15) % 24):02d}:30"
    highest = max(np.nanmax(elevation) for _, elevation in curves.values())
    assert highest == pytest.approx(np.nanmax(curves[noon][1]), abs=2.5)
