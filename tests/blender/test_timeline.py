"""The timeline: frames are hours, faces show the light of that sun, and the user's scene comes
back.
"""

import bpy
import numpy as np
import pandas as pd
import pvlib
import pytest
from steps import colours_of, here, run

from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.city.session import Session, close_sessions
from citypv.operators.show.timeline import SKY, SUN, timeline_of

NOON_IN_JUNE = 5 * 24 + 13  # frame of 12 to 13 h


@pytest.fixture
def traced(addon, city_file):
    run(
        "solar_city",
        weather="clear-sky",
        city_path=str(city_file),
        samples=32,
        shadow_samples=4,
        days=4,
    )
    return here()


@pytest.mark.slow
def test_a_frame_shows_the_direct_light_of_its_hour(traced):
    run("timeline")
    stage = bpy.context.scene
    assert (stage.frame_start, stage.frame_end) == (1, 288)
    stage.frame_set(NOON_IN_JUNE)
    # Roofs to the south are free: direct light of the month's mean DNI at pvlib's angle of
    # incidence.
    session, timeline = Session.of(traced), timeline_of(traced)
    surfaces = session.transfer.surfaces
    # June 11th, 12:30 of UTC+1; the year moves it by 0.1°
    start = pd.DatetimeIndex(["2023-06-11 11:30"], tz="UTC")
    sun = pvlib.solarposition.get_solarposition(
        start, session.weather.latitude, session.weather.longitude
    )
    zenith, azimuth = float(sun["apparent_zenith"].iloc[0]), float(sun["azimuth"].iloc[0])
    values, faces = (
        read_face_attribute(traced.data, name) for name in ("direct_irradiance", "surface")
    )
    south = [row for row, name in enumerate(surfaces.surface_id) if "roof_south" in name]
    assert south
    for row in south:
        plane = surfaces.surface_tilt[row], surfaces.surface_azimuth[row]
        expected = pvlib.irradiance.aoi_projection(*plane, zenith, azimuth)
        shown = values[faces == row] / timeline.dni[NOON_IN_JUNE - 1]
        assert shown == pytest.approx(expected, abs=0.03)  # 0.02 of reflections
    # The lamp shines from there.
    lamp = bpy.data.objects[SUN]
    bpy.context.view_layer.update()
    towards = np.array(lamp.matrix_world.to_3x3().col[2])
    assert np.degrees(np.arcsin(towards[2])) == pytest.approx(90 - zenith, abs=0.2)
    assert np.degrees(np.arctan2(towards[0], towards[1])) % 360 == pytest.approx(azimuth, abs=0.5)
    assert stage.world.name == SKY
    assert traced["citypv_moment"].startswith("June 12–13 h (UTC+1)")
    assert traced["citypv_colour_attribute"] == "direct_irradiance"


@pytest.mark.slow
def test_night_is_dark_and_the_scale_stays(traced):
    bpy.ops.citypv.timeline()
    stage, before = bpy.context.scene, traced["citypv_colour_high"]
    stage.frame_set(1)
    assert not read_face_attribute(traced.data, "direct_irradiance").any()
    assert bpy.data.objects[SUN].data.energy == 0
    assert traced["citypv_colour_high"] == before > 500
    np.testing.assert_allclose(
        colours_of(traced.data)[0], np.array([0x44, 0x01, 0x54]) / 255, atol=0.01
    )


@pytest.mark.slow
def test_the_months_are_parts_of_the_year(traced):
    bpy.context.scene.citypv_seeing.timeline_show = "month_hours"
    bpy.ops.citypv.timeline()
    total = 0
    for month in range(12):
        bpy.context.scene.frame_set(24 * month + 13)
        total = total + read_face_attribute(traced.data, "month_hours").astype(float)
    np.testing.assert_allclose(
        total, read_face_attribute(traced.data, "full_load_hours"), rtol=1e-5
    )
    assert traced["citypv_colour_attribute"] == "month_hours"


@pytest.mark.slow
def test_ending_it_gives_everything_back(traced):
    stage = bpy.context.scene
    stage.frame_start, stage.frame_end = 3, 77
    stage.frame_set(5)
    stage.world = own = bpy.data.worlds.new("mine")
    before = set(bpy.data.objects.keys())
    bpy.ops.citypv.timeline()
    assert stage.world != own
    bpy.ops.citypv.timeline()  # once more does not forget what was before
    run("stop_timeline")
    assert (stage.frame_start, stage.frame_end, stage.frame_current) == (3, 77, 5)
    assert stage.world == own
    assert set(bpy.data.objects.keys()) == before
    assert SKY not in bpy.data.worlds
    assert "citypv_direct_irradiance" not in traced.data.attributes
    assert traced["citypv_colour_attribute"] == "full_load_hours"
    stage.frame_set(50)  # nothing follows any more
    assert "citypv_direct_irradiance" not in traced.data.attributes
    assert not bpy.ops.citypv.stop_timeline.poll()


@pytest.mark.slow
def test_it_goes_on_in_a_reopened_file_and_after_other_weather(traced, tmp_path):
    bpy.ops.citypv.timeline()
    stage = bpy.context.scene
    stage.frame_set(NOON_IN_JUNE)
    before = read_face_attribute(traced.data, "direct_irradiance")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "street.blend"))
    close_sessions()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "street.blend"))
    stage, city = bpy.context.scene, here()
    assert stage.citypv_seeing.timeline
    stage.frame_set(NOON_IN_JUNE - 2)
    assert timeline_of(city) is not None
    stage.frame_set(NOON_IN_JUNE)
    np.testing.assert_allclose(
        read_face_attribute(city.data, "direct_irradiance"), before, rtol=1e-5
    )
    stage.citypv.weather = "climate"
    bpy.ops.citypv.energy()
    assert timeline_of(city) is None
    stage.frame_set(NOON_IN_JUNE)
    assert read_face_attribute(city.data, "direct_irradiance").max() < before.max()
