"""Colours mean what the legend says: ranges, ticks, materials, and the pixels of a rendered
picture.
"""

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector
from steps import colours_of

from citypv.core.results.colour_map import (
    GROUND,
    MAPS,
    MISSING,
    choose_range,
    linear_light,
    srgb_colour,
)
from citypv.core.settings.errors import InputError
from citypv.operators.city.attributes import (
    CODES,
    QUANTITIES,
    RESULTS,
    Faces,
    read_face_attribute,
    write_face_attribute,
)
from citypv.operators.show import draw_results as rendering
from citypv.operators.show.build_legend import BAR_BOTTOM, BAR_HEIGHT, BAR_WIDTH, LEFT
from citypv.operators.show.colour_faces import (
    CLASS_COLOURS,
    TITLES,
    build_scale,
    colour_faces,
    read_scale,
)
from citypv.operators.show.draw_results import draw_results
from citypv.operators.show.show_city import FORWARD, RIGHT, UP, place_camera


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (312.0, 1187.0, (200, 1200)),
        (0.03, 0.97, (0, 1)),
        (-3.0, 14.0, (-4, 14)),
        (0.0, 0.0, (0, 0.0002)),
    ],
)
def test_ranges_are_round_and_hold_the_values(low, high, expected):
    found = choose_range(np.array([low, high, np.nan]), np.ones(3))
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert found[0] <= low
    assert found[1] >= high


def test_a_range_follows_area_not_the_number_of_faces():
    values, areas = np.array([0.0, 500.0, 1000.0]), np.array([0.001, 1.0, 0.001])
    assert choose_range(values, areas) == (500.0, 600.0)
    assert choose_range(np.full(4, np.nan), np.ones(4)) == (0.0, 1.0)


@pytest.mark.parametrize("name", MAPS)
def test_maps_rise_evenly_in_lightness(name):
    """CIE L* of every map rises in near-equal steps, else equal differences do not look equal."""
    scale = build_scale("full_load_hours", 0.0, 1.0, name)
    colours = scale.colours(np.linspace(0, 1, 101))
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    luminance = linear @ [0.2126, 0.7152, 0.0722]
    lightness = np.where(luminance > 0.008856, 116 * np.cbrt(luminance) - 16, 903.3 * luminance)
    steps = np.diff(lightness)
    assert (steps > 0).all()
    assert (
        np.abs(lightness - np.linspace(lightness[0], lightness[-1], 101)).max() < 6
    )  # a rainbow is off by 40


def test_the_map_of_differences_is_even_and_neutral_at_zero():
    """CIE76 distances between equal steps are equal on both sides, and lightness is the
    same at ±x.
    """
    scale = build_scale("change_of_full_load_hours", -1.0, 1.0)
    linear = linear_light(scale.colours(np.linspace(-1, 1, 17)))
    tristimulus = linear @ np.array(
        [[0.4124, 0.2126, 0.0193], [0.3576, 0.7152, 0.1192], [0.1805, 0.0722, 0.9505]]
    )
    x, y, z = np.cbrt(tristimulus / [0.9505, 1.0, 1.089]).T
    lab = np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=1)
    steps = np.linalg.norm(np.diff(lab, axis=0), axis=1)
    np.testing.assert_allclose(steps, np.linalg.norm([53 / 8, 42 / 8]), rtol=0.05)
    np.testing.assert_allclose(lab[:, 0], lab[::-1, 0], atol=0.7)
    np.testing.assert_allclose(lab[8, 1:], 0, atol=0.5)


def test_values_at_the_ends_beyond_and_missing():
    scale = build_scale("full_load_hours", 200.0, 1200.0)
    found = scale.colours(np.array([200.0, -5.0, 1200.0, 9999.0, 700.0, np.nan]))
    expected = ["440154", "440154", "fde725", "fde725", "21918c", MISSING]
    np.testing.assert_allclose(found, [srgb_colour(text) for text in expected], atol=1e-9)


def test_codes_get_the_colour_of_their_class():
    scale = build_scale("kind")
    found = scale.colours(np.array(list(CODES["kind"].values())))
    np.testing.assert_allclose(
        found, [srgb_colour(text) for text in CLASS_COLOURS["kind"].values()]
    )


def test_the_solid_view_shows_the_same_colours(shown):
    city, ground = shown
    scale = colour_faces(city, ground, "full_load_hours")
    values = read_face_attribute(city.data, "full_load_hours")
    for item, expected in (
        (city, scale.colours(values)),
        (ground, srgb_colour(GROUND)[None]),
    ):
        found = colours_of(item.data).reshape(len(item.data.polygons), 3, 3)
        np.testing.assert_allclose(
            found, np.broadcast_to(expected[:, None], found.shape), atol=0.003
        )


