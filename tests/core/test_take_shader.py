"""What the shaders of computer graphics say of light."""

import numpy as np
import pytest

from citypv.core.patches.brdfs import Glass, Glossy, Lambertian, Mirror
from citypv.core.patches.materials import ROUGH, SMOOTH, MaterialSpec, luminance

RED = (0.5, 0.2, 0.1)


def test_the_luminance_is_that_of_rec_709():
    """The middle row of IEC 61966-2-1's matrix from linear Rec. 709 to XYZ."""
    middle = np.array(
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    )[1]
    for colour in np.eye(3):
        assert luminance(colour) == pytest.approx(middle @ colour)
    assert luminance((0.3, 0.3, 0.3)) == pytest.approx(0.3)
    assert luminance((1, 1, 1)) == pytest.approx(1)


@pytest.mark.parametrize(
    ("shader", "law"),
    [
        ({}, Lambertian(0.2566)),
        ({"roughness": 0.0}, Lambertian(0.2566)),
        ({"metallic": 1.0, "roughness": 0.0}, Mirror(0.2566)),
        ({"metallic": 1.0, "roughness": SMOOTH}, Mirror(0.2566)),
        ({"metallic": 1.0, "roughness": 0.3}, Glossy(0.2566, 0.09)),
        ({"metallic": 1.0, "roughness": ROUGH}, Lambertian(0.2566)),
        ({"metallic": 1.0, "roughness": 0.3, "transmission": 1.0}, Glossy(0.2566, 0.09)),
        ({"transmission": 1.0}, Glass(1.52, 2)),
        ({"metallic": 0.4, "transmission": 0.6}, Glass(1.52, 2)),
        ({"transmission": 0.4}, Lambertian(0.2566)),
    ],
)
def test_the_larger_part_of_a_shader_counts(shader, law):
    assert MaterialSpec.of_shader(RED, **shader).brdf() == law


def test_what_a_texture_tells_is_not_known():
    """Where it matters."""
    assert MaterialSpec.of_shader(None) is None
    assert MaterialSpec.of_shader(RED, metallic=None) is None
    assert MaterialSpec.of_shader(RED, transmission=None) is None
    assert MaterialSpec.of_shader(RED, metallic=1.0, roughness=None) is None
    assert MaterialSpec.of_shader(RED, roughness=None).brdf() == Lambertian(0.2566)
    assert MaterialSpec.of_shader(
        RED, metallic=1.0, roughness=0.9, transmission=None
    ).brdf() == Lambertian(0.2566)
    assert MaterialSpec.of_shader(None, transmission=1.0).brdf() == Glass(1.52, 2)
