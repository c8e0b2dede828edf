"""The probe tells of a face what the tables of the run say, and of several their sums."""

import bpy
import numpy as np
import pytest
from steps import refuse, run

from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.city.session import Session
from citypv.operators.show.probe_faces import read_charts


def told(city):
    return dict(line.split("|") for line in city["citypv_probe"])


def number(text):
    return float(text.split()[0].rstrip("°").replace(",", ""))


@pytest.mark.slow
def test_a_face_tells_what_its_surface_is_and_yields(city):
    """A roof of the street: 10 m × 5 m, 3 m up over 4 m, to the south."""
    session = Session.of(city)
    row = session.scene.surfaces.surface_id.index("house0_roof_south")
    face = int(np.flatnonzero(read_face_attribute(city.data, "surface") == row)[0])
    assert bpy.ops.citypv.probe(face=face) == {"FINISHED"}
    words = told(city)
    assert (words["Building"], words["Kind"], words["Area"]) == ("house0", "roof south", "50.0 m²")
    assert number(words["Tilt"]) == pytest.approx(np.degrees(np.arctan(3 / 4)), abs=0.06)
    assert number(words["Azimuth"]) == pytest.approx(
        180 - 1.29, abs=0.06
    )  # grid north is not true north
    assert number(words["Full load hours"]) == pytest.approx(
        session.energy.full_load_hours[row], abs=0.51
    )
    assert "±" in words["Full load hours"]
    # What was probed is highlighted until another map is shown.
    assert city["citypv_highlight"]
    bpy.context.scene.citypv.attribute = "kind"
    assert "citypv_highlight" not in city
    months, _ = read_charts(city)
    assert months.sum() == pytest.approx(number(words["Energy"]), abs=0.07)
    energy = number(words["Power"]) * number(words["Full load hours"]) / 1000
    assert number(words["Energy"]) == pytest.approx(energy, rel=0.02)


@pytest.mark.slow
def test_a_building_is_the_sum_of_its_surfaces(city):
    face = int(np.flatnonzero(read_face_attribute(city.data, "building") == 0)[0])
    assert bpy.ops.citypv.probe(face=face, whole=True) == {"FINISHED"}
    whole = told(city)
    assert whole["Surfaces"] == "7"
    power = 0.0
    for surface in range(7):
        face = int(np.flatnonzero(read_face_attribute(city.data, "surface") == surface)[0])
        bpy.ops.citypv.probe(face=face)
        power += number(told(city)["Power"])
    assert number(whole["Power"]) == pytest.approx(power, abs=0.4)
    bpy.ops.citypv.select_group(group="building/house0")
    run("probe")
    assert told(city) == whole


@pytest.mark.slow
def test_nothing_to_probe_says_what_to_do(city):
    bpy.ops.citypv.deselect()
    refuse("probe", "City: no faces are selected; select faces, or click on one")
    refuse("probe", "City: it has no face 100000; give 0 to", face=100000)
    run("trace")
    refuse("probe", "Compute the energy first")