def test_every_attribute_can_be_shown_or_says_what_is_missing(shown, transfer):
    for name in RESULTS.keys() - {quantity.name for quantity in QUANTITIES}:
        write_face_attribute(shown[0].data, name, np.linspace(-1, 2, len(shown[0].data.polygons)))
    for attribute in TITLES:
        assert colour_faces(*shown, attribute).title == TITLES[attribute]
    Faces(*shown).write_results(transfer)
    with pytest.raises(InputError, match="no full load hours yet; run the step that computes it"):
        colour_faces(*shown, "full_load_hours")


def test_the_camera_stands_in_the_south_east_and_sees_everything():
    random = np.random.default_rng(3)
    points = random.normal(size=(200, 3)) * [900.0, 150.0, 40.0] + [5.0, -7.0, 60.0]
    camera = place_camera(bpy.context.scene, points)
    bpy.context.view_layer.update()
    seen = np.array(
        [world_to_camera_view(bpy.context.scene, camera, Vector(point)) for point in points]
    )
    assert (seen[:, 2] > 0).all()
    assert seen[:, 2].max() < camera.data.clip_end
    assert seen[:, 0].min() > 0.015
    assert seen[:, 0].max() < 0.985
    assert seen[:, 1].min() > 0.09  # above the legend's strip
    assert seen[:, 1].max() < 0.985
    # It is as near as it can be: two opposite margins are touched.
    slack = min(
        seen[:, 0].min() + 1 - seen[:, 0].max() - 0.04,
        seen[:, 1].min() + 1 - seen[:, 1].max() - 0.125,
    )
    assert slack < 0.01
    assert FORWARD[0] < 0 < FORWARD[1]  # looks to the north-west
    axes = np.array([RIGHT, UP, FORWARD])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert UP[2] > 0 == RIGHT[2]


@pytest.mark.thorough
@pytest.mark.slow
def test_the_picture_shows_faces_and_legend_in_the_colours_of_their_values(
    scene, transfer, energy, tmp_path, monkeypatch
):
    """Row 0 at the bottom. With two rays per pixel: faces and legend shine by themselves, without
    noise.
    """
    monkeypatch.setattr(rendering, "SAMPLES", 2)
    draw_results(tmp_path, scene, transfer, energy, "clear sky (upper bound)", pictures=["preview"])
    image = bpy.data.images.load(str(tmp_path / "preview.png"))
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(pixels)
    width, height = image.size
    pixels = pixels.reshape(height, width, -1)[..., :3]
    assert pixels.shape == (900, 1600, 3)
    stage = bpy.context.scene
    bpy.context.view_layer.update()
    graph = bpy.context.evaluated_depsgraph_get()
    eye = stage.camera.matrix_world.translation
    city = bpy.data.objects["City"]
    scale, values, seen = read_scale(city), read_face_attribute(city.data, "full_load_hours"), set()
    for polygon in city.data.polygons:
        ray = polygon.center - eye
        hit, _, _, face, item, _ = stage.ray_cast(graph, eye, ray.normalized())
        if hit and item.name == "City" and face == polygon.index:
            place = world_to_camera_view(stage, stage.camera, polygon.center)
            expected = scale.colours(values[face : face + 1])[0]
            found = pixels[int(place.y * height), int(place.x * width)]
            np.testing.assert_allclose(found, expected, atol=2 / 255, err_msg=f"face {face}")
            seen.add(round(float(values[face]), 3))
    assert len(seen) >= 5
    row = int((BAR_BOTTOM + BAR_HEIGHT / 2) * height)
    columns = np.arange(int(LEFT * height) + 3, int((LEFT + BAR_WIDTH) * height) - 3)
    share = ((columns + 0.5) / height - LEFT) / BAR_WIDTH
    expected = scale.colours(scale.low + share * (scale.high - scale.low))
    np.testing.assert_allclose(pixels[row, columns], expected, atol=4 / 255)
    # Text and ticks are dark on the bright sky: title above the bar, numbers below it, the note at
    # the right.
    ink = pixels.max(axis=2) < 0.4
    bottom, top = int(BAR_BOTTOM * height), int((BAR_BOTTOM + BAR_HEIGHT) * height)
    assert ink[top + 4 : top + 50, : columns[-1]].sum() > 500
    assert ink[bottom - 40 : bottom - 2, : columns[-1] + 40].sum() > 200
    assert ink[bottom - 40 : bottom - 2, -400:].sum() > 200
    assert len(np.unique((pixels * 255).round().astype(np.uint8).reshape(-1, 3), axis=0)) > 300
